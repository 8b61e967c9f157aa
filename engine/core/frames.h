// Frames of a sequence: which ones are meant ("1-10", "1-10x2", "1,5,9-12"), and when they are.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace halflight {

inline constexpr std::size_t kMaxFrames = std::size_t{1} << 20;  ///< in one list: half a day at 24 frames a second

/// The frames of a comma list, in its order, each once. An entry is N; A-B, both included, A <= B; or A-BxS, every
/// S-th of these from A on. Numbers are decimal, 0 to 2^32 - 1, S >= 1; there is no space. Throws Error whose subject
/// is `subject`: anything else, or more than kMaxFrames.
std::vector<std::uint32_t> parse_frames(std::string_view subject, std::string_view text);

/// The reverse: "1-10,15,20-30x5", ranges where three or more follow each other by the same step. In the order given.
std::string frames_text(const std::vector<std::uint32_t>& frames);

/// One of so many consecutive parts of a list, whose lengths differ by one at most.
struct ListPart {
    std::uint32_t number = 1;  // from 1 to `of`
    std::uint32_t of = 1;
};
/// "3/24". Throws Error whose subject is `subject`.
ListPart parse_part(std::string_view subject, std::string_view text);
/// Nothing where there are more parts than frames, in some of them.
std::vector<std::uint32_t> part_of(const std::vector<std::uint32_t>& frames, const ListPart& part);

/// Frames per second, exactly.
struct FrameRate {
    std::int32_t numerator = 24;   // > 0
    std::int32_t denominator = 1;  // > 0

    /// When a frame is: frame 0 at 0 s.
    double seconds(double frame) const { return frame * denominator / numerator; }
    bool operator==(const FrameRate&) const = default;
};

/// "24", "12.5", "30000/1001"; 23.976, 29.97 and their like, to two decimals at least, mean N * 1000/1001 (SMPTE
/// 12M). Throws Error whose subject is `subject`: anything else, or beyond 0.001 to 1000000.
FrameRate parse_frame_rate(std::string_view subject, std::string_view text);
/// "24", "30000/1001".
std::string text(const FrameRate& rate);

}  // namespace halflight
