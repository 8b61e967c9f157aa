// Resources of the process that drivers use without checks. Without them a driver ends the process by a signal.
#pragma once

namespace halflight::gpu {

/// Prepares the process for its first context, before a driver is loaded; later calls do nothing. `displays` is the
/// number of EGL displays with contexts at the same time, at least 1. Software drivers have threads of their own for
/// each.
/// - Throws Error where a limit of the address space (RLIMIT_AS), of the stack (RLIMIT_STACK) or of threads
///   (RLIMIT_NPROC, cgroups) leaves too little for a driver.
/// - Limits the stacks of threads that start later to 8 MiB each where the address space is limited, with glibc.
/// - Reserves the disk space of the index of Mesa's shader cache. Where that fails, for example on a full disk,
///   disables that cache by MESA_SHADER_CACHE_DISABLE in the process's environment.
/// - Sets ZINK_INLINE_UNIFORMS to 0 and EGL_LOG_LEVEL to "fatal" in the environment unless they are set.
/// - Removes XDG_CACHE_HOME from the environment if it is no absolute path.
void prepare_for_drivers(int displays = 1);

/// Returns whether Mesa keeps machine code of its software driver on disk, once a context has been created.
bool mesa_keeps_code();

}  // namespace halflight::gpu
