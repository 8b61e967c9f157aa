// The table of lobes.
#include <array>

#include "engine/scene/material_lobes.h"
#include "engine/scene/material_properties.h"

namespace halflight {
namespace {

using M = Material;
using N = MaterialNeeds;

const std::array kLobes = {
    MaterialLobe{.label = "unlit surfaces",
                 .need = &N::unlit,
                 .define = "UNLIT",
                 .fact = "no material is unlit",
                 .present = [](const M& m) { return m.unlit; },
                 .implies = &N::emission},
    MaterialLobe{.label = "diffuse transmission",
                 .need = &N::diffuse_transmission,
                 .define = "DIFFUSE_TRANSMISSION",
                 .fact = "no material transmits light diffusely",
                 .present = translucent,
                 .implies = &N::diffuse,
                 .record_rows = 1},
    MaterialLobe{.label = "diffuse lobe",
                 .need = &N::diffuse,
                 .define = "DIFFUSE",
                 .fact = "no material has a diffuse component",
                 .present = [](const M& m) { return base(m) && (m.transmission < 1 || m.transmission_texture); }},
    MaterialLobe{.label = "glossy lobe",
                 .need = &N::glossy,
                 .define = "GLOSSY",
                 .fact = "no material has a specular, coat, sheen or transmission component",
                 .present = glossy,
                 .record_rows = 2,
                 .layer_rows = 1},
    MaterialLobe{.label = "mirrors and clear glass",
                 .need = &N::sharp,
                 .define = "SHARP",
                 .fact = "no lobe has a roughness of 0.1 or less",
                 .present = sharp,
                 .implies = &N::glossy},
    MaterialLobe{.label = "clearcoat",
                 .need = &N::clearcoat,
                 .define = "CLEARCOAT",
                 .fact = "no material has a coat",
                 .present = coated,
                 .implies = &N::glossy,
                 .record_rows = 1,
                 .layer_rows = 1},
    MaterialLobe{.label = "dispersion",
                 .need = &N::dispersion,
                 .define = "DISPERSION",
                 .fact = "every solid refracts all colours alike",
                 .present = disperses,
                 .implies = &N::volume},
    MaterialLobe{.label = "volume",
                 .need = &N::volume,
                 .define = "VOLUME",
                 .fact = "no material is solid",
                 .present = is_solid,
                 .implies = &N::transmission,  // the next row, which implies the glossy lobe
                 .record_rows = 3},
    MaterialLobe{.label = "transmission",
                 .need = &N::transmission,
                 .define = "TRANSMISSION",
                 .fact = "no material transmits light",
                 .present = transmits,
                 .implies = &N::glossy,
                 .record_rows = 1},
    MaterialLobe{.label = "sheen",
                 .need = &N::sheen,
                 .define = "SHEEN",
                 .fact = "no material has a sheen",
                 .present = has_sheen,
                 .implies = &N::glossy,
                 .record_rows = 2,
                 .layer_rows = 1},
    MaterialLobe{.label = "anisotropy",
                 .need = &N::anisotropy,
                 .define = "ANISOTROPY",
                 .fact = "no material is anisotropic, or no mesh has tangents",
                 .present = anisotropic,
                 .implies = &N::glossy,
                 .record_rows = 1,
                 .layer_rows = 1,
                 .tangents = true},
    MaterialLobe{.label = "iridescence",
                 .need = &N::iridescence,
                 .define = "IRIDESCENCE",
                 .fact = "no material has a thin film",
                 .present = iridescent,
                 .implies = &N::glossy,
                 .record_rows = 4,
                 .layer_rows = 2},
    MaterialLobe{
        .label = "specular colour",
        .need = &N::specular_color,
        .define = "SPECULAR_COLOR",
        .fact = "every dielectric reflects white",
        .present = [](const M& m) { return specular(m) && (m.specular_color != vec3(1) || m.specular_color_texture); },
        .implies = &N::glossy},
    MaterialLobe{.label = "emission",
                 .need = &N::emission,
                 .define = "EMISSION",
                 .fact = "no surface glows",
                 .present = has_emission},
};

}  // namespace

bool has_emission(const Material& material) {
    return lit(material) && glm::any(glm::greaterThan(material.emission, vec3(0)));
}

std::span<const MaterialLobe> material_lobes() {
    return kLobes;
}

}  // namespace halflight
