// OpenEXR files: one part or several, scan lines or tiles, any compression; read back as planes of floats.
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
    half,     // finite values beyond +-65504 are stored as +-65504, not as infinity
    float32,  // values are stored exactly
    uint32,   // ids: the image's floats hold the bits (std::bit_cast), without conversion
};

/// Channels that share an image and a type.
struct ExrLayer {
    std::vector<std::string> channels;  // full names, one per channel of the image: "R", "albedo.R", "Z"
    Image image;
    ExrType type = ExrType::float32;
    std::string name{};  // name of the layer's part; empty: that of its first channel before the dot
};

/// A layer whose pixels are owned elsewhere.
struct ExrLayerView {
    std::vector<std::string> channels;
    const Image& image;
    ExrType type = ExrType::float32;
    mat3 color{1};       // matrix for the first three channels, applied while writing
    bool exact = false;  // values are data, which lossy compression must not change
    std::string name{};  // ExrLayer::name
    // Number of the layer's view in ExrAttributes::views; -1: none. Channels have names without that of the view.
    int view = -1;
};

enum class ExrCompression : std::uint8_t { none, rle, zips, zip, piz, pxr24, dwaa, dwab };
inline constexpr ExrCompression kExrCompressions[] = {ExrCompression::none, ExrCompression::rle, ExrCompression::zips,
                                                      ExrCompression::zip,  ExrCompression::piz, ExrCompression::pxr24,
                                                      ExrCompression::dwaa, ExrCompression::dwab};
const char* name(ExrCompression compression);
/// Returns the compression of that name. Throws Error for other names.
ExrCompression exr_compression_named(const std::string& name);
/// Returns whether the compression changes values: pxr24 those of float32, dwaa and dwab those of colours.
bool is_lossy(ExrCompression compression);
/// Returns the compression, or zip in place of one that changes values.
ExrCompression lossless(ExrCompression compression);

/// Layout of a file.
struct ExrLayout {
    ExrCompression compression = ExrCompression::zip;
    bool parts = false;  // each layer is a part of its own; exact layers are then stored as zip if others are lossy
    int tile = 0;        // side of square tiles, pixels, [16, 4096]; 0: scan lines
};

/// A position in a sequence (SMPTE 12M), without drop frames.
struct TimeCode {
    int hours = 0;    // [0, 23]
    int minutes = 0;  // [0, 59]
    int seconds = 0;  // [0, 59]
    int frame = 0;    // frame in the second, [0, 29]; above 30 frames per second, number of the pair
    bool second_of_pair = false;
    bool operator==(const TimeCode&) const = default;
};
/// Returns the time code of a frame; it wraps after 24 hours of its count. Rates of N 1000/1001 count like N, without
/// drop frames, so that their count of 24 hours takes 86.4 s longer. Above 30 frames per second, pairs of frames are
/// counted, and the field flag marks the second frame (SMPTE ST 12-1, high frame rates). Returns nothing for other
/// rates, odd ones above 30, and any above 60.
std::optional<TimeCode> time_code(const FrameRate& rate, FrameNumber frame);

/// Attributes of a file. Cameras are given in the engine's convention (column vectors, right-handed, looking along -Z,
/// +Y up). Files have the standard's convention (ImfStandardAttributes.h): Imath's row-vector matrices, worldToCamera
/// left-handed, looking along +Z. worldToNDC has (0, 0) at the display window's upper left and (1, 1) at its lower
/// right corner. Reading converts them back.
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
    std::map<std::string, float> numbers;      // further attributes of type float
    std::map<std::string, int> counts;         // further attributes of type int
    // Views of the layers. A file of one part lists them as multiView, and its channels name theirs: "albedo.left.R",
    // "right.R". Channels of the first view without a period do not: "R". In files of several parts, each part has one.
    std::vector<std::string> views{};
    // Windows: the data window has its upper left pixel at `origin` of the display window, which begins at (0, 0).
    ivec2 origin{0};
    std::optional<ivec2> display;  // size of the display window, pixels; none: it is the data window
};

/// Returns the current date. $SOURCE_DATE_EPOCH (seconds, shown as UTC) replaces the clock if files must be
/// reproducible. Throws Error if it is no number of seconds, or beyond the year 9999.
std::string capture_date_now();
/// Returns whether $SOURCE_DATE_EPOCH is set: files must then not depend on clocks.
bool date_is_fixed();

