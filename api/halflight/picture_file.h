// Pictures as files: .exr, .png, .jpg, .tif.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>

#include "api/halflight/aov_names.h"
#include "api/halflight/frame_renderer.h"
#include "api/halflight/log.h"
#include "engine/color/color.h"
#include "engine/core/frames.h"
#include "engine/io/exr.h"
#include "engine/io/tiff.h"
#include "renderer/render_result.h"

namespace halflight {

/// Conditions for writing pictures, and properties of the files.
struct OutputOptions {
    std::string working_space;  // linear space of colour in .exr files: "rec709" or "", or a name of the colour config
    ExrLayout exr{};            // compression, parts and tiles of .exr files
    AovNames aov_names{};       // names of layers in .exr files
    int jpeg_quality = 92;      // quality of .jpg files, 1 to 100
    int png_bits = 0;           // bits of a channel of .png files and movies: 8 or 16; 0: 16 for HDR, else 8
    // Values of .tif files. Integers hold the picture through the view transform, floats the scene-linear picture.
    TiffType tiff = TiffType::uint16;
    bool reproducible = false;  // omits date and render time: equal pictures make equal files
    bool strict = false;        // refuses pictures in which a pass gave NaN, infinite or negative values
    bool best_effort = false;   // accepts pictures that have not reached their error target
};

/// Metadata of a picture file.
struct PictureInfo {
    Camera camera;
    LinearSpace working_space;  // space of the colour layers; variances stay linear Rec.709
    bool half = false;          // stores beauty as half floats; other layers have their own types
    ivec2 whole{0};             // size of the whole picture, the display window; 0: that of the result
    ivec2 origin{0};            // upper left pixel of the result in the whole picture
    bool transparent = false;   // .png and .tif have an alpha channel
    ExrLayout exr{};
    AovNames aov_names{};
    int jpeg_quality = 92;
    int png_bits = 8;
    std::optional<DisplayEncoding>
        encoding{};  // tags of pictures through the view transform; none: no tags, as of sRGB
    TiffType tiff = TiffType::uint16;
    std::map<std::string, float> numbers{};  // attributes of type float, by the names of OpenEXR's standard
    int samples = 0;                         // samples per pixel
    std::string comments;
    std::string filter;         // name of the pixel filter
    std::string lens{};         // lens_text(); empty for a pinhole
    std::string projection{};   // text() of the optics; empty: that of the camera itself
    std::string shutter;        // shutter_text(); empty without motion blur
    std::string bias;           // reason why the picture would not converge to the scene's light; empty if it would
    std::string error;          // estimated error, in words; empty if it is not known
    bool reproducible = false;  // omits the date
    // The following members apply to frames of sequences only.
    std::optional<FrameRate> frame_rate{};
    FrameNumber frame = 0;
    // Digests of scene, settings and frame, of scene-linear files and of those through the view transform;
    // render_sequence() keeps files that have them.
    std::string fingerprint{}, view_fingerprint{};
};

/// Returns whether the file name ends in `.extension`, in any case.
bool has_extension(const std::filesystem::path& path, std::string_view extension);

/// Returns the extensions that write_picture() knows, in words.
std::string picture_extensions();
/// Returns whether write_picture() knows the extension.
bool is_picture_name(const std::filesystem::path& path);
/// Returns whether the file holds the picture through the view transform. Others hold it scene-linear.
bool holds_view(const std::filesystem::path& path, TiffType tiff);
/// Throws Error for a file that cannot hold the alpha of a transparent picture.
void check_alpha(const std::filesystem::path& path, bool transparent);
/// Throws Error for a file that cannot say that its picture is for an HDR display. encoding: that of the view.
void check_encoding(const std::filesystem::path& path, TiffType tiff, const std::optional<DisplayEncoding>& encoding);
/// Throws Error for a file whose format cannot hold pictures of this size, pixels.
void check_size(const std::filesystem::path& path, const ivec2& size);

/// Returns the bits of a channel of .png files and movies of a display.
int png_bits(const OutputOptions& options, const std::optional<DisplayEncoding>& encoding);

/// Sets what files of pictures through `view` say about its display.
void set_display(PictureInfo& info, const ViewProcessor& view, const OutputOptions& options);

/// Returns the linear space that `name` stands for. Throws Error if the config has none of that name.
LinearSpace working_space(const ColorConfig& config, const std::string& name);

/// Writes a picture: as .exr scene-linear with its layers, as .png, .jpg or .tif from RenderResult::view, and as .tif
/// with floats scene-linear. The extension decides. The file is written completely or not at all. Throws Error.
void write_picture(const std::filesystem::path& path, const RenderResult& result, const PictureInfo& info);

/// Writes a picture to several files. A file that cannot be written does not prevent the others: the Error of the first
/// one is thrown after all, and those of others are warnings, unless the disk is their reason, too. Warns of values
/// that half floats cannot hold.
void write_pictures(const std::vector<std::filesystem::path>& paths, const RenderResult& result,
                    const PictureInfo& info, const Log& log);

/// Returns the metadata of the picture that `renderer` made last. `error`: result of judge().
PictureInfo picture_info(const FrameRenderer& renderer, const RenderResult& result, const OutputOptions& options,
                         const std::string& error);

/// Decides whether a picture is good enough to be written, and logs warnings. Returns its error in words, empty if
/// unknown. Throws Error about `output` if it is not: bad values with OutputOptions::strict, or an error target that
/// was not reached without best_effort.
std::string judge(const RenderStats& stats, const OutputOptions& options, const std::filesystem::path& output,
                  const Log& log);

}  // namespace halflight
