#include "engine/core/frames.h"

#include <algorithm>
#include <charconv>
#include <limits>
#include <numeric>
#include <unordered_set>

#include "engine/core/error.h"

namespace halflight {
namespace {

/// Takes a number off the front of `text`; returns false if there is none, or it is no frame's.
bool take_number(std::string_view& text, FrameNumber& value) {
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || value < kLeastFrame || value > kMostFrame) return false;
    text.remove_prefix(static_cast<std::size_t>(end - text.data()));
    return true;
}

bool take(std::string_view& text, char c) {
    if (!text.starts_with(c)) return false;
    text.remove_prefix(1);
    return true;
}

struct Range {
    FrameNumber first = 0, last = 0, step = 1;

    std::size_t size() const { return static_cast<std::size_t>((last - first) / step) + 1; }
};

Range parse_range(std::string_view subject, std::string_view entry) {
    Range range;
    std::string_view rest = entry;
    bool whole = take_number(rest, range.first);
    range.last = range.first;
    if (whole && take(rest, '-')) {
        whole = take_number(rest, range.last);
        if (whole && take(rest, 'x')) whole = take_number(rest, range.step);
    }
    if (!whole || !rest.empty()) throw Error(subject, "expects N, A-B or A-BxSTEP between commas, not '{}'", entry);
    if (range.last < range.first) throw Error(subject, "'{}' ends before it begins", entry);
    if (range.step < 1) throw Error(subject, "'{}' has a step of {}", entry, range.step);
    return range;
}

/// Takes a decimal number off the front of `text`; its value is whole / power, and power is a power of ten. Returns
/// false if there is no number or it has too many digits.
bool take_decimal(std::string_view& text, std::int64_t& whole, std::int64_t& power) {
    constexpr std::size_t kMostDigits = 12;
    whole = 0, power = 1;
    std::size_t digits = 0;
    bool point = false;
    for (; !text.empty() && digits <= kMostDigits; text.remove_prefix(1)) {
        const char c = text.front();
        if (c == '.' && !point) {
            point = true;
        } else if (c >= '0' && c <= '9') {
            whole = 10 * whole + (c - '0'), power *= point ? 10 : 1;
            ++digits;
        } else {
            break;
        }
    }
    return digits > 0 && digits <= kMostDigits;
}

/// Replaces whole / power by the exact NTSC rate if it is that rate rounded: 23.976, 29.97 and so on.
void snap_to_ntsc(std::int64_t& whole, std::int64_t& power) {
    if (power < 100) return;
    for (const std::int64_t nominal : {24, 30, 48, 60, 120}) {
        // The difference may be half a unit of the last given decimal, or a whole unit if further digits were cut
        // off.
        const std::int64_t difference = whole * 1001 - nominal * 1000 * power;
        if (difference > -1001 && difference < 1001) whole = nominal * 1000, power = 1001;
    }
}

}  // namespace

std::string frames_text(const std::vector<FrameNumber>& frames) {
    std::string text;
    for (std::size_t i = 0; i < frames.size();) {
        std::size_t end = i + 1;  // one past the run with a constant step
        const bool rises = end < frames.size() && frames[end] > frames[i];
        const FrameNumber step = rises ? frames[end] - frames[i] : 0;
        while (rises && end < frames.size() && frames[end] > frames[end - 1] && frames[end] - frames[end - 1] == step)
            ++end;
        if (end - i < 3) end = i + 1;
        text += fmt::format("{}{}", text.empty() ? "" : ",", frames[i]);
        if (end - i > 1) text += fmt::format("-{}", frames[end - 1]);
        if (end - i > 1 && step > 1) text += fmt::format("x{}", step);
        i = end;
    }
    return text;
}

ListPart parse_part(std::string_view subject, std::string_view text) {
    ListPart part;
    const char* const end = text.data() + text.size();
    const auto number = std::from_chars(text.data(), end, part.number);
    const bool slash = number.ec == std::errc() && number.ptr != end && *number.ptr == '/';
    const auto of = slash ? std::from_chars(number.ptr + 1, end, part.of) : number;
    if (!slash || of.ec != std::errc() || of.ptr != end || part.number < 1 || part.number > part.of)
        throw Error(subject, "expects a part as I/N, from 1/N to N/N, not '{}'", text);
    return part;
}

std::vector<FrameNumber> part_of(const std::vector<FrameNumber>& frames, const ListPart& part) {
    const auto begin = [&](std::uint64_t number) {
        return frames.begin() + static_cast<std::ptrdiff_t>(number * frames.size() / part.of);
    };
    return {begin(part.number - 1), begin(part.number)};
}

std::string frames_of_all(std::vector<FrameNumber> frames, std::size_t all, const ListPart& part) {
    std::ranges::sort(frames);
    const std::string whole = part.of == 1 ? std::to_string(all) : fmt::format("part {}/{}", part.number, part.of);
    const std::size_t count = frames.size();
    return fmt::format("frame{} {} ({} of {})", count == 1 ? "" : "s", frames_text(frames), count, whole);
}

FrameRate parse_frame_rate(std::string_view subject, std::string_view text) {
    std::string_view rest = text;
    std::int64_t numerator = 0, denominator = 1;
    bool good = take_decimal(rest, numerator, denominator);
    if (good && denominator == 1 && take(rest, '/')) {
        std::int64_t power = 1;
        good = take_decimal(rest, denominator, power) && power == 1 && denominator > 0;
    } else if (good) {
        snap_to_ntsc(numerator, denominator);
    }
    if (!good || !rest.empty()) throw Error(subject, "expects frames per second as N, N.N or N/D, not '{}'", text);
    const std::int64_t common = std::max<std::int64_t>(std::gcd(numerator, denominator), 1);
    numerator /= common, denominator /= common;
    constexpr std::int64_t kMost = std::numeric_limits<std::int32_t>::max();
    const double rate = static_cast<double>(numerator) / static_cast<double>(denominator);
    if (!(rate >= 0.001 && rate <= 1e6) || numerator > kMost || denominator > kMost)
        throw Error(subject, "expects 0.001 to 1000000 frames per second, not '{}'", text);
    return {static_cast<std::int32_t>(numerator), static_cast<std::int32_t>(denominator)};
}

std::vector<FrameNumber> parse_frames(std::string_view subject, std::string_view text) {
    std::vector<FrameNumber> frames;
    std::unordered_set<FrameNumber> seen;
    for (bool more = true; more;) {
        const std::size_t end = std::min(text.find(','), text.size());
        const Range range = parse_range(subject, text.substr(0, end));
        if (range.size() > kMaxFrames)
            throw Error(subject, "'{}' means {} frames, more than {}", text.substr(0, end), range.size(), kMaxFrames);
        for (std::size_t i = 0; i < range.size(); ++i) {
            const FrameNumber frame = range.first + static_cast<FrameNumber>(i) * range.step;
            if (seen.insert(frame).second) frames.push_back(frame);
        }
        if (frames.size() > kMaxFrames) throw Error(subject, "means more than {} frames", kMaxFrames);
        more = end < text.size();
        text.remove_prefix(std::min(end + 1, text.size()));
    }
    return frames;
}

std::string text(const FrameRate& rate) {
    return rate.denominator == 1 ? std::to_string(rate.numerator)
                                 : fmt::format("{}/{}", rate.numerator, rate.denominator);
}

}  // namespace halflight
