// Cases, kernels and checks of tests of the BSDF (shaders/lib/bsdf.glsl).
#pragma once

#include <gtest/gtest.h>

#include <fmt/format.h>
#include <string>
#include <vector>

#include "tests/pass/light/density_check.h"
#include "tests/pass/light/shading_kernel.h"
#include "tests/support/gpu_test.h"

namespace halflight {

/// A material and a view direction as rows of input. Solids have a thickness, an absorption of 0.5 per unit, and a coat
/// along n_g.
struct BsdfCase {
    float metallic = 0, roughness = 0.5f, r0 = 0.04f, specular = 1;
    float coat = 0, coat_roughness = 0, transmission = 0, cosine = 0.7f;
    float base_color = 1, specular_color = 1, tilt = 0;  // tilt: radians between n_g (+z) and n, towards wo if > 0
    float sheen = 0, sheen_roughness = 0;
    float anisotropy = 0, turn = 0;  // strength; radians from the x axis of the basis around n
    float film = 0, film_ior = 1.3f, film_thickness = 400;
    float through = 0, through_color = 1;             // diffuse transmission
    float thickness = 0, within = 0, dispersion = 0;  // within: 1 if the solid is seen from inside

    std::string describe() const {
        return fmt::format(
            "metallic {} roughness {} r0 {} specular {} coat {} coat roughness {} transmission {} cosine {} tilt {} "
            "sheen {} sheen roughness {} anisotropy {} turn {} film {} ior {} thickness {} through {}, {} solid {} "
            "within {} dispersion {}",
            metallic, roughness, r0, specular, coat, coat_roughness, transmission, cosine, tilt, sheen, sheen_roughness,
            anisotropy, turn, film, film_ior, film_thickness, through, through_color, thickness, within, dispersion);
    }
};

inline constexpr const char* kBsdfLibrary = R"(
#include "shaders/lib/material.glsl"
#include "shaders/lib/bsdf.glsl"
#include "shaders/lib/sobol.glsl"
vec4 row_of(uint c, uint row) { return inputs[6u * c + row]; }
vec3 direction_of(float cosine, vec2 around) { return vec3(sqrt((1.0 - cosine) * (1.0 + cosine)) * around, cosine); }
vec3 wo_of(uint c) { return direction_of(row_of(c, 1u).w, vec2(0.6, 0.8)); }
Material material_of(uint c) {
    vec4 a = row_of(c, 0u), b = row_of(c, 1u), d = row_of(c, 2u), e = row_of(c, 3u), f = row_of(c, 4u), g = row_of(c, 5u);
    Material m;
    m.base_color = vec3(d.x);
    m.metallic = a.x;
    m.emission = vec3(0.0);
    m.roughness = a.y;
    m.normal = bend_normal(vec3(sin(d.z) * vec2(0.6, 0.8), cos(d.z)), wo_of(c));
    m.specular = a.w;
    m.specular_color = vec3(d.y);
    m.dielectric_f0 = a.z;
    m.thickness = d.w;
    m.absorption = vec3(0.5);
    m.dispersion = f.w;
    m.channel = int(c % 3u);
    m.front = g.z == 0.0;
    m.coat_normal = m.thickness > 0.0 ? vec3(0.0, 0.0, 1.0) : m.normal;
    m.coat = b.x;
    m.coat_roughness = b.y;
    m.transmission = b.z;
    m.sheen_color = vec3(e.x);
    m.sheen_roughness = e.y;
    m.iridescence = f.x;
    m.film_ior = f.y;
    m.film_thickness = 0.0;
    m.film_thickness_range = f.z;
    m.diffuse_transmission = g.x;
    m.diffuse_transmission_color = vec3(g.y);
    m.anisotropy = e.z;
    m.rough_direction = basis_around(m.normal) * vec3(cos(e.w), sin(e.w), 0.0);
    return m;
}
Bsdf bsdf_of(uint c) { return make_bsdf(material_of(c), vec3(0.0, 0.0, 1.0), wo_of(c)); }
float random_at(uint n, uint dimension) { return unit_float(hash_combine(hash_u32(n), dimension)); }
)";

