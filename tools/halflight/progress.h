// How far a render is, on stderr: a bar on a terminal, now and then a line elsewhere.
#pragma once

#include <cstdio>
#include <string>

#include "passes/render.h"

namespace halflight {

/// "0:07", "12:34", "1:02:03"; negative counts as 0.
std::string clock_text(double seconds);

/// Seconds still to go, by the pace so far. `time_limit` as in RenderSettings.
double seconds_remaining(const RenderProgress& progress, double time_limit);

/// "12/64 samples, 0:03 elapsed, 0:13 remaining"; with a time limit there is no number of samples to reach.
std::string progress_text(const RenderProgress& progress, double time_limit);

class ProgressDisplay {
  public:
    /// Quiet shows nothing. A terminal is told by isatty() and TERM.
    ProgressDisplay(std::FILE* stream, bool quiet, double time_limit);
    ProgressDisplay(const ProgressDisplay&) = delete;
    ProgressDisplay& operator=(const ProgressDisplay&) = delete;
    ~ProgressDisplay();  ///< clears the bar

    void show(const RenderProgress& progress);

  private:
    void draw_bar(const RenderProgress& progress);

    enum class Mode { quiet, lines, bar };
    std::FILE* stream_;
    double time_limit_;
    Mode mode_;
    double drawn_at_ = -1;  // seconds of the last bar
    int tenths_ = 0;        // of the work, as of the last line
    bool bar_shown_ = false;
};

}  // namespace halflight
