#include "engine/settings/layers.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <bit>
#include <map>
#include <mutex>

#include "engine/core/names.h"
#include "engine/tables/tables.h"
#include "shaders/shared/aov_record.h"
#include "shaders/shared/ray_structs.h"

namespace halflight {
namespace {

using enum LayerStorage;
using enum LayerSource;
using Merge = LayerMerge;
using shared::AovRecord;
using shared::DebugRecord;

void read_position(const AovRecord& r, const TraceTables& tables, float* to) {
    const vec3 world = r.triangle == shared::kMiss ? vec3(0) : vec3(dvec3(r.position) + tables.origin);
    std::copy_n(&world.x, 3, to);
}

void read_ids(const AovRecord& r, const TraceTables& tables, float* to) {
    const bool seen = r.triangle != shared::kMiss;
    const TriangleSource source = seen ? source_of(tables, r.instance, r.triangle) : TriangleSource{~0u, ~0u};
    to[0] = std::bit_cast<float>(source.instance);
    to[1] = std::bit_cast<float>(source.triangle);
    to[2] = std::bit_cast<float>(~0u);
    if (tables.absent || !seen) return;  // renderer/film.cpp reads the material from pages
    to[2] = std::bit_cast<float>(tables.triangles[r.triangle].w & kTriangleMaterialMask);
}

constexpr std::array kLayers = {
    AovInfo{"emission", "emission.", "R,G,B", color, Merge::mean, emission,
            "radiance of light sources and environment seen directly"},
    AovInfo{"direct_diffuse", "direct_diffuse.", "R,G,B", color, Merge::mean, direct,
            "radiance of light reflected once, diffusely"},
    AovInfo{"direct_glossy", "direct_glossy.", "R,G,B", color, Merge::mean, direct,
            "radiance of light scattered once by a glossy lobe: any lobe but the diffuse one", 3},
    AovInfo{"indirect_diffuse", "indirect_diffuse.", "R,G,B", color, Merge::mean, indirect,
            "radiance of light scattered several times, last by diffuse reflection at the visible surface"},
    AovInfo{"indirect_glossy", "indirect_glossy.", "R,G,B", color, Merge::mean, indirect,
            "radiance of light scattered several times, last by a glossy lobe of the visible surface", 3},
    AovInfo{"variance", "variance.", "R,G,B", data, Merge::variance, squares,
            "variance of the pixel's mean radiance, estimated from its samples; linear Rec.709"},
    AovInfo{"samples", "samples.", "Y", data, Merge::sum, count, "number of samples of the pixel"},
    AovInfo{"albedo", "albedo.", "R,G,B", color, Merge::mean, features,
            "reflectance below the coat, specular at normal incidence; filtered"},
    AovInfo{"normal", "normal.", "X,Y,Z", data, Merge::mean, features,
            "shading normal in world space; filtered, not normalised", 3},
    AovInfo{"position", "position.", "X,Y,Z", data, Merge::none, record,
            "position in world units at the pixel's centre; 0 where there is no surface", 0, read_position},
    AovInfo{"depth", "", "Z", data, Merge::none, record,
            "distance along the camera's axis at the pixel's centre, or along the ray of a panorama or fisheye, world "
            "units; 1e10 where there is no surface",
            0, [](const AovRecord& r, const TraceTables&, float* to) { *to = r.depth; }},
    AovInfo{"motion", "motion.", "X,Y", data, Merge::none, record,
            "motion since the previous frame of the surface at the pixel's centre, pixels, x right, y down", 0,
            [](const AovRecord& r, const TraceTables&, float* to) { std::copy_n(&r.motion.x, 2, to); }},
    AovInfo{"ids", "ids.", "instance,primitive,material", LayerStorage::ids, Merge::none, record,
            "indices of instance, primitive and material at the pixel's centre; 4294967295 where there is no surface",
            0, read_ids},
    AovInfo{"cryptoobject", "CryptoObject", "", matte, Merge::coverage, objects,
            "Cryptomatte of the objects: ids and coverage of 6 ranks"},
    AovInfo{"cryptomaterial", "CryptoMaterial", "", matte, Merge::coverage, materials,
            "Cryptomatte of the materials: ids and coverage of 6 ranks"},
    AovInfo{"noisy", "noisy.", "R,G,B", color, Merge::mean, LayerSource::noisy,
            "picture before denoising and preview filters: the mean of the samples"},
    AovInfo{"denoiser", "denoiser.", "direct_diffuse,indirect_diffuse,glossy", data, Merge::mean, LayerSource::denoiser,
            "share of filtered light in each component of the denoised picture, 0 to 1; the rest is the mean"},
    AovInfo{
        "nodes", "nodes.", "Y", data, Merge::none, LayerSource::debug,
        "inner hierarchy nodes that the camera ray at the pixel's centre visits without culling; 0 in scenes in pages",
        0, nullptr, [](const DebugRecord& r, float* to) { *to = static_cast<float>(r.nodes); }},
    AovInfo{
        "culling", "culling.", "leaves,others", data, Merge::none, LayerSource::debug,
        "number of leaves and of other entries in the tile's list for first shadow rays, in the last sample with such "
        "rays; 0 without a list",
        0, nullptr,
        [](const DebugRecord& r, float* to) {
            to[0] = static_cast<float>(r.leaves);
            to[1] = static_cast<float>(r.others);
        }},
    AovInfo{"residency", "residency.", "subtree,resident", data, Merge::none, LayerSource::debug,
            "scenes in pages: number of the subtree of pages around the surface at the pixel's centre, 0 if there is "
            "none, and 1 if its page is in the pool when the samples end",
            0, nullptr,
            [](const DebugRecord& r, float* to) {
                to[0] = static_cast<float>(r.subtree);
                to[1] = static_cast<float>(r.resident);
            }},
};

/// Layers of light groups; the name and the prefix go on with the name of the group.
constexpr AovInfo kLightGroup{kLightGroupLayer,
                              kLightGroupLayer,
                              "R,G,B",
                              color,
                              Merge::mean,
                              groups,
                              "radiance of the lights of the group NAME (`--light-group`)"};

/// Returns the layer of a light group. Layers that were asked for stay, since others keep pointers to them.
const AovInfo* light_group_layer(std::string_view layer) {
    struct Named {
        std::string name, prefix;
        AovInfo info;
    };
    static std::mutex mutex;
    static std::map<std::string, Named, std::less<>> known;
    const std::lock_guard lock(mutex);
    const auto [place, added] = known.try_emplace(std::string(layer));
    Named& own = place->second;
    if (added) {
        own = {std::string(layer), fmt::format("{}.", layer), kLightGroup};
        own.info.name = own.name, own.info.prefix = own.prefix;
    }
    return &own.info;
}

const char* name(LayerStorage storage) {
    switch (storage) {
        case color:
            return "colour, float or half";
        case data:
            return "data, float";
        case LayerStorage::ids:
            return "ids, uint32";
        case matte:
            return "matte, float";
    }
    return "";
}

const char* name(LayerMerge merge) {
    switch (merge) {
        case Merge::mean:
            return "mean";
        case Merge::variance:
            return "variance of the mean";
        case Merge::sum:
            return "sum";
        case Merge::coverage:
            return "mean coverage";
        case Merge::none:
            return "none: time of the frame";
    }
    return "";
}

/// Returns the name of the pass that makes the values.
const char* pass_of(LayerSource source) {
    switch (source) {
        case emission:
        case direct:
        case indirect:
        case squares:
        case features:
        case groups:
        case count:
            return "accumulate";
        case objects:
        case materials:
            return "gbuffer";
        case record:
            return "aov";
        case LayerSource::noisy:
            return "composite";
        case LayerSource::denoiser:
            return "denoiser blend";
        case LayerSource::debug:
            return "debug aov";
    }
    return "";
}

}  // namespace

bool AovInfo::at_any_time() const {
    return source == LayerSource::emission || source == LayerSource::direct || source == LayerSource::indirect ||
           source == LayerSource::noisy || source == LayerSource::count;
}

std::vector<std::string> AovInfo::channel_names() const {
    std::vector<std::string> names;
    if (is_matte()) {
        for (std::size_t i = 0; i < 2 * kCryptomatteRanks; ++i)
            names.push_back(fmt::format("{}{:02}.{}", prefix, i / 4, "RGBA"[i % 4]));
        return names;
    }
    for (const std::string& channel : split_names(channels)) names.push_back(fmt::format("{}{}", prefix, channel));
    return names;
}

const AovInfo* find_aov(std::string_view name) {
    const auto found = std::ranges::find(kLayers, name, &AovInfo::name);
    if (found != kLayers.end()) return &*found;
    const bool of_group = name.starts_with(kLightGroupLayer) && name.size() > kLightGroupLayer.size();
    return of_group ? light_group_layer(name) : nullptr;
}

std::span<const AovInfo> known_aovs() {
    return kLayers;
}

std::string layers_markdown() {
    std::string text = "| Layer | Channels | Storage | Merge | Pass | Contents |\n|---|---|---|---|---|---|\n";
    const auto add = [&](const AovInfo& a, const char* note) {
        const std::vector<std::string> names = a.channel_names();
        const std::string channels = a.is_matte() ? fmt::format("{} ... {}", names.front(), names.back())
                                                  : fmt::format("{}", fmt::join(names, ", "));
        text += fmt::format("| `{}` | {} | {} | {} | {} | {}{} |\n", a.name, channels, name(a.storage), name(a.merge),
                            pass_of(a.source), a.description, note);
    };
    for (const AovInfo& a : kLayers) add(a, a.in_all() ? "" : " (not part of `all`)");
    add(*light_group_layer(fmt::format("{}NAME", kLightGroupLayer)), " (not part of `all`)");
    return text;
}

}  // namespace halflight