/// Writes a file, which appears complete or not at all (files.h). Layers must have equal size, and channel names must
/// be unique and have at most 255 bytes. The bytes depend on the arguments only, not on threads. Throws Error, also
/// if lossy compression would change an exact layer.
void write_exr(const std::filesystem::path& path, const std::vector<ExrLayer>& layers, const ExrAttributes& attributes,
               const ExrLayout& layout = {});
/// Writes a file like write_exr(), without copies of the layers: values are converted for some rows at a time.
void write_exr_views(const std::filesystem::path& path, std::span<const ExrLayerView> layers,
                     const ExrAttributes& attributes, const ExrLayout& layout = {});

/// Rectangle of pixels.
struct ExrWindow {
    ivec2 origin{0};  // upper left pixel, in the display window
    ivec2 size{0};
    bool operator==(const ExrWindow&) const = default;
    bool contains(const ExrWindow& other) const;
};

struct ExrChannel {
    std::string name;  // name as in a file of one part, with that of its view
    ExrType type = ExrType::float32;
    std::vector<float> values;  // values of the pixels of the window, top row first; uint32 as bits
    ExrWindow window{};         // data window of the channel's part
    std::string part{};         // name of the channel's part; empty: the file has one flat part
};

/// Layout of the map of all directions that the data window is, by the attribute `envmap`.
enum class ExrEnvmap : std::uint8_t { none, latlong, cube };

struct ExrFile {
    int width = 0;  // width of the data window of the picture's part, pixels
    int height = 0;
    std::vector<ExrChannel> channels;  // channels, sorted by name in each part
    ExrAttributes attributes;          // attributes of the picture's part; `extra` has the texts of all parts
    ExrEnvmap envmap = ExrEnvmap::none;
    std::vector<std::string> deep_parts{};  // names of parts of deep data, which are not read

    const ExrChannel* find(const std::string& name) const;  // Returns null if the channel is missing.
    /// Returns whether a layer belongs to a Cryptomatte that the header names. Its values are ids and coverage.
    bool is_cryptomatte(std::string_view layer) const;
    /// Returns the window that contains those of the channels. Throws Error that names a missing channel.
    ExrWindow window_of(const std::vector<std::string>& names) const;
    /// Returns channels interleaved, for the pixels of a window. Those that a channel lacks are 0. Ids are converted to
    /// float, or kept as bits. Throws Error that names a missing channel.
    Image image(const std::vector<std::string>& names, const ExrWindow& window, bool bits = false) const;
    /// Returns channels like the other image(), for the pixels of window_of() them.
    Image image(const std::vector<std::string>& names) const;
    /// Returns channels like image(), for the pixels of the display window.
    Image displayed(const std::vector<std::string>& names) const;
    /// Returns displayed(). Throws Error with `subject` if a channel's window does not contain the display window.
    Image whole(const std::string& subject, const std::vector<std::string>& names) const;
};

/// Returns whether these are the first bytes of an OpenEXR file.
bool is_exr(std::string_view bytes);

/// Returns 0 for a layer or part whose name says that it is the picture (beauty, combined, rgba), 2 for data that is no
/// light (depth, normals, positions, ids, mattes), and 1 for other names.
int picture_rank(std::string_view name);

/// Limits of a reader's memory.
struct ExrLimits {
    int max_side = 16384;                              // pixels along x and y
    std::uint64_t max_bytes = std::uint64_t{4} << 30;  // bytes of the file, and of its pixels as floats
    std::string reason{};                              // phrase after the limit in errors, such as " (--memory)"
};

/// Returns the limits for pictures that programs render: sides of 65536 pixels, and 4 GiB, or what the memory budget
/// has left (MemoryLedger::process()) if that is more.
ExrLimits limits_of_renders();

/// Reads all flat parts of a file with scan lines or tiles (the finest level). Throws Error for damaged, truncated and
/// oversized data, and for files of deep data only. Memory grows with the rows decoded, not with the size in the
/// header.
/// - The picture's part has R, G, B, and the lowest picture_rank() among these; the first one is chosen. A part of
///   rank 0 may have Y alone. Other parts put their name and a dot before channel names that earlier ones have.
/// - Parts of data put it before R, G, B and Y if another part has colours. So do parts with colours if the
///   picture is a luminance.
/// - Subsampled channels are interpolated. Luminance and chroma, Y, RY and BY, become R, G, B (ImfRgbaYca.h).
ExrFile read_exr(const std::filesystem::path& path, const ExrLimits& limits = {});
/// Reads the headers of a file alone: its channels have no values, and its pixels may be damaged or missing.
ExrFile read_exr_header(const std::filesystem::path& path, const ExrLimits& limits = {});

}  // namespace halflight
