#include "tools/halflight/progress.h"

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <string_view>

#include "tools/cli/console.h"

namespace halflight {
namespace {

constexpr double kSecondsPerBar = 0.1;   // minimum seconds between bars, so that they are readable
constexpr double kSecondsPerObject = 1;  // minimum seconds between objects of JSON

bool is_terminal(std::FILE* stream) {
    const char* term = std::getenv("TERM");
    return isatty(fileno(stream)) && term && std::string_view(term) != "dumb";
}

int columns(std::FILE* stream) {
    winsize size{};
    return ioctl(fileno(stream), TIOCGWINSZ, &size) == 0 && size.ws_col > 0 ? size.ws_col : 80;
}

/// Writes an object of JSON as a line.
void put_object(std::FILE* stream, const std::string& members) {
    put(stream, fmt::format("{{{}}}\n", members));
    std::fflush(stream);
}

/// Returns the share of the work that is done, [0, 1]. seconds: time of all runs.
double fraction(double samples_done, int samples_total, double seconds, double time_limit) {
    const double samples = samples_done / std::max(samples_total, 1);
    return std::clamp(time_limit > 0 ? std::max(samples, seconds / time_limit) : samples, 0.0, 1.0);
}

double fraction(const RenderProgress& progress, double time_limit, const EarlierRuns& earlier) {
    return fraction(progress.samples_done, progress.samples_total, progress.seconds + earlier.seconds, time_limit);
}

}  // namespace

std::string clock_text(double seconds) {
    const auto whole = static_cast<long long>(std::max(seconds, 0.0));
    const auto h = whole / 3600, m = whole / 60 % 60, s = whole % 60;
    return h > 0 ? fmt::format("{}:{:02}:{:02}", h, m, s) : fmt::format("{}:{:02}", m, s);
}

std::optional<double> seconds_remaining(const RenderProgress& progress, double time_limit, const EarlierRuns& earlier) {
    const double done = fraction(progress, time_limit, earlier);
    if (done == 1) return 0;
    const double of_this_run = done - fraction(earlier.samples, progress.samples_total, earlier.seconds, time_limit);
    if (!(of_this_run > 0)) return std::nullopt;
    return progress.seconds * (1 - done) / of_this_run;
}

std::string progress_text(const RenderProgress& progress, double time_limit, const EarlierRuns& earlier) {
    const std::string goal = time_limit > 0 ? "" : fmt::format("/{}", progress.samples_total);
    const std::optional<double> rest = seconds_remaining(progress, time_limit, earlier);
    return fmt::format("{}{} samples, {} elapsed{}", progress.samples_done, goal, clock_text(progress.seconds),
                       rest ? fmt::format(", {} remaining", clock_text(std::ceil(*rest))) : "");
}

std::string share_text(double share, double seconds) {
    const double remaining = share > 0 ? seconds * (1 - share) / share : 0;
    return fmt::format("{:.0f} %, {} elapsed, {} remaining", std::floor(100 * share), clock_text(seconds),
                       clock_text(std::ceil(remaining)));
}

std::string sequence_text(std::size_t done, std::size_t total, double seconds) {
    const double each = done > 0 ? seconds / static_cast<double>(done) : 0;
    return fmt::format("{}/{} frames, {:.2f} s/frame, {} remaining", done, total, each,
                       clock_text(std::ceil(each * static_cast<double>(total - std::min(done, total)))));
}

std::string progress_json(const RenderProgress& progress, double time_limit, const EarlierRuns& earlier) {
    const std::optional<double> rest = seconds_remaining(progress, time_limit, earlier);
    return fmt::format(R"("share": {:.4f}, "samples": {}, "samples_total": {}, "seconds": {:.2f}, )"
                       R"("seconds_remaining": {})",
                       fraction(progress, time_limit, earlier), progress.samples_done,
                       progress.samples_total == kMaxSamples ? "null" : fmt::to_string(progress.samples_total),
                       progress.seconds, rest ? fmt::format("{:.2f}", *rest) : "null");
}

ProgressDisplay::ProgressDisplay(std::FILE* stream, ProgressForm form, double time_limit, const EarlierRuns& earlier)
    : stream_(stream),
      time_limit_(time_limit),
      earlier_(earlier),
      mode_(form == ProgressForm::none   ? Mode::quiet
            : form == ProgressForm::json ? Mode::json
            : is_terminal(stream)        ? Mode::bar
                                         : Mode::lines) {}

void ProgressDisplay::clear() {
    if (bar_shown_) put(stream_, "\r\033[K");
    std::fflush(stream_);
    bar_shown_ = false;
}

void ProgressDisplay::show(const RenderProgress& progress) {
    show(fraction(progress, time_limit_, earlier_), progress.seconds, progress_text(progress, time_limit_, earlier_),
         progress_json(progress, time_limit_, earlier_));
}

void ProgressDisplay::show(double share, double seconds) {
    show(share, seconds, share_text(share, seconds),
         fmt::format(R"("share": {:.4f}, "seconds": {:.2f})", share, seconds));
}

void ProgressDisplay::show_step(const char* what, int number) {
    if (mode_ == Mode::json) put_object(stream_, fmt::format(R"("step": "{}", "number": {})", what, number));
    if (mode_ != Mode::bar) return;
    put(stream_, fmt::format("\r{}: {}\033[K", what, number));
    std::fflush(stream_);
    bar_shown_ = true;
}

void ProgressDisplay::show(double share, double seconds, const std::string& text, const std::string& json) {
    if (mode_ == Mode::bar) {
        if (drawn_at_ >= 0 && seconds - drawn_at_ < kSecondsPerBar) return;
        draw_bar(share, text);
        drawn_at_ = seconds;
    } else if (mode_ == Mode::lines) {
        const int tenths = static_cast<int>(share * 10);
        if (tenths > tenths_) put(stream_, fmt::format("halflight: {}\n", text));
        tenths_ = tenths;
    } else if (mode_ == Mode::json) {
        if (share < 1 && drawn_at_ >= 0 && seconds - drawn_at_ < kSecondsPerObject) return;
        put_object(stream_, json);
        drawn_at_ = seconds;
    }
}

void ProgressDisplay::draw_bar(double share, const std::string& text) {
    const int width = std::max(0, columns(stream_) - static_cast<int>(text.size()) - 4);  // 4: "[", "] ", last column
    const int filled = static_cast<int>(std::lround(share * width));
    const std::string bar = width < 4 ? "" : fmt::format("[{:#<{}}{:.<{}}] ", "", filled, "", width - filled);
    put(stream_, fmt::format("\r{}{}\033[K", bar, text));
    std::fflush(stream_);
    bar_shown_ = true;
}

SequenceDisplay::SequenceDisplay(std::FILE* stream, ProgressForm form, std::size_t frames, double time_limit)
    : stream_(stream),
      form_(form),
      terminal_(form == ProgressForm::text && is_terminal(stream)),
      frames_(frames),
      time_limit_(time_limit),
      line_(fmt::format("0/{} frames", frames)) {}

void SequenceDisplay::show(FrameNumber frame, const RenderProgress& progress) {
    const bool json = form_ == ProgressForm::json;
    if (!json && !terminal_) return;
    if (progress.seconds < drawn_at_) drawn_at_ = -1;  // another frame has begun
    if (drawn_at_ >= 0 && progress.seconds - drawn_at_ < (json ? kSecondsPerObject : kSecondsPerBar)) return;
    drawn_at_ = progress.seconds;
    if (json)
        return put_object(stream_, fmt::format(R"("frame": {}, {})", frame, progress_json(progress, time_limit_)));
    const std::string goal = time_limit_ > 0 ? "" : fmt::format("/{}", progress.samples_total);
    std::string text = fmt::format("{}, frame {}: {}{} samples", line_, frame, progress.samples_done, goal);
    text.resize(std::min(text.size(), static_cast<std::size_t>(std::max(columns(stream_) - 1, 0))));
    put(stream_, fmt::format("\r{}\033[K", text));
    std::fflush(stream_);
    line_shown_ = true;
}

void SequenceDisplay::made(FrameNumber frame, std::size_t made, std::size_t failed, double seconds) {
    made_ = made, failed_ = failed;
    report(frame, "written", seconds);
}

void SequenceDisplay::found(FrameNumber frame, std::size_t found, double seconds) {
    found_ = found;
    report(frame, "made by another process", seconds);
}

void SequenceDisplay::report(FrameNumber frame, const char* what, double seconds) {
    line_ = sequence_text(made_ + failed_ + found_, frames_, seconds);
    drawn_at_ = -1;
    if (form_ == ProgressForm::json)
        put_object(stream_,
                   fmt::format(R"("frame": {}, "made": {}, "failed": {}, "found": {}, "frames": {}, "seconds": {:.2f})",
                               frame, made_, failed_, found_, frames_, seconds));
    if (form_ != ProgressForm::text || terminal_) return;
    put(stream_, fmt::format("halflight: frame {} {}: {}\n", frame, what, line_));
    std::fflush(stream_);
}

void SequenceDisplay::clear() {
    if (line_shown_) put(stream_, "\r\033[K");
    std::fflush(stream_);
    line_shown_ = false;
}

}  // namespace halflight
