// Tests solid transmission of shaders/lib/bsdf.glsl: energy, densities, reciprocity, extremes.
#include <gtest/gtest.h>

#include <fmt/format.h>
#include <cmath>
#include <random>

#include "engine/core/statistics.h"
#include "tests/pass/light/density_check.h"
#include "tests/pass/light/shading_kernel.h"
#include "tests/support/gpu_test.h"

namespace halflight {
namespace {

/// A white solid and a view direction as three rows of input.
struct Case {
    float roughness = 0.5f, ior = 1.5f, cosine = 0.7f;
    bool front = true;
    float transmission = 1, metallic = 0, coat = 0, tilt = 0;  // tilt: radians between n_g (+z) and n
    float anisotropy = 0, film = 0;                            // parameters of the metal and the opaque dielectric
    float specular = 1, dispersion = 0;
};

Scene solid_scene() {
    Material m;
    m.metallic = 0.5f;
    m.transmission = 0.5f;
    m.thickness = 1;
    m.clearcoat = 0.5f;
    m.anisotropy_strength = 0.5f;
    m.iridescence = 0.5f;
    m.dispersion = 1;
    return triangle_scene(m);
}

const char* const kLibrary = R"(
#include "shaders/lib/material.glsl"
#include "shaders/lib/bsdf.glsl"
#include "shaders/lib/sobol.glsl"
vec3 direction_of(float cosine, float turn) {
    return vec3(sqrt((1.0 - cosine) * (1.0 + cosine)) * vec2(cos(turn), sin(turn)), cosine);
}
vec3 wo_of(uint c) { return direction_of(inputs[3u * c].z, 0.9); }
Material material_of(uint c) {
    vec4 a = inputs[3u * c];
    vec4 d = inputs[3u * c + 1u];
    Material m;
    m.base_color = vec3(1.0);
    m.metallic = d.y;
    m.emission = vec3(0.0);
    m.roughness = a.x;
    m.normal = vec3(0.0, 0.0, 1.0);
    m.specular = inputs[3u * c + 2u].z;
    m.specular_color = vec3(1.0);
    m.dispersion = inputs[3u * c + 2u].w;
    m.channel = int(c % 3u);
    m.dielectric_f0 = ((a.y - 1.0) / (a.y + 1.0)) * ((a.y - 1.0) / (a.y + 1.0));
    m.coat_normal = m.normal;
    m.coat = d.z;
    m.coat_roughness = 0.3;
    m.transmission = d.x;
    m.thickness = 2.0;
    m.absorption = vec3(0.5);
    m.sheen_color = vec3(0.0);
    m.sheen_roughness = 0.0;
    m.front = a.w != 0.0;
    m.diffuse_transmission = 0.0;
    m.diffuse_transmission_color = vec3(1.0);
    m.anisotropy = inputs[3u * c + 2u].x;
    m.iridescence = inputs[3u * c + 2u].y;
    m.film_ior = 1.3;
    m.film_thickness = 0.0;
    m.film_thickness_range = 400.0;
    return m;
}
Bsdf bsdf_of(uint c) {
    Material m = material_of(c);
    float tilt = inputs[3u * c + 1u].w;
    m.normal = bend_normal(vec3(sin(tilt) * vec2(0.6, 0.8), cos(tilt)), wo_of(c));
    m.rough_direction = basis_around(m.normal) * vec3(0.6, 0.8, 0.0);
    return make_bsdf(m, vec3(0.0, 0.0, 1.0), wo_of(c));
}
float random_at(uint n, uint dimension) { return unit_float(hash_combine(hash_u32(n), dimension)); }
)";

std::string describe(const Case& c) {
    return fmt::format(
        "roughness {} ior {} cosine {} front {} transmission {} metallic {} coat {} tilt {} anisotropy {} film {} "
        "specular {} dispersion {}",
        c.roughness, c.ior, c.cosine, c.front, c.transmission, c.metallic, c.coat, c.tilt, c.anisotropy, c.film,
        c.specular, c.dispersion);
}

class ShadingSolid : public GpuTest {
  protected:
    ShadingScene scene{solid_scene()};
    std::vector<vec4> run(const std::string& body, std::uint32_t count, const std::vector<Case>& cases) const {
        std::vector<vec4> rows;
        for (const Case& c : cases) {
            rows.emplace_back(c.roughness, c.ior, c.cosine, c.front ? 1 : 0);
            rows.emplace_back(c.transmission, c.metallic, c.coat, c.tilt);
            rows.emplace_back(c.anisotropy, c.film, c.specular, c.dispersion);
        }
        return scene.run(kLibrary, body, count, 1, rows);
    }
};

TEST_F(ShadingSolid, FresnelFollowsItsLimits) {
    const auto found = run(R"(
        float eta = i == 0u ? 1.5 : i == 1u ? 1.0 / 1.5 : i == 2u ? 1.0 : 20.0;
        result[0] = vec4(fresnel_dielectric(1.0, eta), fresnel_dielectric(0.0, eta), fresnel_dielectric(0.5, eta),
                         fresnel_dielectric(0.75, 1.0 / 1.5));
    )",
                           4, {{}});
    EXPECT_NEAR(found[0].x, 0.04, 1e-6);
    EXPECT_NEAR(found[1].x, 0.04, 1e-6);
    EXPECT_NEAR(found[3].x, std::pow(19.0 / 21, 2), 1e-5);
    EXPECT_EQ(found[0].y, 1);
    EXPECT_NEAR(found[0].z, 0.0892, 1e-4);  // at 60 degrees: s 0.1773, p 0.0012
    EXPECT_EQ(found[1].z, 1) << "total internal reflection from 41.8 degrees on";
    EXPECT_LT(found[1].w, 1) << "the critical cosine is 0.745";
    EXPECT_EQ(found[2].x, 0);
    EXPECT_EQ(found[2].z, 0);
}

