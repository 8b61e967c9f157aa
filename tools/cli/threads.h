// The limit of --threads.
#pragma once

namespace halflight {

inline constexpr int kMostThreads = 1024;

/// Limits the threads of the process: those of Mesa's software drivers, of the native tracer, of builds and of the
/// oracle. Must be called before a context exists, by the only thread. A later call replaces the limit.
void limit_threads(int most);

}  // namespace halflight
