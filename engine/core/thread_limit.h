// How many threads the limits of the system allow.
#pragma once

namespace halflight {

/// Starts up to `wanted` threads that exist at the same time, ends them, and returns how many could be started. Some
/// libraries wait without end, or use freed memory, if a part of their threads cannot be started, so callers ask
/// before they load such a library. The kernel may count the ended threads for some milliseconds more.
int startable_threads(int wanted);

}  // namespace halflight