TEST_F(ShadingSolid, WhiteFurnace) {
    std::vector<Case> cases;
    for (const float cosine : {0.02f, 0.3f, 0.75f, 1.0f}) {
        for (const float roughness : {0.0f, 0.05f, 0.3f, 0.6f, 1.0f}) {
            for (const bool front : {false, true}) {
                for (const float ior : {1.0f, 1.0001f, 1.33f, 1.5f, 2.4f, 20.0f})
                    cases.push_back({roughness, ior, cosine, front});
                cases.push_back({roughness, 1.5f, cosine, front, 0.6f, 0.3f, 0.5f});
                cases.push_back({roughness, 1.5f, cosine, front, 0.6f, 0.3f, 0.5f, 0, 0.7f});
            }
        }
    }
    for (const float cosine : {0.02f, 0.3f, 0.75f, 1.0f}) {
        for (const float roughness : {0.0f, 0.3f, 1.0f}) {
            for (const float specular : {0.0f, 0.4f})
                for (const float ior : {1.5f, 20.0f})
                    cases.push_back({roughness, ior, cosine, true, 1, 0, 0, 0, 0, 0, specular});
            cases.push_back({roughness, 1.5f, cosine, false, 1, 0, 0, 0, 0, 0, 0.4f, 30});
        }
    }
    for (const float cosine : {0.02f, 0.3f, 0.75f, 1.0f})
        for (const float roughness : {0.0f, 0.05f, 0.3f, 0.6f, 1.0f})
            for (const bool front : {false, true})
                for (const float ior : {60.0f, 999.0f}) cases.push_back({roughness, ior, cosine, front});
    const auto albedo = run(R"(
        Bsdf b = bsdf_of(i);
        vec3 wo = wo_of(i);
        float sum = 0.0;
        for (uint n = 0u; n < 16384u; ++n) {
            Sampler s = make_sampler(i, 0u, n, 7u);
            vec2 xi = sample_2d(s, 0u);
            vec2 choice = sample_2d(s, 2u);
            bool is_diffuse = picks_diffuse(b, choice.x);
            sum += is_diffuse ? sample_diffuse(b, wo, xi, choice.y).weight.x / max(b.p_diffuse, 1e-9)
                              : sample_glossy(b, wo, xi, choice.y).weight.x / max(1.0 - b.p_diffuse, 1e-9);
        }
        result[0] = vec4(sum / 16384.0, 0.0, 0.0, 0.0);
    )",
                            static_cast<std::uint32_t>(cases.size()), cases);
    double worst = 0;
    for (std::size_t c = 0; c < cases.size(); ++c) {
        // Solids of roughness 0 are mirrors. An anisotropic lobe beside them is none, and its table is coarser.
        const double mirror = cases[c].anisotropy > 0 ? 5e-3 : 2e-3;
        EXPECT_NEAR(albedo[c].x, 1, cases[c].roughness == 0 ? mirror : 2e-2) << describe(cases[c]);
        worst = std::max(worst, std::abs(albedo[c].x - 1.0));
    }
    RecordProperty("worst", fmt::format("{}", worst));
}

