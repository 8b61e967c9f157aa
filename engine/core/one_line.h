// Messages as one line of limited length.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace halflight {

inline constexpr std::size_t kMostMessage = 800;  ///< longest result of one_line(), bytes

/// Returns a message as one line, whatever names and bytes of files it quotes, and whatever a library has put into it.
/// Control characters that a terminal would obey (C0, DEL, C1), and bytes that are not UTF-8, become question marks.
/// The middle of a long message is left out.
std::string one_line(std::string_view text);

}  // namespace halflight
