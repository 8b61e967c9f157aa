// Resources of the process that drivers use without checks. Without them a driver ends the process by a signal.
#pragma once

namespace halflight::gpu {

/// Prepares the process for its first context, before a driver is loaded; later calls do nothing.
/// - Throws Error where a limit of the address space (RLIMIT_AS) or of the stack (RLIMIT_STACK) leaves too little for
///   a driver.
/// - Reserves the disk space of the index of Mesa's shader cache. Where that fails, for example on a full disk,
///   disables that cache by MESA_SHADER_CACHE_DISABLE in the process's environment.
/// - Sets ZINK_INLINE_UNIFORMS to 0 in the environment unless it is set.
/// - Removes XDG_CACHE_HOME from the environment if it is no absolute path.
void prepare_for_drivers();

/// Returns whether Mesa keeps machine code of its software driver on disk, once a context has been created.
bool mesa_keeps_code();

}  // namespace halflight::gpu
