#include "engine/core/frames.h"

#include <algorithm>
#include <charconv>
#include <unordered_set>

#include "engine/core/error.h"

namespace halflight {
namespace {

/// Takes a number off the front of `text`; false where there is none or it is too large.
bool take_number(std::string_view& text, std::uint32_t& value) {
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc()) return false;
    text.remove_prefix(static_cast<std::size_t>(end - text.data()));
    return true;
}

bool take(std::string_view& text, char c) {
    if (!text.starts_with(c)) return false;
    text.remove_prefix(1);
    return true;
}

struct Range {
    std::uint32_t first = 0, last = 0, step = 1;

    std::size_t size() const { return std::size_t{(last - first) / step} + 1; }
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
    if (!whole || !rest.empty()) throw Error(subject, "wants N, A-B or A-BxSTEP between commas, not '{}'", entry);
    if (range.last < range.first) throw Error(subject, "'{}' ends before it begins", entry);
    if (range.step == 0) throw Error(subject, "'{}' has a step of 0", entry);
    return range;
}

}  // namespace

std::vector<std::uint32_t> parse_frames(std::string_view subject, std::string_view text) {
    std::vector<std::uint32_t> frames;
    std::unordered_set<std::uint32_t> seen;
    for (bool more = true; more;) {
        const std::size_t end = std::min(text.find(','), text.size());
        const Range range = parse_range(subject, text.substr(0, end));
        if (range.size() > kMaxFrames)
            throw Error(subject, "'{}' means {} frames, more than {}", text.substr(0, end), range.size(), kMaxFrames);
        for (std::size_t i = 0; i < range.size(); ++i) {
            const auto frame = static_cast<std::uint32_t>(range.first + i * range.step);
            if (seen.insert(frame).second) frames.push_back(frame);
        }
        if (frames.size() > kMaxFrames) throw Error(subject, "means more than {} frames", kMaxFrames);
        more = end < text.size();
        text.remove_prefix(std::min(end + 1, text.size()));
    }
    return frames;
}

}  // namespace halflight
