// Cases and kernels of tests of the BSDF (shaders/lib/bsdf.glsl).
#pragma once

#include <gtest/gtest.h>

#include <fmt/format.h>
#include <string>
#include <vector>

#include "tests/pass/light/shading_kernel.h"
#include "tests/support/gpu_test.h"

namespace halflight {

/// A material and a pair of directions as six rows of input.
struct BsdfCase {
    float metallic = 0, roughness = 0.5f, r0 = 0.04f, specular = 1;
    float coat = 0, coat_roughness = 0, transmission = 0, cosine = 0.7f;
    float base_color = 1, specular_color = 1, tilt = 0;  // radians between n_g (+z) and n, towards wo if > 0
    float sheen = 0, sheen_roughness = 0;
    float anisotropy = 0, turn = 0;  // strength; radians from the x axis of the basis around n
    float film = 0, film_ior = 1.3f, film_thickness = 400;
    float through = 0, through_color = 1;  // diffuse transmission
};

/// Returns a scene with all lobes, so that all code is compiled.
inline Scene full_scene() {
    Material m;
    m.metallic = 0.5f;
    m.clearcoat = 1;
    m.transmission = 0.5f;
    m.specular_color = vec3(0.5f);
    m.sheen_color = vec3(0.5f);
    m.anisotropy_strength = 0.5f;
    m.iridescence = 0.5f;
    m.diffuse_transmission = 0.5f;
    return triangle_scene(m);
}

inline constexpr const char* kBsdfLibrary = R"(
#include "shaders/lib/material.glsl"
#include "shaders/lib/bsdf.glsl"
#include "shaders/lib/sobol.glsl"
vec3 wo_of(uint c) {
    float cosine = inputs[6u * c + 1u].w;
    return vec3(sqrt((1.0 - cosine) * (1.0 + cosine)) * vec2(0.6, 0.8), cosine);
}
Bsdf bsdf_of(uint c) {
    vec4 a = inputs[6u * c];
    vec4 b = inputs[6u * c + 1u];
    vec4 d = inputs[6u * c + 2u];
    vec4 e = inputs[6u * c + 3u];
    Material m;
    m.base_color = vec3(d.x);
    m.metallic = a.x;
    m.emission = vec3(0.0);
    m.roughness = a.y;
    m.normal = bend_normal(vec3(sin(d.z) * vec2(0.6, 0.8), cos(d.z)), wo_of(c));
    m.specular = a.w;
    m.specular_color = vec3(d.y);
    m.dielectric_f0 = a.z;
    m.coat_normal = m.normal;
    m.coat = b.x;
    m.coat_roughness = b.y;
    m.transmission = b.z;
    m.sheen_color = vec3(e.x);
    m.sheen_roughness = e.y;
    vec4 f = inputs[6u * c + 4u];
    m.iridescence = f.x;
    m.film_ior = f.y;
    m.film_thickness = 0.0;
    m.film_thickness_range = f.z;
    m.diffuse_transmission = inputs[6u * c + 5u].x;
    m.diffuse_transmission_color = vec3(inputs[6u * c + 5u].y);
    m.anisotropy = e.z;
    m.rough_direction = basis_around(m.normal) * vec3(cos(e.w), sin(e.w), 0.0);
    return make_bsdf(m, vec3(0.0, 0.0, 1.0), wo_of(c));
}
float random_at(uint n, uint dimension) { return unit_float(hash_combine(hash_u32(n), dimension)); }
)";

inline std::vector<vec4> rows_of(const std::vector<BsdfCase>& cases) {
    std::vector<vec4> rows;
    for (const BsdfCase& c : cases) {
        rows.emplace_back(c.metallic, c.roughness, c.r0, c.specular);
        rows.emplace_back(c.coat, c.coat_roughness, c.transmission, c.cosine);
        rows.emplace_back(c.base_color, c.specular_color, c.tilt, 0);
        rows.emplace_back(c.sheen, c.sheen_roughness, c.anisotropy, c.turn);
        rows.emplace_back(c.film, c.film_ior, c.film_thickness, 0);
        rows.emplace_back(c.through, c.through_color, 0, 0);
    }
    return rows;
}

inline std::string describe(const BsdfCase& c) {
    return fmt::format(
        "metallic {} roughness {} r0 {} specular {} coat {} coat roughness {} transmission {} cosine {} tilt {} "
        "sheen {} sheen roughness {} anisotropy {} turn {} film {} ior {} thickness {} through {}, {}",
        c.metallic, c.roughness, c.r0, c.specular, c.coat, c.coat_roughness, c.transmission, c.cosine, c.tilt, c.sheen,
        c.sheen_roughness, c.anisotropy, c.turn, c.film, c.film_ior, c.film_thickness, c.through, c.through_color);
}

class ShadingBsdf : public GpuTest {
  protected:
    using Case = BsdfCase;
    ShadingScene scene{full_scene()};

    /// Runs a kernel `count` times per case; returns its results.
    std::vector<vec4> run(const std::string& body, const std::vector<Case>& cases, std::uint32_t count = 1) const {
        return scene.run(kBsdfLibrary, body, count * static_cast<std::uint32_t>(cases.size()), 1, rows_of(cases));
    }

    /// Returns the directional albedo of each case, and the number of directions without unit length.
    std::vector<vec4> albedos(const std::vector<Case>& cases, int samples) const {
        return run(fmt::format("const uint kSamples = {}u;", samples) + R"(
        Bsdf b = bsdf_of(i);
        vec3 wo = wo_of(i);
        vec3 sum = vec3(0.0);
        float bad = 0.0;
        float rest = 1.0 - b.p_coat - b.p_transmission - b.p_sheen;
        for (uint n = 0u; n < kSamples; ++n) {
            Sampler s = make_sampler(i, 0u, n, 7u);
            vec2 xi = sample_2d(s, 0u);
            // Every lobe, times its probability.
            BsdfSample d = sample_diffuse(b, wo, xi, random_at(n, 2u));
            BsdfSample coat = sample_glossy(b, wo, xi, 0.5 * b.p_coat);
            BsdfSample through = sample_glossy(b, wo, xi, b.p_coat + 0.5 * b.p_transmission);
            BsdfSample sheen = sample_glossy(b, wo, xi, b.p_coat + b.p_transmission + 0.5 * b.p_sheen);
            BsdfSample specular = sample_glossy(b, wo, xi, b.p_coat + b.p_transmission + b.p_sheen + 0.5 * rest);
            sum += d.weight + b.p_coat * coat.weight + b.p_transmission * through.weight + b.p_sheen * sheen.weight +
                   rest * specular.weight;
            bad += abs(length(specular.direction) - 1.0) > 1e-6 ? 1.0 : 0.0;
        }
        result[0] = vec4(sum / float(kSamples), bad);
    )",
                   cases);
    }
};

}  // namespace halflight
