// The clock of all times in the viewer.
#pragma once

#include <chrono>

namespace halflight::view {

/// Returns the seconds since a fixed moment; monotonic.
inline double now() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

}  // namespace halflight::view
