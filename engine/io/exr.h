// OpenEXR files: single part, scan lines, zip; read back as planes of floats.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/core/chromaticities.h"
#include "engine/core/frames.h"
#include "engine/core/image.h"
#include "engine/core/math.h"

namespace halflight {

enum class ExrType : std::uint8_t {
    half,     // finite values beyond +-65504 are stored as +-65504 rather than as infinity
    float32,  // exact
    uint32,   // ids: the image's floats carry the bits (std::bit_cast), nothing is converted
};

/// Channels that share an image and a type.
struct ExrLayer {
    std::vector<std::string> channels;  // full names, one per channel of the image: "R", "albedo.R", "Z"
    Image image;
    ExrType type = ExrType::float32;
};

/// A layer whose pixels are somebody else's.
struct ExrLayerView {
    std::vector<std::string> channels;
    const Image& image;
    ExrType type = ExrType::float32;
    mat3 color{1};  // that the first three channels are multiplied by on their way into the file
};

/// A place in a sequence (SMPTE 12M), without drop frames.
struct TimeCode {
    int hours = 0;    // [0, 23]
    int minutes = 0;  // [0, 59]
    int seconds = 0;  // [0, 59]
    int frame = 0;    // [0, 29]; above 30 frames a second, the pair
    bool second_of_pair = false;
    bool operator==(const TimeCode&) const = default;
};
/// Of a frame; wraps after 24 hours of its count. Rates of N 1000/1001 count as N do, without drop frames (so that a
/// day of theirs is 86.4 s longer); above 30 a second, pairs of frames are counted, and the field flag marks the second
/// (SMPTE ST 12-1, high frame rates). None where time codes cannot count: other rates, odd ones above 30, any above 60.
std::optional<TimeCode> time_code(const FrameRate& rate, std::uint32_t frame);

/// Cameras are given the engine's way (column vectors, right-handed, looking along -Z, +Y up) and stored the standard's
/// (ImfStandardAttributes.h): Imath's row-vector matrices; worldToCamera left-handed, looking along +Z; worldToNDC with
/// (0, 0) at the display window's upper left and (1, 1) at its lower right corner. Read back they are the engine's
/// again.
struct ExrAttributes {
    std::optional<Chromaticities> chromaticities;
    std::optional<dmat4> world_to_camera;
    std::optional<dmat4> world_to_clip;  // OpenGL clip space: x, y in [-w, w], +y up
    std::optional<FrameRate> frame_rate;
    std::optional<TimeCode> time_code;
    std::string capture_date;  // capDate: local time as "YYYY:MM:DD hh:mm:ss"; see capture_date_now()
    std::string software;
    std::string comments;
    std::map<std::string, std::string> extra;  // further text attributes
};

/// Now. $SOURCE_DATE_EPOCH (seconds, shown as UTC) replaces the clock where files must be the same bit for bit.
std::string capture_date_now();

/// Layers must agree in size, and no channel may come twice. The bytes depend on the arguments only, not on threads.
/// Throws Error; the file is there complete or not at all (files.h).
void write_exr(const std::filesystem::path& path, const std::vector<ExrLayer>& layers, const ExrAttributes& attributes);
/// The same. What differs in the file from what is in memory takes memory for some rows at a time.
void write_exr_views(const std::filesystem::path& path, std::span<const ExrLayerView> layers,
                     const ExrAttributes& attributes);

struct ExrChannel {
    std::string name;
    ExrType type = ExrType::float32;
    std::vector<float> values;  // width * height, top row first; uint32 as bits
};

struct ExrFile {
    int width = 0;  // of the data window; the display window is not looked at
    int height = 0;
    std::vector<ExrChannel> channels;  // sorted by name
    ExrAttributes attributes;

    const ExrChannel* find(const std::string& name) const;  // null where there is none
    /// 1 to 4 channels interleaved, uint32 converted to float. Throws Error that names the one that is missing.
    Image image(const std::vector<std::string>& names) const;
};

/// Whether these are the first bytes of an OpenEXR file.
bool is_exr(std::string_view bytes);

/// What a reader is willing to hold in memory.
struct ExrLimits {
    int max_side = 16384;                              // pixels
    std::uint64_t max_bytes = std::uint64_t{4} << 30;  // of the file, and of its pixels as floats
};

/// The first part of a file with scan lines or tiles (the finest level). Error: damaged, truncated, deep or subsampled
/// data, or beyond the limits. Memory grows with the rows that could be decoded, not with what the header claims.
ExrFile read_exr(const std::filesystem::path& path, const ExrLimits& limits = {});

}  // namespace halflight
