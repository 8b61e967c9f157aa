#include "tools/view/progress.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace halflight::view {

std::string rough_time(double seconds) {
    if (seconds < 1) return "less than 1 s";
    if (seconds < 90) return fmt::format("{:.0f} s", seconds);
    if (seconds < 90 * 60) return fmt::format("{:.0f} min", seconds / 60);
    return fmt::format("{:.0f} h", seconds / 3600);
}

std::string progress_line(const Progress& p) {
    std::string line = p.divisor == 0 || p.samples == 0 ? p.activity : "";
    if (p.samples > 0) {
        const bool done = p.samples >= p.limit;
        line = done ? fmt::format("{} sample{}, done", p.samples, p.samples == 1 ? "" : "s")
                    : fmt::format("{} of {} samples", p.samples, p.limit);
        if (!done && p.seconds) line += fmt::format(", {} left", rough_time(*p.seconds * (p.limit - p.samples)));
        if (p.denoised > 0) line += fmt::format(", denoised at {}", p.denoised);
        if (p.relmse)
            line += fmt::format(", error {}{:.2g}", p.denoised > 0 ? "without denoising " : "", std::sqrt(*p.relmse));
        if (!p.activity.empty() && p.activity != "rendering") line += fmt::format(" ({})", p.activity);
        if (p.region) line = fmt::format("region {}x{}: {}", p.region->x, p.region->y, line);
    } else if (p.divisor > 1) {
        line = fmt::format("{}, 1/{} resolution", line.empty() ? "rendering" : line, p.divisor);
    }
    return line.empty() ? "ready" : line;
}

double share_done(const Progress& p) {
    return p.limit > 0 ? std::clamp(double(p.samples) / p.limit, 0.0, 1.0) : 0;
}

void SampleClock::record(std::uint64_t view, int samples, double now) {
    if (view != view_ || samples < last_) {
        view_ = view;
        first_ = last_ = samples;
        first_time_ = last_time_ = now;
        return;
    }
    if (samples == last_) return;
    last_ = samples;
    last_time_ = now;
}

std::optional<double> SampleClock::seconds() const {
    if (last_ == first_) return std::nullopt;
    return (last_time_ - first_time_) / (last_ - first_);
}

}  // namespace halflight::view
