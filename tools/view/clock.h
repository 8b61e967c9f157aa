// The clock of all times of the viewer.
#pragma once

#include <chrono>

namespace halflight::view {

/// Seconds since some moment; never goes back.
inline double now() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

}  // namespace halflight::view
