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

/// Returns the share of the work that is done, [0, 1].
double fraction(const RenderProgress& progress, double time_limit) {
    const double samples = static_cast<double>(progress.samples_done) / std::max(progress.samples_total, 1);
    return std::clamp(time_limit > 0 ? std::max(samples, progress.seconds / time_limit) : samples, 0.0, 1.0);
}

}  // namespace

std::string clock_text(double seconds) {
    const auto whole = static_cast<long long>(std::max(seconds, 0.0));
    const auto h = whole / 3600, m = whole / 60 % 60, s = whole % 60;
    return h > 0 ? fmt::format("{}:{:02}:{:02}", h, m, s) : fmt::format("{}:{:02}", m, s);
}

double seconds_remaining(const RenderProgress& progress, double time_limit) {
    const double done = fraction(progress, time_limit);
    return done > 0 ? progress.seconds * (1 - done) / done : 0;
}

std::string progress_text(const RenderProgress& progress, double time_limit) {
    const std::string goal = time_limit > 0 ? "" : fmt::format("/{}", progress.samples_total);
    return fmt::format("{}{} samples, {} elapsed, {} remaining", progress.samples_done, goal,
                       clock_text(progress.seconds), clock_text(std::ceil(seconds_remaining(progress, time_limit))));
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

std::string progress_json(const RenderProgress& progress, double time_limit) {
    return fmt::format(R"("share": {:.4f}, "samples": {}, "samples_total": {}, "seconds": {:.2f}, )"
                       R"("seconds_remaining": {:.2f})",
                       fraction(progress, time_limit), progress.samples_done,
                       progress.samples_total == kMaxSamples ? "null" : fmt::to_string(progress.samples_total),
                       progress.seconds, seconds_remaining(progress, time_limit));
}

ProgressDisplay::ProgressDisplay(std::FILE* stream, ProgressForm form, double time_limit)
    : stream_(stream),
      time_limit_(time_limit),
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
    show(fraction(progress, time_limit_), progress.seconds, progress_text(progress, time_limit_),
         progress_json(progress, time_limit_));
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

SequenceDisplay::SequenceDisplay(std::FILE* stream, ProgressForm form, std::size_t frames)
    : stream_(stream),
      form_(form),
      terminal_(form == ProgressForm::text && is_terminal(stream)),
      frames_(frames),
      line_(fmt::format("0/{} frames", frames)) {}

void SequenceDisplay::show(std::uint32_t frame, const RenderProgress& progress) {
    const bool json = form_ == ProgressForm::json;
    if (!json && !terminal_) return;
    if (progress.seconds < drawn_at_) drawn_at_ = -1;  // another frame has begun
    if (drawn_at_ >= 0 && progress.seconds - drawn_at_ < (json ? kSecondsPerObject : kSecondsPerBar)) return;
    drawn_at_ = progress.seconds;
    if (json) return put_object(stream_, fmt::format(R"("frame": {}, {})", frame, progress_json(progress, 0)));
    std::string text =
        fmt::format("{}, frame {}: {}/{} samples", line_, frame, progress.samples_done, progress.samples_total);
    text.resize(std::min(text.size(), static_cast<std::size_t>(std::max(columns(stream_) - 1, 0))));
    put(stream_, fmt::format("\r{}\033[K", text));
    std::fflush(stream_);
    line_shown_ = true;
}

void SequenceDisplay::made(std::uint32_t frame, std::size_t made, std::size_t failed, double seconds) {
    line_ = sequence_text(made + failed, frames_, seconds);
    drawn_at_ = -1;
    if (form_ == ProgressForm::json)
        put_object(stream_, fmt::format(R"("frame": {}, "made": {}, "failed": {}, "frames": {}, "seconds": {:.2f})",
                                        frame, made, failed, frames_, seconds));
    if (form_ != ProgressForm::text || terminal_) return;
    put(stream_, fmt::format("halflight: frame {} written: {}\n", frame, line_));
    std::fflush(stream_);
}

void SequenceDisplay::clear() {
    if (line_shown_) put(stream_, "\r\033[K");
    std::fflush(stream_);
    line_shown_ = false;
}

}  // namespace halflight
