// Tests the BSDF: energy, densities, extremes, bent normals.
#include <array>
#include <cmath>
#include <random>

#include "engine/core/statistics.h"
#include "tests/pass/light/shading_bsdf.h"

namespace halflight {
namespace {

/// Runs the directional albedo of each case, and counts directions without unit length.
class ShadingAlbedo : public ShadingBsdf {
  protected:
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

TEST_F(ShadingAlbedo, WhiteFurnace) {
    std::vector<Case> lobes{{.metallic = 1},
                            {.metallic = 0.4f, .specular = 0.5f},
                            {.transmission = 1},
                            {.metallic = 0.3f, .transmission = 0.6f}};
    for (const float r0 : {0.0f, 0.04f, 0.2f}) lobes.push_back({.r0 = r0});
    for (const float roughness : {0.0f, 0.3f, 0.9f})
        lobes.push_back({.metallic = 0.5f, .coat = 0.8f, .coat_roughness = roughness, .transmission = 0.5f});
    for (const float through : {0.3f, 1.0f}) {
        lobes.push_back({.through = through});
        lobes.push_back(
            {.metallic = 0.5f, .coat = 0.5f, .coat_roughness = 0.3f, .transmission = 0.4f, .through = through});
    }
    for (const float turn : {0.0f, 0.9f, 2.5f}) {  // wo is 0.93 from the x axis
        lobes.push_back({.metallic = 1, .anisotropy = 0.4f, .turn = turn});
        lobes.push_back({.metallic = 0.5f, .transmission = 0.5f, .anisotropy = 0.9f, .turn = turn});
    }
    // The roughness of the loop is that of the sheen, from below its least one up to 1.
    const std::size_t first_sheen = lobes.size();
    lobes.push_back({.metallic = 0.5f, .sheen = 1});
    lobes.push_back({.roughness = 0.3f, .coat = 0.7f, .coat_roughness = 0.2f, .transmission = 0.4f, .sheen = 0.8f});
    std::vector<Case> cases;
    for (const float cosine : {0.02f, 0.1f, 0.4f, 0.8f, 1.0f}) {
        for (const float roughness : {0.0f, 0.011f, 0.05f, 0.2f, 0.35f, 0.5f, 0.7f, 0.85f, 1.0f}) {
            for (std::size_t i = 0; i < lobes.size(); ++i) {
                Case& c = cases.emplace_back(lobes[i]);
                c.cosine = cosine;
                (i < first_sheen ? c.roughness : c.sheen_roughness) = roughness;
            }
        }
    }
    const std::vector<vec4> albedo = albedos(cases, 8192);
    for (std::size_t c = 0; c < cases.size(); ++c) {
        EXPECT_EQ(albedo[c].w, 0) << cases[c].describe();
        // The table of anisotropic lobes is coarser.
        EXPECT_NEAR(albedo[c].x, 1, cases[c].anisotropy > 0 ? 5e-3 : 1e-3) << cases[c].describe();
    }
}

TEST_F(ShadingAlbedo, IridescenceStaysWithinEnergy) {
    std::vector<Case> cases;
    for (const float cosine : {0.05f, 0.4f, 1.0f})
        for (const float roughness : {0.0f, 0.1f, 0.5f, 1.0f})
            for (const float metallic : {0.0f, 0.5f, 1.0f})
                for (const float ior : {1.0f, 1.3f, 2.0f, 20.0f})
                    for (const float thickness : {0.0f, 150.0f, 400.0f, 1200.0f, 1e6f})
                        cases.push_back({.metallic = metallic,
                                         .roughness = roughness,
                                         .transmission = 0.3f,
                                         .cosine = cosine,
                                         .film = 1,
                                         .film_ior = ior,
                                         .film_thickness = thickness});
    const std::vector<vec4> found = albedos(cases, 2048);
    for (std::size_t i = 0; i < cases.size(); ++i) {
        SCOPED_TRACE(cases[i].describe());
        const float largest = std::max({found[i].x, found[i].y, found[i].z});
        EXPECT_LT(largest, 1.03f);
        EXPECT_GE(std::min({found[i].x, found[i].y, found[i].z}), 0);
        if (cases[i].film_thickness == 0 || cases[i].film_ior == 1) {
            EXPECT_NEAR(largest, 1, 3e-3);
        }
    }
}

TEST_F(ShadingAlbedo, FilmsWithoutThicknessOrFactorChangeNothing) {
    std::vector<Case> without, thin, off;
    for (const float cosine : {0.05f, 0.4f, 1.0f}) {
        for (const float roughness : {0.0f, 0.3f, 0.9f}) {
            for (const float metallic : {0.0f, 1.0f}) {
                Case c{.metallic = metallic, .roughness = roughness, .cosine = cosine, .base_color = 0.6f};
                without.push_back(c);
                c.film_ior = 2;
                off.push_back(c);
                c.film = 1, c.film_thickness = 0;
                thin.push_back(c);
            }
        }
    }
    const std::vector<vec4> expected = albedos(without, 2048), found = albedos(thin, 2048), zero = albedos(off, 2048);
    for (std::size_t i = 0; i < without.size(); ++i) {
        // The compensation for multiple scattering uses the mean reflectance instead of that at normal incidence.
        EXPECT_NEAR(found[i].x, expected[i].x, 0.02) << without[i].describe();
        EXPECT_EQ(zero[i], expected[i]) << without[i].describe();
    }
}

TEST_F(ShadingBsdf, AlbedoOfColouredLobesAgreesWithTheTables) {
    std::vector<Case> cases;
    std::vector<double> expected;
    for (const float roughness : {0.1f, 0.4f, 1.0f}) {
        for (const float cosine : {0.1f, 0.6f}) {
            const auto [a, b] = ggx_albedo(cosine, roughness * roughness);
            const auto gain = [&, whole = a + b](double f0) { return 1 + f0 * (1 - whole) / whole; };
            cases.push_back({.metallic = 1, .roughness = roughness, .cosine = cosine, .base_color = 0.3f});
            expected.push_back(gain(0.3) * (0.3 * a + b));
            cases.push_back({.roughness = roughness, .r0 = 0.1f, .specular = 0.7f, .cosine = cosine, .base_color = 0});
            cases.back().specular_color = 0.5f;
            expected.push_back(gain(0.035) * (0.035 * a + 0.7 * b));
            const float turn = 0.5f, strength = 0.6f;
            const double alpha_b = double(roughness) * roughness, alpha_t = glm::mix(alpha_b, 1.0, 0.36);
            const double sine = std::sqrt(1 - double(cosine) * cosine), azimuth = std::atan2(0.8, 0.6) - turn;
            const DirectionalAlbedo e =
                ggx_albedo(dvec3(sine * std::cos(azimuth), sine * std::sin(azimuth), cosine), dvec2(alpha_t, alpha_b));
            cases.push_back({.metallic = 1, .roughness = roughness, .cosine = cosine, .base_color = 0.3f});
            cases.back().anisotropy = strength, cases.back().turn = turn;
            expected.push_back((1 + 0.3 * (1 - e.a - e.b) / (e.a + e.b)) * (0.3 * e.a + e.b));
            const double e_d = gain(0.04) * (0.04 * a + b);
            cases.push_back({.roughness = roughness, .transmission = 0.25f, .cosine = cosine, .base_color = 0.5f});
            expected.push_back(e_d + 0.5 * (1 - e_d) * 0.25);
        }
    }
    const auto albedo = run(R"(
        Bsdf b = bsdf_of(i);
        vec3 sum = vec3(0.0);
        float rest = 1.0 - b.p_transmission;
        for (uint n = 0u; n < 16384u; ++n) {
            vec2 xi = sample_2d(make_sampler(i, 0u, n, 3u), 0u);
            sum += b.p_transmission * sample_glossy(b, wo_of(i), xi, 0.5 * b.p_transmission).weight +
                   rest * sample_glossy(b, wo_of(i), xi, b.p_transmission + 0.5 * rest).weight;
        }
        result[0] = vec4(sum / 16384.0, 0.0);
    )",
                            cases);
    for (std::size_t i = 0; i < cases.size(); ++i)
        EXPECT_NEAR(albedo[i].x, expected[i], cases[i].anisotropy > 0 ? 3e-3 : 1e-3) << cases[i].describe();
}

TEST_F(ShadingBsdf, EverythingStaysFiniteAndNonNegative) {
    std::mt19937 random(1);
    const auto uniform = [&] { return static_cast<float>(random() >> 8) * 0x1p-24f; };
    const auto extreme = [&] {
        return std::array{0.0f, 1.0f, uniform(), std::pow(10.0f, -6 * uniform())}[random() % 4];
    };
    std::vector<Case> cases(4096);
    for (Case& c : cases) {
        for (float Case::*value :
             {&Case::metallic, &Case::roughness, &Case::r0, &Case::specular, &Case::coat, &Case::coat_roughness,
              &Case::transmission, &Case::base_color, &Case::specular_color, &Case::sheen, &Case::sheen_roughness,
              &Case::anisotropy, &Case::film, &Case::through, &Case::through_color})
            c.*value = extreme();
        c.cosine = std::max(extreme(), 1e-7f);
        c.tilt = 3 * uniform() - 1.5f, c.turn = 7 * uniform();
        c.film_ior = std::array{1.0f, 1 + uniform(), 20.0f}[random() % 3];
        c.film_thickness = std::array{0.0f, 1e-3f, 3000 * uniform(), 1e6f, 3e38f}[random() % 5];
    }
    expect_finite(cases);
}

TEST_F(ShadingBsdf, SamplesFollowTheirDensity) {
    const Case metal{.metallic = 1, .roughness = 0.3f, .cosine = 0.9f}, glass{.transmission = 0.5f, .cosine = 0.3f};
    const Case coated{.metallic = 0.2f, .roughness = 0.8f, .coat = 0.9f, .coat_roughness = 0.35f, .transmission = 0.5f};
    const auto with = [](Case c, const auto& change) {
        change(c);
        return c;
    };
    expect_densities({
        metal,
        with(metal, [](Case& c) { c.roughness = 0.5f, c.cosine = 0.15f; }),
        with(metal, [](Case& c) { c.roughness = 1, c.cosine = 0.5f; }),
        with(metal, [](Case& c) { c.cosine = 0.6f, c.anisotropy = 0.7f, c.turn = 0.4f; }),
        with(glass, [](Case& c) { c.roughness = 0.6f, c.transmission = 0.8f, c.cosine = 0.6f; }),
        with(glass, [](Case& c) { c.tilt = -0.9f; }),
        with(glass, [](Case& c) { c.tilt = 0.6f, c.through = 0.7f; }),
        with(coated, [](Case& c) { c.cosine = 0.4f; }),
        with(coated, [](Case& c) { c.cosine = 0.4f, c.tilt = 0.5f; }),
        with(coated, [](Case& c) { c.cosine = c.tilt = 0.4f, c.sheen = 0.8f, c.sheen_roughness = 0.5f; }),
        with(coated, [](Case& c) { c.cosine = 0.3f, c.tilt = 0.4f, c.anisotropy = 0.5f, c.turn = 2; }),
        {.specular = 0, .cosine = 0.2f, .sheen = 1, .sheen_roughness = 0.3f},
        {.cosine = 0.5f, .through = 0.3f, .through_color = 0.8f},
    });
}

// Some lobes are too sharp for bins. Their mapping from the unit square to directions has the Jacobian 1 / pdf.
TEST_F(ShadingBsdf, DensityIsTheSamplersJacobianDownToTheMirror) {
    std::vector<Case> cases;
    for (const float alpha : {1.5e-4f, 1e-3f, 1e-2f, 0.1f, 1.0f}) {
        for (const float cosine : {0.05f, 0.5f, 0.99f}) {
            cases.push_back({.metallic = 1, .roughness = std::sqrt(alpha), .cosine = cosine});
            // The differences are too coarse for grazing lobes of very different roughnesses.
            if (cosine < 0.1f) continue;
            cases.push_back({.metallic = 1, .roughness = std::sqrt(alpha), .cosine = cosine});
            cases.back().anisotropy = std::min(2 * std::sqrt(alpha), 1.0f), cases.back().turn = 5 * cosine;
        }
    }
    constexpr std::uint32_t kPoints = 256;
    const auto ratios = run(R"(
        uint c = i / 256u;
        Bsdf b = bsdf_of(c);
        vec3 wo = wo_of(c);
        vec2 xi = 0.1 + 0.8 * vec2(random_at(i, 0u), random_at(i, 1u));
        const float d = 0.03;
        vec3 dx = sample_glossy(b, wo, xi + vec2(d, 0.0), 0.5).direction -
                  sample_glossy(b, wo, xi - vec2(d, 0.0), 0.5).direction;
        vec3 dy = sample_glossy(b, wo, xi + vec2(0.0, d), 0.5).direction -
                  sample_glossy(b, wo, xi - vec2(0.0, d), 0.5).direction;
        BsdfSample s = sample_glossy(b, wo, xi, 0.5);
        result[0] = vec4(length(cross(dx, dy)) / (4.0 * d * d) * s.pdf, dot(s.weight, s.weight), 0.0, 0.0);
    )",
                            cases, kPoints);
    for (std::size_t c = 0; c < cases.size(); ++c) {
        std::vector<double> of_case;
        for (std::size_t i = 0; i < kPoints; ++i) {
            const vec4& r = ratios[c * kPoints + i];
            if (r.y > 0) of_case.push_back(r.x);
        }
        ASSERT_GT(of_case.size(), kPoints / 4) << cases[c].describe();
        EXPECT_NEAR(median(of_case), 1, 0.02) << cases[c].describe();
    }
}

TEST_F(ShadingBsdf, BentNormalsReflectAboveTheHorizon) {
    std::mt19937 random(7);
    std::normal_distribution<double> normal;
    const auto direction = [&] { return normalize(dvec3(normal(random), normal(random), normal(random))); };
    std::vector<vec4> inputs;
    for (int i = 0; i < 10000; ++i) {
        const dvec3 horizon = direction();
        dvec3 wo = direction(), n = direction();
        if (i % 8 == 1) n = -horizon;
        if (i % 8 == 2) n = wo;
        if (i % 8 == 3) n = -wo;
        if (i % 8 == 4) n = horizon;
        if (i % 8 == 5) n = normalize(horizon + 0.1 * n);
        if (i % 8 >= 6) wo = normalize(wo - dot(wo, horizon) * horizon + (i % 8 == 6 ? 1e-3 : 0.0) * horizon);
        if (dot(horizon, wo) < 0) wo -= 2 * dot(horizon, wo) * horizon;
        inputs.insert(inputs.end(), {vec4(horizon, 0), vec4(n, 0), vec4(wo, 0)});
    }
    const auto found = scene.run(kBsdfLibrary, R"(
        vec3 horizon = inputs[3u * i].xyz;
        vec3 wo = inputs[3u * i + 2u].xyz;
        vec3 n = bend_normal(inputs[3u * i + 1u].xyz, wo);
        vec3 bent = reflecting_normal(n, horizon, wo);
        float least = min(0.9 * dot(horizon, wo), 0.01);
        result[0] = vec4(dot(reflect(-wo, n), horizon), dot(reflect(-wo, bent), horizon), least, dot(bent, wo));
        result[1] = vec4(bent - n, length(bent));
    )",
                                 static_cast<std::uint32_t>(inputs.size() / 3), 2, inputs);
    int bent = 0, kept = 0;
    for (std::size_t i = 0; 2 * i < found.size(); ++i) {
        const vec4& heights = found[2 * i];
        const vec4& change = found[2 * i + 1];
        EXPECT_NEAR(change.w, 1, 1e-5) << i;
        EXPECT_GE(heights.w, -1e-7) << i;
        EXPECT_GE(heights.y, heights.z - 5e-4) << i;
        if (heights.x > heights.z + 1e-5) {
            EXPECT_EQ(vec3(change), vec3(0)) << i;
            ++kept;
        } else {
            ++bent;
        }
    }
    EXPECT_GT(std::min(bent, kept), 1250);
}

}  // namespace
}  // namespace halflight