TEST_F(ShadingSolid, SamplesFollowTheirDensity) {
    const std::vector<Case> cases = {{0.4f, 1.5f, 0.9f, true},
                                     {0.6f, 1.5f, 0.3f, false},
                                     {1.0f, 1.33f, 0.5f, true},
                                     {0.7f, 2.4f, 0.8f, false},
                                     {0.7f, 20.0f, 0.5f, false},
                                     {0.6f, 1.5f, 0.6f, true, 0.5f, 0.3f, 0.6f},
                                     {0.5f, 1.5f, 0.4f, true, 1, 0, 0, 0.5f},
                                     {0.5f, 1.5f, 0.6f, false, 0.7f, 0, 0.5f, -0.6f},
                                     {0.5f, 1.5f, 0.6f, true, 0.5f, 0.3f, 0.3f, 0.3f, 0.6f, 0.5f},
                                     {0.4f, 1.5f, 0.5f, false, 0.6f, 0.2f, 0, 0, 0.8f, 1},
                                     {0.5f, 1.5f, 0.4f, true, 1, 0, 0, 0, 0, 0, 0.3f},
                                     {0.6f, 2.4f, 0.5f, true, 0.7f, 0, 0.5f, 0.4f, 0, 0, 0}};
    for (const Case& c : cases)
        expect_density([&](const std::string& body, std::uint32_t count) { return run(body, count, {c}); },
                       "sample_glossy", "pdf_glossy", describe(c));
}

// f mu_i of basic radiance, times the squared index of the viewer's side and mu_o, is symmetric (Walter et al. 2007).
TEST_F(ShadingSolid, SingleScatteringIsReciprocal) {
    const std::vector<Case> cases = {{0.3f, 1.5f, 0.8f}, {0.8f, 1.5f, 0.5f}, {0.6f, 2.4f, 0.3f}};
    const auto found = run(R"(
        uint c = i / 64u;
        vec3 wo = wo_of(c);
        float eta = inputs[3u * c].y;
        float alpha = inputs[3u * c].x * inputs[3u * c].x;
        vec3 wi = direction_of(-(0.1 + 0.9 * random_at(i, 0u)), 6.28 * random_at(i, 1u));
        vec3 n = vec3(0.0, 0.0, 1.0);
        RefractedValue there = refracted_evaluate(n, alpha, eta, wo, wi);
        RefractedValue back = refracted_evaluate(-n, alpha, 1.0 / eta, wi, wo);
        float passed = 1.0 - fresnel_dielectric(there.x, eta);
        float returned = 1.0 - fresnel_dielectric(back.x, 1.0 / eta);
        result[0] = vec4(there.scattered * passed * wo.z, back.scattered * returned * -wi.z * eta * eta,
                         passed - returned, 0.0);
    )",
                           64 * static_cast<std::uint32_t>(cases.size()), cases);
    int lit = 0;
    for (const vec4& f : found) {
        EXPECT_NEAR(f.x, f.y, 1e-3 * f.x + 1e-6);
        // Near total reflection, F changes by thousands of roundings of the cosine.
        EXPECT_NEAR(f.z, 0, context.software() ? 1e-4 : 5e-4);
        lit += f.x > 0;
    }
    EXPECT_GT(lit, 50);
}

