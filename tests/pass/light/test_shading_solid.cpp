// Tests solid transmission of shaders/lib/bsdf.glsl: energy, densities, extremes, media.
#include <array>
#include <cmath>
#include <random>

#include "tests/pass/light/shading_bsdf.h"

namespace halflight {
namespace {

/// A white solid and a view direction.
struct Solid {
    float roughness = 0.5f, ior = 1.5f, cosine = 0.7f;
    bool front = true;
    float transmission = 1, metallic = 0, coat = 0, tilt = 0;
    float anisotropy = 0, film = 0;  // parameters of the metal and the opaque dielectric
    float specular = 1, dispersion = 0;
};

std::vector<BsdfCase> cases_of(const std::vector<Solid>& solids) {
    std::vector<BsdfCase> cases;
    for (const Solid& s : solids) {
        const float root = (s.ior - 1) / (s.ior + 1);
        BsdfCase& c = cases.emplace_back();
        c.roughness = s.roughness, c.r0 = root * root, c.cosine = s.cosine, c.within = s.front ? 0.0f : 1.0f;
        c.transmission = s.transmission, c.metallic = s.metallic, c.tilt = s.tilt;
        c.coat = s.coat, c.coat_roughness = 0.3f, c.specular = s.specular;
        c.anisotropy = s.anisotropy, c.turn = 0.93f, c.film = s.film;
        c.thickness = 2, c.dispersion = s.dispersion;
    }
    return cases;
}

class ShadingSolid : public BsdfTest {
  protected:
    ShadingSolid() : BsdfTest(solid()) {}

    static Material solid() {
        Material m;
        m.metallic = 0.5f;
        m.transmission = 0.5f;
        m.thickness = 1;
        m.clearcoat = 0.5f;
        m.anisotropy_strength = 0.5f;
        m.iridescence = 0.5f;
        m.dispersion = 1;
        return m;
    }
};

TEST_F(ShadingSolid, WhiteFurnace) {
    std::vector<Solid> solids;
    for (const float cosine : {0.02f, 0.3f, 0.75f, 1.0f}) {
        for (const float roughness : {0.0f, 0.05f, 0.3f, 0.6f, 1.0f}) {
            for (const bool front : {false, true}) {
                for (const float ior : {1.0f, 1.0001f, 1.33f, 1.5f, 2.4f, 20.0f})
                    solids.push_back({roughness, ior, cosine, front});
                solids.push_back({roughness, 1.5f, cosine, front, 0.6f, 0.3f, 0.5f});
                solids.push_back({roughness, 1.5f, cosine, front, 0.6f, 0.3f, 0.5f, 0, 0.7f});
            }
        }
    }
    for (const float cosine : {0.02f, 0.3f, 0.75f, 1.0f}) {
        for (const float roughness : {0.0f, 0.3f, 1.0f}) {
            for (const float specular : {0.0f, 0.4f})
                for (const float ior : {1.5f, 20.0f})
                    solids.push_back({roughness, ior, cosine, true, 1, 0, 0, 0, 0, 0, specular});
            solids.push_back({roughness, 1.5f, cosine, false, 1, 0, 0, 0, 0, 0, 0.4f, 30});
        }
    }
    for (const float cosine : {0.02f, 0.3f, 0.75f, 1.0f})
        for (const float roughness : {0.0f, 0.05f, 0.3f, 0.6f, 1.0f})
            for (const bool front : {false, true})
                for (const float ior : {60.0f, 999.0f}) solids.push_back({roughness, ior, cosine, front});
    const std::vector<BsdfCase> cases = cases_of(solids);
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
                            cases);
    for (std::size_t c = 0; c < cases.size(); ++c) {
        // Solids of roughness 0 are mirrors. An anisotropic lobe beside them is no mirror, and its table is coarser.
        const double mirror = cases[c].anisotropy > 0 ? 5e-3 : 2e-3;
        EXPECT_NEAR(albedo[c].x, 1, cases[c].roughness == 0 ? mirror : 2e-2) << cases[c].describe();
    }
}

TEST_F(ShadingSolid, SamplesFollowTheirDensity) {
    expect_densities(cases_of({{0.4f, 1.5f, 0.9f, true},
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
                               {0.6f, 2.4f, 0.5f, true, 0.7f, 0, 0.5f, 0.4f, 0, 0, 0}}));
}

TEST_F(ShadingSolid, EverythingStaysFiniteAndNonNegative) {
    std::mt19937 random(2);
    const auto uniform = [&] { return static_cast<float>(random() >> 8) * 0x1p-24f; };
    const auto extreme = [&] {
        return std::array{0.0f, 1.0f, uniform(), std::pow(10.0f, -6 * uniform())}[random() % 4];
    };
    std::vector<Solid> solids(4096);
    for (Solid& s : solids) {
        const float ior = std::array{1.0f, 1 + 1e-6f, 1 + extreme(), 20.0f, 1e5f}[random() % 5];
        const float dispersion = std::array{0.0f, extreme(), 1e6f}[random() % 3];
        s = {extreme(), ior,       std::max(extreme(), 1e-7f), random() % 2 == 0, extreme(),
             extreme(), extreme(), 3 * uniform() - 1.5f,       extreme(),         extreme(),
             extreme(), dispersion};
    }
    expect_finite(cases_of(solids));
}

TEST_F(ShadingSolid, OnlyOpaqueSurfacesHaveAHorizon) {
    // The normal is tilted away from the horizon's. The coat of an opaque surface is bent, that of a solid is not.
    const auto found = run(R"(
        Material m = material_of(0u);
        if (i > 0u) m.thickness = 0.0;
        vec3 wo = direction_of(0.1, vec2(1.0, 0.0));
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
                           cases_of({{.coat = 0.5f}}), 2);
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
                           cases_of({{.front = true}, {.front = false}}), 2);
    const auto passed = [](double depth) { return static_cast<float>(std::exp(-depth)); };
    const std::array<vec4, 4> expected = {vec4(9, 3, 0, passed(18)), vec4(0.5f, 2, 1, passed(1)),
                                          vec4(0.5f, 2, 1, passed(1)), vec4(0, 0, 0, 1)};
    for (std::size_t i = 0; i < 4; ++i)
        for (int c = 0; c < 4; ++c) EXPECT_NEAR(found[i][c], expected[i][c], 1e-6) << i << ' ' << c;
}

}  // namespace
}  // namespace halflight
