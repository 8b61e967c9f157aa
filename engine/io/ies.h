// Light profiles from IES LM-63 files, of 1986, 1991, 1995, 2002 and 2019.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>

#include "engine/scene/light_profile.h"

namespace halflight {

inline constexpr std::size_t kMostIesBytes = std::size_t{1} << 24;  ///< bytes of a file
inline constexpr std::size_t kMostIesValues = std::size_t{1}
                                              << 18;  ///< candela values of a file; 0.5 degrees have 260281

/// Reads the text of a file. `name` becomes LightProfile::name and the subject of errors.
///
/// Candela values are multiplied by the file's candela multiplier and ballast factor, and by the ballast-lamp
/// photometric factor that files of 1986 and 1991 have. A file with half or a quarter of the horizontal angles is
/// symmetric, and its table is completed. Keywords are skipped. Factors of TILT=INCLUDE are checked and not applied,
/// nor is the file of TILT=FILE read: they concern lamps that are mounted at another angle than they were measured.
///
/// Tables of photometric types A and B are sampled at angles of type C, at half their smallest step, with at most 361
/// angles each. Where their angles begin at 0, the other side is symmetric; beyond their angles the lamp is dark.
///
/// Throws Error of one line for files that are damaged, truncated or too large.
LightProfile read_ies(const std::string& name, std::string_view text);

/// Reads a file; its name becomes name and path of the profile. Throws the Error of read_file(), and that of the text.
LightProfile load_ies(const std::filesystem::path& path);

}  // namespace halflight
