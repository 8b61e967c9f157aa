#include "engine/settings/layers.h"

#include <algorithm>
#include <array>

namespace halflight {
namespace {

constexpr std::array kAovs = {
    AovInfo{"emission", "RGB", "radiance of lights and environment seen directly", false, false, true},
    AovInfo{"direct_diffuse", "RGB", "radiance: light reflected once, diffusely", false, false, true},
    AovInfo{"direct_glossy", "RGB", "radiance: light reflected or transmitted once, by specular, coat or transmission",
            false, false, true},
    AovInfo{"indirect_diffuse", "RGB", "radiance: light reflected more than once, diffusely at the surface seen", false,
            false, true},
    AovInfo{"indirect_glossy", "RGB", "radiance: light reflected more than once, glossily at the surface seen", false,
            false, true},
    AovInfo{"variance", "RGB", "variance of the pixel's mean radiance, estimated from its samples"},
    AovInfo{"samples", "Y", "samples of the pixel", false, false, true},
    AovInfo{"albedo", "RGB", "reflectance: diffuse, transmission and specular at normal incidence; filtered"},
    AovInfo{"normal", "XYZ", "shading normal, world; filtered, not normalised"},
    AovInfo{"position", "XYZ", "world position at the pixel's centre, world units; 0 where there is no surface", false,
            true},
    AovInfo{"depth", "Z",
            "distance along the camera's axis at the pixel's centre, world units; 1e10 where there is no surface",
            false, true},
    AovInfo{"motion", "XY",
            "pixels that the surface at the pixel's centre moved since the previous frame, x right, y down", false,
            true},
    AovInfo{
        "ids", "",
        "uint32 ids.instance, ids.primitive, ids.material at the pixel's centre; 4294967295 where there is no surface",
        false, true},
    AovInfo{"cryptoobject", "", "Cryptomatte of the objects: CryptoObject00 to 02, ids and coverage of 6 ranks"},
    AovInfo{"cryptomaterial", "", "Cryptomatte of the materials: CryptoMaterial00 to 02"},
    AovInfo{"nodes", "Y", "nodes of the hierarchy that the camera ray at the pixel's centre visits, without culling",
            true, true},
    AovInfo{"culling", "",
            "culling.leaves, culling.others: length of the pixel's tile's list for first shadow rays, of the last "
            "sample that had any there; 0 where none had or culling did without lists",
            true, true},
};

}  // namespace

const AovInfo* find_aov(std::string_view name) {
    const auto found = std::ranges::find(kAovs, name, &AovInfo::name);
    return found == kAovs.end() ? nullptr : &*found;
}

std::span<const AovInfo> known_aovs() {
    return kAovs;
}

}  // namespace halflight
