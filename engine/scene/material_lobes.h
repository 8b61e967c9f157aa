// Conditions under which a material has a lobe.
#pragma once

#include "engine/scene/material.h"
#include "shaders/shared/albedo_coordinates.h"
#include "shaders/shared/chain_records.h"

namespace halflight {

inline bool lit(const Material& m) {
    return !m.unlit;
}
inline bool dielectric(const Material& m) {
    return lit(m) && (m.metallic < 1 || m.metallic_roughness_texture);
}
/// Returns whether something lies under the dielectric's reflection.
inline bool base(const Material& m) {
    return dielectric(m) && vec3(m.base_color) != vec3(0);
}
inline bool specular(const Material& m) {
    return dielectric(m) && m.specular > 0;
}
inline bool coated(const Material& m) {
    return lit(m) && m.clearcoat > 0;
}
inline bool has_sheen(const Material& m) {
    return lit(m) && m.sheen_color != vec3(0);
}
inline bool transmits(const Material& m) {
    return dielectric(m) && m.transmission > 0;
}
inline bool translucent(const Material& m) {
    return dielectric(m) && m.diffuse_transmission > 0 && (m.transmission < 1 || m.transmission_texture);
}
/// Returns whether cameras see the surface from its front only. The back of a surface that light passes is a part of
/// what is seen through its front.
inline bool is_one_sided(const Material& m) {
    return !m.double_sided && !transmits(m) && !translucent(m);
}
inline bool iridescent(const Material& m) {
    return lit(m) && m.iridescence > 0;
}
inline bool anisotropic(const Material& m) {
    return lit(m) && m.anisotropy_strength > 0;
}
inline bool glossy(const Material& m) {
    return (lit(m) && m.metallic > 0) || specular(m);
}
/// Returns whether some lobe can be a mirror or clear glass.
inline bool sharp(const Material& m) {
    const auto smooth = [](float roughness, const TextureRef& texture) {
        return texture || roughness <= shared::kMostSharpRoughness;
    };
    return ((glossy(m) || transmits(m)) && smooth(m.roughness, m.metallic_roughness_texture)) ||
           (coated(m) && smooth(m.clearcoat_roughness, m.clearcoat_roughness_texture));
}
/// Returns whether light passes the surface straight on at some point (SHADING.md, Panes). Solids must ask for it, and
/// those that disperse light do not let it pass.
inline bool is_pane(const Material& m) {
    return transmits(m) && (!(m.thickness > 0) || (m.straight_shadows && !(m.dispersion > 0))) &&
           (m.roughness * m.roughness < shared::kMirrorAlpha || m.metallic_roughness_texture);
}
inline bool is_solid(const Material& m) {
    return (transmits(m) || translucent(m)) && m.thickness > 0;
}
inline bool disperses(const Material& m) {
    return transmits(m) && is_solid(m) && m.dispersion > 0 && m.ior > 1 && m.ior < kInfiniteIor;
}

}  // namespace halflight
