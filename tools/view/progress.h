// The progress line of the window. Uses no window.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "engine/core/math.h"

namespace halflight::view {

/// State of the viewer's work.
struct Progress {
    std::string activity;             // work of the render thread, such as "compiling"; empty: idle
    int samples = 0;                  // samples per pixel so far; 0: none, or a coarse picture
    int limit = 0;                    // samples per pixel after which rendering stops
    int divisor = 1;                  // Picture::divisor of the newest picture; 0: there is no picture
    std::optional<double> seconds{};  // time per sample; none: unknown yet
    std::optional<double> relmse{};   // estimated relMSE; none: unknown yet
    int denoised = 0;                 // samples of the denoised picture that is shown; 0: the picture is not denoised
    std::optional<ivec2> region{};    // size of the region that takes samples, pixels; none: the whole picture does
};

/// Returns the line: "loading room.glb", "compiling, pass 3 of 12", "64 of 1024 samples, 2 min left, error 0.03". The
/// error is the root of the relMSE, of a denoised picture that of its samples before denoising. A region is named
/// first: "region 320x200: 64 of 1024 samples".
std::string progress_line(const Progress& progress);
/// Returns the share of the samples that are done, [0, 1].
double share_done(const Progress& progress);
/// Returns "40 s", "2 min", "3 h" for a time in seconds, rounded.
std::string rough_time(double seconds);

/// Time per sample, from the times at which pictures of more and more samples came.
class SampleClock {
  public:
    /// Records a picture of `samples` samples at `now`, seconds. A new view starts again.
    void record(std::uint64_t view, int samples, double now);
    /// Returns the seconds per sample; none before the second picture of a view.
    std::optional<double> seconds() const;

  private:
    std::uint64_t view_ = 0;
    int first_ = 0, last_ = 0;  // samples of the first and the newest picture
    double first_time_ = 0, last_time_ = 0;
};

}  // namespace halflight::view