class BsdfTest : public GpuTest {
  protected:
    using Case = BsdfCase;
    explicit BsdfTest(const Material& all_lobes) : scene(triangle_scene(all_lobes)) {}

    /// Runs a kernel `count` times per case; returns its results, `rows` each.
    std::vector<vec4> run(const std::string& body, const std::vector<Case>& cases, std::uint32_t count = 1,
                          std::uint32_t rows = 1) const {
        std::vector<vec4> inputs;
        for (const Case& c : cases) {
            inputs.emplace_back(c.metallic, c.roughness, c.r0, c.specular);
            inputs.emplace_back(c.coat, c.coat_roughness, c.transmission, c.cosine);
            inputs.emplace_back(c.base_color, c.specular_color, c.tilt, c.thickness);
            inputs.emplace_back(c.sheen, c.sheen_roughness, c.anisotropy, c.turn);
            inputs.emplace_back(c.film, c.film_ior, c.film_thickness, c.dispersion);
            inputs.emplace_back(c.through, c.through_color, c.within, 0);
        }
        return scene.run(kBsdfLibrary, body, count * static_cast<std::uint32_t>(cases.size()), rows, inputs);
    }

    /// Expects that samples follow their densities. A density that is 5 % off over half of a lobe shifts chi-square by
    /// about 160, six standard deviations; chance exceeds the bound once in 10^4 cases.
    void expect_densities(const std::vector<Case>& cases) const {
        using Bins = test::DirectionBins;
        constexpr std::uint32_t kSamples = 1u << 16;
        const std::vector<vec4> samples = run(R"(
            uint c = i >> 16, n = i & 0xffffu;
            Bsdf b = bsdf_of(c);
            vec2 xi = vec2(random_at(i, 0u), random_at(i, 1u));
            BsdfSample d = sample_diffuse(b, wo_of(c), xi, random_at(i, 2u));
            BsdfSample g = sample_glossy(b, wo_of(c), xi, random_at(i, 2u));
            result[0] = vec4(d.direction, d.pdf);
            result[1] = vec4(g.direction, g.pdf);
        )",
                                              cases, kSamples, 2);
        static_assert(Bins::kRows * Bins::kSub == 384 && Bins::kColumns * Bins::kSub == 512);
        const std::vector<vec4> densities = run(R"(
            uint c = i / (384u * 512u), n = i % (384u * 512u);
            float z = -1.0 + 2.0 * (float(n / 512u) + 0.5) / 384.0;
            float phi = 6.28318530718 * (float(n % 512u) + 0.5) / 512.0;
            BsdfValue v = evaluate_bsdf(bsdf_of(c), wo_of(c), direction_of(z, vec2(cos(phi), sin(phi))));
            result[0] = vec4(v.pdf_diffuse, v.pdf_glossy, 0.0, 0.0);
        )",
                                                cases, Bins::kGrid);
        for (std::size_t c = 0; c < cases.size(); ++c) {
            for (const int lobe : {0, 1}) {
                SCOPED_TRACE((lobe == 0 ? "diffuse, " : "glossy, ") + cases[c].describe());
                Bins bins;
                for (int i = 0; i < Bins::kGrid; ++i)
                    bins.expect(i, densities[c * Bins::kGrid + std::size_t(i)][lobe], kSamples);
                for (std::size_t i = 0; i < kSamples; ++i) {
                    const vec4& s = samples[2 * (c * kSamples + i) + std::size_t(lobe)];
                    if (s.w > 0) bins.count(dvec3(s));
                }
                // Too few points integrate the bins at a lobe's edge, so these are pooled with their neighbours. The
                // rest of the unit mass belongs to directions that the side rules or the horizon reject.
                EXPECT_GT(test::chi_square(bins.found, bins.expected, 100).p_value(), 1e-4);
                const double lost = kSamples - bins.directions;
                EXPECT_NEAR(lost, kSamples - bins.expected_directions(),
                            5 * std::sqrt(std::max(lost, 100.0)) + 1e-3 * kSamples);
            }
        }
    }

    /// Expects finite values, unit directions and bounded weights for all cases.
    void expect_finite(const std::vector<Case>& cases) const {
        const auto found = run(R"(
            Bsdf b = bsdf_of(i);
            vec3 wo = wo_of(i);
            float worst = 0.0;
            float bad = 0.0;
            for (uint n = 0u; n < 64u; ++n) {
                vec2 xi = vec2(random_at(64u * i + n, 0u), random_at(64u * i + n, 1u));
                if (n == 0u) xi = vec2(0.0);
                if (n == 1u) xi = vec2(0.99999994);
                BsdfSample g = sample_glossy(b, wo, xi, random_at(64u * i + n, 2u));
                BsdfSample d = sample_diffuse(b, wo, xi, random_at(64u * i + n, 3u));
                vec3 wi = n % 4u == 0u ? reflect(-wo, b.normal) : n % 4u == 1u ? -wo : n % 4u == 2u ? g.direction
                          : sphere_direction(2.0 * xi.x - 1.0, xi.y);
                if (n == 2u) wi = normalize(vec3(wi.xy, 1e-7));
                BsdfValue v = evaluate_bsdf(b, wo, wi);
                float smallest = min(min(min(v.pdf_diffuse, v.pdf_glossy), min(g.pdf, d.pdf)),
                                     min(min(v.glossy.x, v.diffuse.x), min(g.weight.x, d.weight.x)));
                float largest = max(max(max(v.pdf_diffuse, v.pdf_glossy), max(g.pdf, d.pdf)),
                                    max(max(v.glossy.x, v.diffuse.x), max(g.weight.x, d.weight.x)));
                bad += smallest >= 0.0 && largest < 1e30 ? 0.0 : 1.0;  // false for NaN
                bad += abs(length(g.direction) - 1.0) < 1e-5 ? 0.0 : 1.0;
                worst = max(worst, max(g.weight.x, d.weight.x));
                bool is_dark = v.diffuse + v.glossy == vec3(0.0);
                float side_g = dot(wi, b.geometric_normal);
                bool between = side_g * dot(wi, b.normal) <= 0.0 && side_g * dot(wi, base_normal(b, wo)) <= 0.0;
                if (!kVolume) bad += between && !is_dark && b.coat == 0.0 ? 1.0 : 0.0;
                vec3 passed = transmittance(medium_towards(b, vec4(0.0), wi), 1e30);
                if (kVolume) bad += passed.x >= 0.0 && passed.x <= 1.0 ? 0.0 : 1.0;
            }
            result[0] = vec4(bad, worst, b.p_diffuse, b.p_coat + b.p_transmission + b.p_sheen);
        )",
                               cases);
        for (std::size_t i = 0; i < cases.size(); ++i) {
            SCOPED_TRACE(cases[i].describe());
            EXPECT_EQ(found[i].x, 0);
            EXPECT_LT(found[i].y, 100);
            EXPECT_TRUE(found[i].z >= 0 && found[i].z <= 1 && found[i].w >= 0 && found[i].w <= 1.000001f);
        }
    }

    ShadingScene scene;
};

/// Opaque surfaces with all lobes, so that all their code is compiled.
class ShadingBsdf : public BsdfTest {
  protected:
    ShadingBsdf() : BsdfTest(all_lobes()) {}

    static Material all_lobes() {
        Material m;
        m.metallic = 0.5f;
        m.clearcoat = 1;
        m.transmission = 0.5f;
        m.specular_color = vec3(0.5f);
        m.sheen_color = vec3(0.5f);
        m.anisotropy_strength = 0.5f;
        m.iridescence = 0.5f;
        m.diffuse_transmission = 0.5f;
        return m;
    }
};

}  // namespace halflight
