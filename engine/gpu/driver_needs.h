// This file prepares a process for what drivers need, and do not check themselves. Without it they end the process by a
// signal, wait forever, or render wrong pictures. Programs prepare their process; the library only checks its host.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <string_view>

namespace halflight::gpu {

/// Prepares the process of a program for drivers. Call it before other threads start, because it changes the process;
/// the library does not call it.
/// - Limits the stacks of threads to 8 MiB each if the address space is limited, with glibc.
/// - Sets ZINK_INLINE_UNIFORMS to 0 and EGL_LOG_LEVEL to "fatal" in the environment unless they are set.
/// - Removes XDG_CACHE_HOME from the environment if it is no absolute path.
/// - Sets MESA_DISK_CACHE_MULTI_FILE to true, so that all versions of Mesa keep one kind of shader cache, and removes
///   MESA_DISK_CACHE_DATABASE and MESA_DISK_CACHE_SINGLE_FILE.
/// - Reserves the disk space of the index of that cache. If that fails, for example on a full disk, disables the
///   cache by MESA_SHADER_CACHE_DISABLE.
void prepare_process();

/// Throws Error if a limit of the address space (RLIMIT_AS), of the stack (RLIMIT_STACK) or of threads
/// (RLIMIT_NPROC, cgroups) leaves too little for a driver. Call it before a driver is loaded; later calls do nothing.
/// `displays` is the number of EGL displays with contexts at the same time, at least 1. Software drivers have threads
/// of their own for each.
void check_process(int displays = 1);

/// Returns why the driver of the current context must not be used in this environment; empty if it may be.
/// prepare_process() removes all reasons. `renderer` and `version` are GL_RENDERER and GL_VERSION.
std::string reason_against_driver(std::string_view renderer, std::string_view version);

/// Returns whether Mesa keeps machine code of its software driver on disk and counts its bytes, once a context has been
/// created.
bool mesa_keeps_code();
/// Returns a counter of the bytes in that cache, which Mesa raises once an entry is on disk.
std::uint64_t mesa_cache_bytes();
/// Waits until the machine code of a program is on disk, where other contexts find it. before: mesa_cache_bytes() when
/// its first dispatch had ended, at the time `finished`. Mesa 22 to 25 write it on a thread of their own after the
/// dispatch and have no call that waits for it, so this watches the counter, for 15 ms at most. Other entries raise the
/// counter, too, and so does a write before the counter was read: the caller then compiles again, or waits in vain.
void wait_for_mesa_code(std::uint64_t before, std::chrono::steady_clock::time_point finished);

}  // namespace halflight::gpu