TEST_F(ShadingSolid, EverythingStaysFiniteAndNonNegative) {
    std::mt19937 random(2);
    const auto uniform = [&] { return static_cast<float>(random() >> 8) * 0x1p-24f; };
    const auto extreme = [&] {
        return std::array{0.0f, 1.0f, uniform(), std::pow(10.0f, -6 * uniform())}[random() % 4];
    };
    std::vector<Case> cases(4096);
    for (Case& c : cases) {
        const float ior = std::array{1.0f, 1 + 1e-6f, 1 + extreme(), 20.0f, 1e5f}[random() % 5];
        const float dispersion = std::array{0.0f, extreme(), 1e6f}[random() % 3];
        c = {extreme(), ior,       std::max(extreme(), 1e-7f), random() % 2 == 0, extreme(),
             extreme(), extreme(), 3 * uniform() - 1.5f,       extreme(),         extreme(),
             extreme(), dispersion};
    }
    const auto found = run(R"(
        Bsdf b = bsdf_of(i);
        vec3 wo = wo_of(i);
        float bad = 0.0;
        float worst = 0.0;
        for (uint n = 0u; n < 64u; ++n) {
            vec2 xi = vec2(random_at(64u * i + n, 0u), random_at(64u * i + n, 1u));
            if (n == 0u) xi = vec2(0.0);
            if (n == 1u) xi = vec2(0.99999994);
            BsdfSample g = sample_glossy(b, wo, xi, random_at(64u * i + n, 2u));
            vec3 wi = n % 4u == 0u ? reflect(-wo, b.normal) : n % 4u == 1u ? -wo : n % 4u == 2u ? g.direction
                      : sphere_direction(2.0 * xi.x - 1.0, xi.y);
            BsdfValue v = evaluate_bsdf(b, wo, wi);
            float smallest = min(min(v.pdf_glossy, g.pdf), min(v.glossy.x, g.weight.x));
            float largest = max(max(v.pdf_glossy, g.pdf), max(v.glossy.x, g.weight.x));
            bad += smallest >= 0.0 && largest < 1e30 ? 0.0 : 1.0;  // false for NaN
            bad += abs(length(g.direction) - 1.0) < 1e-5 ? 0.0 : 1.0;
            vec3 passed = transmittance(medium_towards(b, vec4(0.0), wi), 1e30);
            bad += passed.x >= 0.0 && passed.x <= 1.0 ? 0.0 : 1.0;
            worst = max(worst, g.weight.x);
        }
        result[0] = vec4(bad, worst, b.p_transmission, 0.0);
    )",
                           static_cast<std::uint32_t>(cases.size()), cases);
    for (std::size_t i = 0; i < cases.size(); ++i) {
        EXPECT_EQ(found[i].x, 0) << describe(cases[i]);
        EXPECT_LT(found[i].y, 100) << describe(cases[i]);
        EXPECT_TRUE(found[i].z >= 0 && found[i].z <= 1.000001f) << describe(cases[i]);
    }
}

TEST_F(ShadingSolid, OnlyOpaqueSurfacesHaveAHorizon) {
    // The normal is tilted away from the horizon's. The coat of an opaque surface is bent, that of a solid is not.
    const auto found = run(R"(
        Material m = material_of(0u);
        m.thickness = i == 0u ? 2.0 : 0.0;
        vec3 wo = direction_of(0.1, 0.0);
        m.normal = vec3(0.6, 0.0, 0.8);
        m.rough_direction = vec3(0.0);
        vec3 horizon = normalize(vec3(0.5, 0.0, 1.0));
        vec3 turned = make_bsdf(m, horizon, wo).coat_normal - m.coat_normal;
        vec3 flat_solid = make_bsdf(m, vec3(0.0, 0.0, 1.0), wo).coat_normal - m.coat_normal;
        vec3 below = normalize(vec3(-0.7, 0.0, 0.3));
        m.normal = m.coat_normal = normalize(vec3(-0.8, 0.0, 0.6));
        bool leaves = leaves_base(layers_of(m, horizon), below);
        result[0] = vec4(length(turned), length(flat_solid), leaves ? 1.0 : 0.0, dot(horizon, below));
    )",
                           2, {{.coat = 0.5f}});
    EXPECT_EQ(found[0].x, 0);
    EXPECT_EQ(found[0].y, 0);
    EXPECT_EQ(found[0].z, 1);
    EXPECT_GT(found[1].x, 0.01f);
    EXPECT_EQ(found[1].y, 0);
    EXPECT_LT(found[1].w, 0);
    EXPECT_EQ(found[1].z, 0) << "no light leaves below the horizon";
}

TEST_F(ShadingSolid, MediaFollowTheSides) {
    // Rows: a front face and a back face, each with light from the viewer's side and from beyond.
    const auto found = run(R"(
        Bsdf b = bsdf_of(i / 2u);
        vec4 m = medium_towards(b, vec4(9.0, 9.0, 9.0, 3.0), vec3(0.0, 0.0, i % 2u == 0u ? 1.0 : -1.0));
        result[0] = vec4(m.x, m.w, leads_inside(b, vec3(0.0, 0.0, i % 2u == 0u ? 1.0 : -1.0)) ? 1.0 : 0.0,
                         transmittance(m, 2.0).x);
    )",
                           4, {{.front = true}, {.front = false}});
    const auto passed = [](double depth) { return static_cast<float>(std::exp(-depth)); };
    const std::array<vec4, 4> expected = {vec4(9, 3, 0, passed(18)), vec4(0.5f, 2, 1, passed(1)),
                                          vec4(0.5f, 2, 1, passed(1)), vec4(0, 0, 0, 1)};
    for (std::size_t i = 0; i < 4; ++i)
        for (int c = 0; c < 4; ++c) EXPECT_NEAR(found[i][c], expected[i][c], 1e-6) << i << ' ' << c;
}

}  // namespace
}  // namespace halflight
