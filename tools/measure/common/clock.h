// The clock of the figures in a report.
#pragma once

#include "engine/core/stopwatch.h"

namespace halflight {

/// The CPU time of all threads is more reliable on a shared machine.
enum class Clock { wall, cpu };

inline double by(Clock clock, const Seconds& seconds) {
    return clock == Clock::wall ? seconds.wall : seconds.cpu;
}

}  // namespace halflight
