// Which frames of a sequence are meant: "1-10", "1-10x2", "1,5,9-12".
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

namespace halflight {

inline constexpr std::size_t kMaxFrames = std::size_t{1} << 20;  ///< in one list: half a day at 24 frames a second

/// The frames of a comma list, in its order, each once. An entry is N; A-B, both included, A <= B; or A-BxS, every
/// S-th of these from A on. Numbers are decimal, 0 to 2^32 - 1, S >= 1; there is no space. Throws Error whose subject
/// is `subject`: anything else, or more than kMaxFrames.
std::vector<std::uint32_t> parse_frames(std::string_view subject, std::string_view text);

}  // namespace halflight
