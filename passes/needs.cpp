#include "passes/needs.h"

#include <algorithm>
#include <utility>

#include "engine/core/math.h"
#include "engine/rays/choice.h"
#include "shaders/shared/albedo.h"
#include "shaders/shared/light.h"
#include "shaders/shared/path.h"
#include "shaders/shared/rays.h"
#include "shaders/shared/tile_list.h"

namespace halflight {
namespace {

constexpr std::size_t kRow = sizeof(vec4);
constexpr std::size_t kListEntry = sizeof(shared::uint);
constexpr std::size_t kShadowRay = sizeof(shared::Ray) + sizeof(shared::uint);  // and its answer

/// A record and a mask per tile, of a scene without instances on the grid; a ray may be left over.
constexpr std::size_t tile_bytes_of_path() {
    constexpr rays::TileSettings tiles;
    constexpr std::size_t texels = shared::kTileHeaderTexels + tiles.capacity * shared::kTileBoxTexels;
    return (texels * sizeof(uvec4) + sizeof(shared::TileBlockers)) / (tiles.side * tiles.side) + sizeof(uvec2);
}

const char* no_tiles(const FrameOptions& options) {
    using enum rays::Culling;
    if (options.culling == off || options.culling == raster) return "culling by tiles was not asked for";
    const bool few = options.runs > 0 && options.runs <= rays::Choice::kFirstRuns;
    return options.culling == automatic && few && !options.keep_all ? "so few samples end before culling could pay"
                                                                    : nullptr;
}

const char* fact_without(bool SceneNeeds::*flag) {
    const auto needs = known_scene_needs();
    return std::find_if(needs.begin(), needs.end(), [&](const SceneNeed& n) { return n.flag == flag; })->fact;
}

/// What the tables and the G-buffer would hold for it.
std::size_t bytes_of(bool SceneNeeds::*flag, const FrameSize& size) {
    using N = SceneNeeds;
    const std::pair<bool N::*, std::size_t> bytes[] = {
        {&N::vertex_colors, size.vertices * kRow},
        {&N::normal_maps, size.vertices * kRow},
        {&N::glossy, size.paths * 2 * kRow + sizeof(vec2) * shared::kAlbedoTableSize * shared::kAlbedoTableSize},
        {&N::transmission, size.paths * kRow},
        {&N::clearcoat, size.paths * kRow},
        {&N::area_lights, size.triangles * sizeof(shared::uint)},
        {&N::light_tree, size.paths * sizeof(shared::Receiver)},
    };
    for (const auto& [of, count] : bytes)
        if (of == flag) return count;
    return 0;
}

}  // namespace

FrameNeeds frame_needs(const SceneNeeds& scene, const FrameOptions& options) {
    const bool keep = options.keep_all;
    const char* no_transport = options.bounces == 0               ? "no bounces were asked for"
                               : keep                             ? nullptr
                               : !(scene.diffuse || scene.glossy) ? "no material reflects light"
                               : !scene.light()                   ? "nothing shines"
                                                                  : nullptr;
    const auto unless = [&](bool needed, const char* fact) {
        return no_transport ? no_transport : needed || keep ? nullptr : fact;
    };
    const auto asked = [&](bool wanted) { return wanted || keep ? nullptr : "nobody asked for it"; };
    const char* no_light = "no light can be sampled";
    const char* single = options.bounces == 1 ? "one bounce was asked for" : nullptr;
    const char* no_shadow = unless(scene.lights(), no_light);
    const bool traced = options.primary == PrimaryVisibility::traced;  // through rays and hits
    return {
        .shadow = {"shadow", kShadowRay + sizeof(shared::DirectLight), no_shadow},
        .diffuse = {"diffuse", kListEntry, unless(scene.diffuse, fact_without(&SceneNeeds::diffuse))},
        .glossy = {"glossy", kListEntry, unless(scene.glossy, fact_without(&SceneNeeds::glossy))},
        .continuation = {"continuation", sizeof(shared::Ray) + sizeof(shared::Hit) + sizeof(shared::PathState),
                         no_transport},
        .later_light = {"light samples along paths", kShadowRay + kListEntry, single ? single : no_shadow},
        .camera_rays = {"camera rays", sizeof(shared::Ray), traced ? nullptr : no_transport},
        .camera_hits = {"hits of camera rays", sizeof(shared::Hit), asked(options.want_hits || traced)},
        .clamp = {"clamp of indirect light", 0,
                  no_transport ? no_transport
                  : single     ? single
                               : asked(options.clamp > 0)},
        .squares = {"sums of squares", 3 * sizeof(double), asked(options.want_squares)},
        .features = {"sums of albedo and normal", 6 * sizeof(double), asked(options.want_features)},
        .tiles = {"tile lists", tile_bytes_of_path(), no_shadow ? no_shadow : no_tiles(options)},
    };
}

std::vector<LeftOut> left_out(const SceneNeeds& scene, const FrameOptions& options, const FrameSize& size) {
    std::vector<LeftOut> all;
    for (const FramePart& part : frame_needs(scene, options).parts())
        if (!part) all.push_back({part.name, part.left_out, part.path_bytes * size.paths});
    const SceneNeeds kept = options.keep_all ? united(scene, everything_kept()) : scene;
    if (!kept.textures()) all.push_back({"texture coordinates", "there are no textures", size.vertices * kRow});
    for (const SceneNeed& need : known_scene_needs())
        if (!(kept.*need.flag)) all.push_back({need.name, need.fact, bytes_of(need.flag, size)});
    return all;
}

}  // namespace halflight
