// How far a render is, on stderr: a bar on a terminal, now and then a line elsewhere.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <string>

#include "renderer/render.h"

namespace halflight {

/// "0:07", "12:34", "1:02:03"; negative counts as 0.
std::string clock_text(double seconds);

/// Seconds still to go, by the pace so far. `time_limit` as in RenderSettings.
double seconds_remaining(const RenderProgress& progress, double time_limit);

/// "3/24 frames, 1.20 s/frame, 0:26 remaining"; failed ones count as done.
std::string sequence_text(std::size_t done, std::size_t total, double seconds);

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

/// How far a sequence is, in one line that a terminal keeps up to date, and one for each frame elsewhere.
class SequenceDisplay {
  public:
    SequenceDisplay(std::FILE* stream, bool quiet, std::size_t frames);
    SequenceDisplay(const SequenceDisplay&) = delete;
    SequenceDisplay& operator=(const SequenceDisplay&) = delete;
    ~SequenceDisplay() { clear(); }

    /// Within a frame.
    void show(std::uint32_t frame, const RenderProgress& progress);
    /// `seconds` since the first frame began.
    void made(std::uint32_t frame, std::size_t made, std::size_t failed, double seconds);
    /// Takes the line away, for another one to be written.
    void clear();

  private:
    std::FILE* stream_;
    bool quiet_;
    bool terminal_;
    std::size_t frames_;
    std::string line_;      // of the frames before this one
    double drawn_at_ = -1;  // seconds within the frame
    bool line_shown_ = false;
};

}  // namespace halflight
