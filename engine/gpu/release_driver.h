// Ends the driver's work of the process.
#pragma once

namespace halflight::gpu {

/// Terminates the displays of all devices, so that the driver finishes its shader cache: Mesa writes the files in
/// threads that a plain exit would stop. Does nothing if no context was created. Only programs whose contexts are
/// all destroyed and that share the process with no other user of EGL may call it, last.
void release_driver();

}  // namespace halflight::gpu
