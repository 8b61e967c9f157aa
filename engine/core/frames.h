// Frames of a sequence: lists of frame numbers ("1-10", "1-10x2", "-5--1,5,9-12"), frame rates and times.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace halflight {

/// Number of a frame, [kLeastFrame, kMostFrame].
using FrameNumber = std::int64_t;
inline constexpr FrameNumber kLeastFrame = -2147483648LL, kMostFrame = 4294967295LL;

/// maximum length of one list: half a day at 24 frames per second
inline constexpr std::size_t kMaxFrames = std::size_t{1} << 20;

/// Returns the frames of a comma-separated list in the given order, without duplicates. An entry is N, A-B (both
/// included, A <= B) or A-BxS (every S-th frame from A on, S >= 1). Frames are decimal numbers, kLeastFrame to
/// kMostFrame; spaces are not allowed. Throws Error with `subject` for anything else and for more than kMaxFrames
/// frames.
std::vector<FrameNumber> parse_frames(std::string_view subject, std::string_view text);

/// Returns the list as text, "1-10,15,20-30x5", in the given order. Three or more frames with a constant step become a
/// range.
std::string frames_text(const std::vector<FrameNumber>& frames);

/// One of `of` consecutive parts of a list. The lengths of the parts differ by one at most.
struct ListPart {
    std::uint32_t number = 1;  // number of the part, 1 to `of`
    std::uint32_t of = 1;
};
/// Reads a part such as "3/24". Throws Error with `subject` for any other text.
ListPart parse_part(std::string_view subject, std::string_view text);
/// Returns the part of a list; some parts are empty if there are more parts than frames.
std::vector<FrameNumber> part_of(const std::vector<FrameNumber>& frames, const ListPart& part);
/// Returns "frames 3,7-9 (4 of 24)" or "frame 4 (1 of part 2/5)", for messages about some frames of the part of a list.
/// `all`: frames of the list.
std::string frames_of_all(std::vector<FrameNumber> frames, std::size_t all, const ListPart& part);

/// An exact frame rate, frames per second.
struct FrameRate {
    std::int32_t numerator = 24;   // > 0
    std::int32_t denominator = 1;  // > 0

    /// Returns the time of a frame, seconds; frame 0 is at 0 s.
    double seconds(double frame) const { return frame * denominator / numerator; }
    bool operator==(const FrameRate&) const = default;
};

/// Reads a frame rate: "24", "12.5" or "30000/1001". 23.976, 29.97 and similar rates, given to two decimals or more,
/// mean N * 1000/1001 (SMPTE 12M). Throws Error with `subject` for anything else and for rates outside 0.001 to
/// 1000000.
FrameRate parse_frame_rate(std::string_view subject, std::string_view text);
/// Returns a rate as text: "24", "30000/1001".
std::string text(const FrameRate& rate);

}  // namespace halflight
