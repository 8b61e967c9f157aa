// The table of layers that a picture can have beside its colour (arbitrary output variables, AOVs). The film, files,
// option checks, the viewer and docs/settings.md follow it.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace halflight {

struct TraceTables;
namespace shared {
struct AovRecord;
struct DebugRecord;
}  // namespace shared

/// Content of a layer's channels, which decides how files store them.
enum class LayerStorage {
    color,  // linear RGB: converted to the working space; float, or half if wanted
    data,   // data as float
    ids,    // ids, uint32 as the bits of floats
    matte,  // pairs of id and coverage (renderer/cryptomatte.h), float
};

/// Methods to merge layers of pictures that share the samples of a frame (tools/view/standing_picture.h).
enum class LayerMerge {
    mean,      // mean weighted by samples
    variance,  // variance of the weighted mean
    sum,
    coverage,  // mean coverage of each id
    none,      // no mean: the layer shows the pixel's centre at the time of the frame
};

/// Source of a layer's values.
enum class LayerSource {
    emission,   // sums of the pass "accumulate" (passes/picture/accumulate.h)
    direct,     // sums of two colours: diffuse, glossy
    indirect,   // sums of two colours: diffuse, glossy
    squares,    // sums of squares, made on demand
    features,   // albedo and normal, made on demand
    groups,     // sums of light groups
    count,      // number of samples per pixel
    objects,    // objects hit by camera rays
    materials,  // materials hit by camera rays
    record,     // AovRecord of the pass "aov"
    noisy,      // picture before denoising and preview modes
    denoiser,   // weights of the denoiser
    debug,      // DebugRecord of the pass "debug aov"
};

/// A layer. A new one needs a row in layers.cpp, and its values if the source does not hold them yet.
struct AovInfo {
    std::string_view name;
    std::string_view prefix;    // start of channel names; empty: none
    std::string_view channels;  // names after the prefix, separated by commas; mattes: made from the ranks
    LayerStorage storage;
    LayerMerge merge;
    LayerSource source;
    std::string_view description;  // description in one line, with units
    std::size_t first = 0;         // sums: number of the layer's first channel
    /// Functions that copy a pixel's channels; null for other sources. Records without a surface have triangle kMiss.
    void (*read)(const shared::AovRecord&, const TraceTables&, float* to) = nullptr;
    void (*read_debug)(const shared::DebugRecord&, float* to) = nullptr;

    bool debug() const { return source == LayerSource::debug; }  ///< Returns whether values vary between runs.
    /// Returns whether "all" stands for the layer, too. Layers that only biased pictures need are not part of it.
    bool in_all() const { return !debug() && source != LayerSource::noisy && source != LayerSource::denoiser; }
    bool is_light_group() const { return source == LayerSource::groups; }
    bool at_centre() const { return merge == LayerMerge::none; }
    bool is_color() const { return storage == LayerStorage::color; }
    bool is_matte() const { return storage == LayerStorage::matte; }
    /// Returns whether the layer can be made after the samples although it was not requested before.
    bool at_any_time() const;
    /// Returns the full names of the channels in files.
    std::vector<std::string> channel_names() const;
};

/// Pairs of id and coverage that a matte keeps per pixel.
inline constexpr std::size_t kCryptomatteRanks = 6;

/// Start of the names of layers of light groups, which the name of the group follows.
inline constexpr std::string_view kLightGroupLayer = "light_";

/// Returns the layer of that name, which may be that of any light group; null if there is none.
const AovInfo* find_aov(std::string_view name);
/// Returns all layers without those of light groups. Layers for debugging come last.
std::span<const AovInfo> known_aovs();
/// Returns the table in Markdown, for docs/settings.md.
std::string layers_markdown();

}  // namespace halflight
