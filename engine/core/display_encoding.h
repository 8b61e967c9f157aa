// How display images encode colour, for the tags of picture files and movies.
#pragma once

#include <cstdint>
#include <string>

#include "engine/core/chromaticities.h"

namespace halflight {

/// Curve from linear light to the values of a display image. Numbers are TransferCharacteristics of ITU-T H.273.
enum class TransferCurve : std::uint8_t {
    bt1886 = 1,  // power of 1 / 2.4 (ITU-R BT.1886), which movies tag as the camera's curve of BT.709
    gamma22 = 4,
    srgb = 13,     // IEC 61966-2-1
    pq = 16,       // SMPTE ST 2084: 1 is 10000 nits
    gamma26 = 17,  // SMPTE ST 428-1, without its factor for white
    hlg = 18,      // ARIB STD-B67
};

/// Encoding of RGB display images, with values in [0,1] that use the full range.
struct DisplayEncoding {
    std::uint8_t
        primaries;  // ColourPrimaries of ITU-T H.273: 1 BT.709, 9 BT.2020, 11 P3 with DCI white, 12 P3 with D65
    TransferCurve curve;
    bool operator==(const DisplayEncoding&) const = default;

    /// Returns whether the encoding is that of sRGB, which programs expect of files without tags.
    bool is_srgb() const { return *this == DisplayEncoding{1, TransferCurve::srgb}; }
    /// Returns whether the numbers state the curve exactly. Those of cameras and of cinema stand for others.
    bool exact() const { return curve != TransferCurve::bt1886 && curve != TransferCurve::gamma26; }
    bool is_hdr() const { return curve == TransferCurve::pq || curve == TransferCurve::hlg; }
};

inline constexpr Chromaticities kRec2020{{0.708, 0.292}, {0.170, 0.797}, {0.131, 0.046}, {0.3127, 0.3290}};
inline constexpr Chromaticities kP3Dci{{0.680, 0.320}, {0.265, 0.690}, {0.150, 0.060}, {0.314, 0.351}};  // RP 431-2
inline constexpr Chromaticities kP3D65{{0.680, 0.320}, {0.265, 0.690}, {0.150, 0.060}, {0.3127, 0.3290}};

/// Returns the chromaticities of DisplayEncoding::primaries (ITU-T H.273, table 2). Throws std::out_of_range.
const Chromaticities& chromaticities_of(const DisplayEncoding& encoding);

/// Returns an ICC profile of version 4 for a display of that encoding: matrix and curve (ICC.1:2022, 8.4.3). Equal
/// encodings give equal bytes. Empty for HDR, whose curves such profiles cannot hold.
std::string icc_profile(const DisplayEncoding& encoding);

}  // namespace halflight
