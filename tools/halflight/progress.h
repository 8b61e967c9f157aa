// Progress on stderr: a bar on a terminal, occasional lines elsewhere, or lines of JSON.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <optional>
#include <string>

#include "renderer/render.h"

namespace halflight {

/// Returns a time as "0:07", "12:34" or "1:02:03"; negative times count as 0.
std::string clock_text(double seconds);

/// Part of a picture that earlier runs have rendered (checkpoints).
struct EarlierRuns {
    double samples = 0;  // samples per pixel
    double seconds = 0;
};

/// Estimates the remaining seconds from the pace of this run; none before anything is known. `time_limit` is that of
/// RenderSettings.
std::optional<double> seconds_remaining(const RenderProgress& progress, double time_limit,
                                        const EarlierRuns& earlier = {});

/// Returns "3/24 frames, 1.20 s/frame, 0:26 remaining"; failed frames and those of other processes count as done.
std::string sequence_text(std::size_t done, std::size_t total, double seconds);

/// Returns "12/64 samples, 0:03 elapsed, 0:13 remaining"; with a time limit there is no target number of samples,
/// and before anything is known there are no remaining seconds.
std::string progress_text(const RenderProgress& progress, double time_limit, const EarlierRuns& earlier = {});

/// Returns "25 %, 0:03 elapsed, 0:09 remaining".
std::string share_text(double share, double seconds);

enum class ProgressForm : std::uint8_t {
    none,
    text,  // a bar on a terminal, which is detected by isatty() and TERM; lines elsewhere
    json,  // an object per line, at most one per second
};

/// Returns the form that a command line asks for.
inline ProgressForm progress_form(bool quiet, bool json = false) {
    if (json) return ProgressForm::json;
    return quiet ? ProgressForm::none : ProgressForm::text;
}

/// Returns the progress of a picture as an object of JSON without its braces.
std::string progress_json(const RenderProgress& progress, double time_limit, const EarlierRuns& earlier = {});

class ProgressDisplay {
  public:
    ProgressDisplay(std::FILE* stream, ProgressForm form, double time_limit, const EarlierRuns& earlier = {});
    ProgressDisplay(const ProgressDisplay&) = delete;
    ProgressDisplay& operator=(const ProgressDisplay&) = delete;
    ~ProgressDisplay() { clear(); }

    void show(const RenderProgress& progress);
    /// Shows work without samples. share: the share that is done, [0, 1]; seconds: time since its start.
    void show(double share, double seconds);
    /// Shows "compiling shaders: 3" on a terminal, or in JSON; shows nothing elsewhere.
    void show_step(const char* what, int number);
    /// Removes the bar, so that another line can be written.
    void clear();

  private:
    void show(double share, double seconds, const std::string& text, const std::string& json);
    void draw_bar(double share, const std::string& text);

    enum class Mode { quiet, lines, bar, json };
    std::FILE* stream_;
    double time_limit_;
    EarlierRuns earlier_;
    Mode mode_;
    double drawn_at_ = -1;  // time of the last bar or object, seconds; -1: none
    int tenths_ = 0;        // tenths of the work at the last line
    bool bar_shown_ = false;
};

/// Progress of a sequence: one updated line on a terminal, one line per frame elsewhere, or lines of JSON.
class SequenceDisplay {
  public:
    /// time_limit: that of each frame.
    SequenceDisplay(std::FILE* stream, ProgressForm form, std::size_t frames, double time_limit);
    SequenceDisplay(const SequenceDisplay&) = delete;
    SequenceDisplay& operator=(const SequenceDisplay&) = delete;
    ~SequenceDisplay() { clear(); }

    /// Shows the progress inside a frame.
    void show(FrameNumber frame, const RenderProgress& progress);
    /// Reports a finished frame; `seconds` since the start of the first frame.
    void made(FrameNumber frame, std::size_t made, std::size_t failed, double seconds);
    /// Reports a frame that another process has made; `found`: number of such frames so far.
    void found(FrameNumber frame, std::size_t found, double seconds);
    /// Removes the line, so that another one can be written.
    void clear();

  private:
    void report(FrameNumber frame, const char* what, double seconds);

    std::FILE* stream_;
    ProgressForm form_;
    bool terminal_;  // form_ is text, and `stream_` a terminal
    std::size_t frames_;
    double time_limit_;
    std::size_t made_ = 0, failed_ = 0, found_ = 0;  // numbers of frames
    std::string line_;                               // text about the earlier frames
    double drawn_at_ = -1;  // time of the last line or object, seconds since the start of the frame; -1: none
    bool line_shown_ = false;
};

}  // namespace halflight
