#include "renderer/needs.h"

#include <algorithm>
#include <utility>

#include "engine/core/math.h"
#include "engine/rays/choice.h"
#include "engine/rays/tracer.h"
#include "engine/scene/material_properties.h"
#include "passes/picture/denoiser.h"
#include "passes/picture/shadow_catcher.h"
#include "passes/steps/paths.h"
#include "shaders/shared/albedo_coordinates.h"
#include "shaders/shared/cache_cells.h"
#include "shaders/shared/chain_records.h"
#include "shaders/shared/denoise.h"
#include "shaders/shared/light.h"
#include "shaders/shared/path_state.h"
#include "shaders/shared/ray_structs.h"
#include "shaders/shared/reuse_groups.h"
#include "shaders/shared/tile_list.h"

namespace halflight {
namespace {

constexpr const char* kPiloted = "a pilot found that it does not pay";
constexpr const char* kNoPreview = "its preview mode is off";
constexpr const char* kNoDenoise = "no denoising was requested";
constexpr const char* kNoAdaptive = "no adaptive sampling was requested";

constexpr const char* kShadow = "shadow";
constexpr const char* kDiffuse = "diffuse";
constexpr const char* kGlossy = "glossy";
constexpr const char* kContinuation = "continuation";
constexpr const char* kLaterLight = "light samples along paths";
constexpr const char* kReuse = "path reuse";
constexpr const char* kRadianceCache = "radiance cache";
constexpr const char* kCameraRays = "camera rays";
constexpr const char* kCameraHits = "hits of camera rays";
constexpr const char* kLens = "lens";
constexpr const char* kOptics = "projections and eyes";
constexpr const char* kRasterization = "rasterization";
constexpr const char* kSeen = "camera rays for light alone";
constexpr const char* kShownLamps = "lamps seen by the camera";
constexpr const char* kClamp = "clamp of indirect light";
constexpr const char* kChains = "surfaces seen in mirrors";
constexpr const char* kSquares = "sums of squares";
constexpr const char* kFeatures = "sums of albedo and normal";
constexpr const char* kHalves = "sums of half the samples";
constexpr const char* kLightGroups = "light groups";
constexpr const char* kTiles = "tile lists";

constexpr std::size_t kRow = sizeof(vec4);
constexpr std::size_t kListEntry = sizeof(shared::uint);
constexpr std::size_t kShadowRay = sizeof(shared::Ray) + sizeof(shared::uint);  // bytes of a ray and its result

/// Returns the bytes per path for groups of `group_size` pixels.
std::size_t reuse_bytes(const SceneNeeds& scene, int group_size) {
    return scene.reuse_point_bytes() + sizeof(shared::DirectLight) +
           std::size_t(group_size) * (kShadowRay + sizeof(float));
}

/// Returns the bytes per path of `groups` light groups: sums, light along paths, light seen, light that is received.
std::size_t light_group_bytes(std::size_t groups, bool reuse, bool seen) {
    return groups * 3 * sizeof(double) + group_light_bytes(groups, reuse) + (seen ? groups * kRow : 0) +
           (reuse ? groups * sizeof(shared::DirectLight) : 0);
}

/// Returns the bytes per path for a scene without instances and with a grid hierarchy. Tiles have a record and a mask,
/// and each path may have an entry of leftover rays.
constexpr std::size_t tile_bytes_of_path() {
    constexpr rays::TileSettings tiles;
    constexpr std::size_t texels = shared::kTileHeaderTexels + tiles.capacity * shared::kTileBoxTexels;
    return (texels * sizeof(uvec4) + sizeof(shared::TileBlockers)) / (tiles.side * tiles.side) + sizeof(uvec2);
}

constexpr std::size_t kTemporalBytes = (1 + 2 * 4) * kRow;  // places; the new picture and the earlier one

/// Returns the bytes per path of chains: their ends, rays, hits, list and surface records.
std::size_t chain_bytes(const SceneNeeds& scene) {
    return sizeof(shared::SpecularChain) + sizeof(shared::Ray) + sizeof(shared::Hit) + kListEntry +
           scene.surface_record_bytes();
}

const char* no_tiles(const FrameOptions& options) {
    using enum rays::Culling;
    if (options.culling == off || row_of(options.culling).make_server) return "culling by tiles is off";
    const std::uint64_t first = options.native ? rays::Tracer::kFirstNativeRuns : rays::Choice::kFirstRuns;
    const bool few = options.runs > 0 && options.runs <= first;
    return options.culling == automatic && few && !options.kept.has(kTiles) ? "too few samples for culling to pay"
                                                                            : nullptr;
}

const SceneNeed& need_of(bool SceneNeeds::*flag) {
    const auto needs = known_scene_needs();
    return *std::find_if(needs.begin(), needs.end(), [&](const SceneNeed& n) { return n.flag == flag; });
}

const char* fact_without(bool SceneNeeds::*flag) {
    return need_of(flag).fact;
}

/// Returns the bytes that a need takes in tables and G-buffer.
std::size_t bytes_of(bool SceneNeeds::*flag, const SceneNeeds& needs, const FrameSize& size) {
    using N = SceneNeeds;
    const std::pair<bool N::*, std::size_t> bytes[] = {
        {&N::vertex_colors, size.vertices * kRow},
        {&N::texture_coordinates, size.vertices * kRow},
        {&N::normal_maps, size.vertices * kRow},
        {&N::glossy, sizeof(vec2) * shared::kAlbedoTableSize * shared::kAlbedoTableSize},
        {&N::area_lights, size.triangles * sizeof(shared::uint)},
        {&N::sun, size.paths * (2 * kShadowRay + sizeof(shared::DirectLight) + kRow)},
        {&N::light_tree, size.paths * sizeof(shared::Receiver)},  // an environment map alone needs receivers, too
        {&N::sized_lamps, needs.sized_suns ? 0 : size.paths * sizeof(shared::MetLamp)},  // both have one buffer
        {&N::texture_levels, size.paths * sizeof(vec2)},
        {&N::catchers, size.paths * (kCatcherSums * sizeof(double) + kListEntry)},  // with an answer for each path
        {&N::volume, size.paths * kRow + sizeof(vec2) * shared::kAlbedoTableSize * shared::kSolidTableRows},
    };
    std::size_t sum = 0;
    for (const auto& [of, count] : bytes)
        if (of == flag) sum += count;
    for (const MaterialLobe& lobe : material_lobes())
        if (lobe.need == flag) sum += size.paths * static_cast<std::size_t>(lobe.record_rows) * kRow;
    return sum;
}

}  // namespace

FrameNeeds frame_needs(const SceneNeeds& scene, const FrameOptions& options) {
    const auto kept = [&](const char* name) { return options.kept.has(name); };
    const char* no_bounce = options.bounces == 0 ? "there are no bounces" : nullptr;
    const char* single = options.bounces == 1 ? "there is one bounce" : no_bounce;
    const char* no_transport = !(scene.diffuse || scene.glossy) ? "no material reflects light"
                               : !scene.light()                 ? "there is no light"
                                                                : nullptr;
    const char* no_light = scene.lights() ? nullptr : "there is no light to sample";
    const char* no_diffuse = scene.diffuse ? nullptr : fact_without(&SceneNeeds::diffuse);
    const auto transport = [&](bool keep, const char* fact) {
        return no_bounce ? no_bounce : keep ? nullptr : no_transport ? no_transport : fact;
    };
    const auto later = [&](bool keep, const char* fact) { return single ? single : transport(keep, fact); };
    const auto asked = [&](bool wanted, const char* name, const char* fact) {
        return wanted || kept(name) ? nullptr : fact;
    };

    // A kept part of paths needs a batch in which paths begin, and all rays need camera rays.
    const bool paths = kept(kDiffuse) || kept(kGlossy) || kept(kContinuation) || kept(kLaterLight) || kept(kClamp);
    const bool diffuse = kept(kDiffuse) || (paths && no_transport && !kept(kGlossy));
    const bool shadow = kept(kShadow) || kept(kTiles);
    const char* no_shadow = transport(shadow, no_light);
    const char* no_chains = transport(kept(kChains), !options.denoise ? kNoDenoise
                                                     : scene.sharp    ? nullptr
                                                                      : fact_without(&SceneNeeds::sharp));
    const bool halves = options.denoise || options.preview.of_picture() || !no_chains;  // chains add to both sums
    const bool features = options.want_features || !no_chains;
    const std::size_t half_sums = shared::kHalfSums + (no_chains ? 0 : shared::kChainSums);
    const bool traced = options.primary == PrimaryVisibility::traced;  // traced visibility needs rays and hits
    const bool has_lamps = scene.sized_lights() || options.kept.is_everything();
    const char* no_lamps = !options.show_lamps ? "lamps are not shown (--show-lamps)"
                           : has_lamps         ? nullptr
                                               : "no lamp has a size";
    const bool lamps_of_rays = !no_lamps && options.camera_rays == 1;  // else, other rays see them
    return {
        .shadow = {kShadow, std::size_t(options.shadow_rays) * (kShadowRay + sizeof(shared::DirectLight)), no_shadow},
        .diffuse = {kDiffuse, kListEntry, transport(diffuse, no_diffuse)},
        .glossy = {kGlossy, kListEntry,
                   transport(kept(kGlossy), scene.glossy ? nullptr : fact_without(&SceneNeeds::glossy))},
        .continuation = {kContinuation, sizeof(shared::Ray) + sizeof(shared::Hit) + sizeof(shared::PathState),
                         transport(paths, nullptr)},
        .later_light = {kLaterLight, kShadowRay + kListEntry, later(kept(kLaterLight), no_light)},
        // Path reuse is a different estimator, so it is kept only together with all parts, not by its name.
        .reuse = {kReuse, reuse_bytes(scene, options.group_size > 1 ? options.group_size : shared::kMostGroupSize),
                  single                    ? single
                  : options.group_size == 1 ? options.group_size_piloted ? kPiloted : "path reuse is off"
                                            : transport(options.kept.is_everything(), no_diffuse)},
        // The radiance cache is not kept by its name, either.
        .radiance_cache = {kRadianceCache, sizeof(shared::CachePoint),
                           single                                              ? single
                           : !options.radiance_cache || options.group_size > 1 ? kNoPreview
                                                                               : transport(false, no_diffuse)},
        .camera_rays = {kCameraRays, sizeof(shared::Ray),
                        traced || lamps_of_rays ? nullptr : transport(kept(kCameraRays) || paths || shadow, nullptr)},
        .camera_hits = {kCameraHits, sizeof(shared::Hit),
                        asked(options.want_hits || traced || options.light_groups > 0 || lamps_of_rays, kCameraHits,
                              "neither mattes nor light groups were requested")},
        // A lens needs traced visibility, so it is not kept by its name, either.
        .lens = {kLens, 0, options.lens ? nullptr : "no depth of field was requested"},
        .optics = {kOptics, 0, options.optics ? nullptr : "neither another projection nor stereo was requested"},
        // Additional camera rays are a different estimator, too, and are kept only if requested.
        .seen = {kSeen, sizeof(vec4),
                 options.camera_rays == 1
                     ? options.camera_rays_piloted ? kPiloted : "there is one camera ray per sample"
                 : scene.emission || scene.environment || !no_lamps || options.kept.is_everything()
                     ? nullptr
                     : "there is no light"},
        // Lamps that are shown change the picture, so they are not kept by their name.
        .shown_lamps = {kShownLamps, sizeof(vec4), no_lamps},
        .clamp = {kClamp, 0, later(kept(kClamp), options.clamp > 0 ? nullptr : "no clamp is set")},
        .chains = {kChains, chain_bytes(scene), no_chains},
        .squares = {kSquares, 3 * sizeof(double), asked(options.want_squares, kSquares, "no variance was requested")},
        .features = {kFeatures, 6 * sizeof(double),
                     asked(features, kFeatures, "neither albedo nor normal was requested")},
        .halves = {kHalves, half_sums * sizeof(double), asked(halves, kHalves, kNoDenoise)},
        // Light groups without layers would be sums that nobody reads, so they are not kept by their name.
        .light_groups = {kLightGroups,
                         light_group_bytes(std::size_t(std::max(options.light_groups, 1)), options.group_size > 1,
                                           options.camera_rays > 1 || !no_lamps),
                         options.light_groups > 0 ? nullptr : "no light groups were requested"},
        .tiles = {kTiles, tile_bytes_of_path(), no_shadow ? no_shadow : no_tiles(options)},
    };
}

std::vector<LeftOut> left_out(const SceneNeeds& scene, const FrameOptions& options, const FrameSize& size) {
    const SceneNeeds needs = united(scene, kept_needs(options.kept));
    std::vector<LeftOut> all;
    for (const FramePart& part : frame_needs(needs, options).parts())
        if (!part) all.push_back({part.name, part.left_out, part.path_bytes * size.paths});
    if (options.primary == PrimaryVisibility::traced)
        all.push_back({kRasterization,
                       options.optics ? "no rasterizer draws the projection or the eyes"
                       : options.lens ? "depth of field needs traced camera rays"
                                      : "camera rays are traced",
                       (sizeof(uvec2) + sizeof(float)) * size.pixels});
    if (!options.preview.temporal) all.push_back({"temporal accumulation", kNoPreview, kTemporalBytes * size.pixels});
    if (!options.preview.filter) all.push_back({"filter of noise", kNoPreview, kPreviewFilterBytes * size.pixels});
    if (!options.adaptive) all.push_back({"adaptive sampling", kNoAdaptive, 3 * sizeof(double) * size.paths});
    if (!options.denoise) all.push_back({"denoiser", kNoDenoise, kDenoiserPixelBytes * size.pixels});
    if (needs.one_sided && options.backfaces == Backfaces::show)
        all.push_back({need_of(&SceneNeeds::one_sided).name, "back faces are shown (--backfaces)", 0});
    for (const SceneNeed& need : known_scene_needs())
        if (!(needs.*need.flag)) all.push_back({need.name, need.fact, bytes_of(need.flag, needs, size)});
    return all;
}

std::vector<std::string> keepable_names() {
    std::vector<std::string> names;
    for (const FramePart& part : frame_needs({}, {}).parts())
        if (part.name != kReuse && part.name != kSeen && part.name != kRadianceCache && part.name != kLens &&
            part.name != kOptics && part.name != kShownLamps && part.name != kLightGroups)
            names.emplace_back(part.name);
    for (const SceneNeed& need : known_scene_needs())
        if (can_be_kept(need)) names.emplace_back(need.name);
    return names;
}

}  // namespace halflight
