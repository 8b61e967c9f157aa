// Tests the BSDF: energy, reciprocity, extremes.
#include <array>
#include <cmath>
#include <random>

#include "tests/pass/light/shading_bsdf.h"

namespace halflight {
namespace {

TEST_F(ShadingBsdf, WhiteFurnace) {
    std::vector<Case> cases;
    for (const float cosine : {0.02f, 0.1f, 0.4f, 0.8f, 1.0f}) {
        for (const float roughness : {0.0f, 0.011f, 0.05f, 0.2f, 0.35f, 0.5f, 0.7f, 0.85f, 1.0f}) {
            cases.push_back({.metallic = 1, .roughness = roughness, .cosine = cosine});
            for (const float r0 : {0.0f, 0.04f, 0.2f}) {
                cases.push_back({.roughness = roughness, .r0 = r0, .cosine = cosine});
            }
            cases.push_back({.metallic = 0.4f, .roughness = roughness, .specular = 0.5f, .cosine = cosine});
            cases.push_back({.roughness = roughness, .transmission = 1, .cosine = cosine});
            cases.push_back({.metallic = 0.3f, .roughness = roughness, .transmission = 0.6f, .cosine = cosine});
            for (const float coat_roughness : {0.0f, 0.3f, 0.9f}) {
                cases.push_back({.metallic = 0.5f,
                                 .roughness = roughness,
                                 .coat = 0.8f,
                                 .coat_roughness = coat_roughness,
                                 .transmission = 0.5f,
                                 .cosine = cosine});
            }
            for (const float through : {0.3f, 1.0f}) {
                cases.push_back({.roughness = roughness, .cosine = cosine, .through = through});
                cases.push_back({.metallic = 0.5f,
                                 .roughness = roughness,
                                 .coat = 0.5f,
                                 .coat_roughness = 0.3f,
                                 .transmission = 0.4f,
                                 .cosine = cosine,
                                 .through = through});
            }
            // The sheen takes its roughness from the loop, from below its least one up to 1.
            cases.push_back({.metallic = 0.5f, .cosine = cosine, .sheen = 1, .sheen_roughness = roughness});
            cases.push_back({.roughness = 0.3f,
                             .coat = 0.7f,
                             .coat_roughness = 0.2f,
                             .transmission = 0.4f,
                             .cosine = cosine,
                             .sheen = 0.8f,
                             .sheen_roughness = roughness});
            for (const float turn : {0.0f, 0.9f, 2.5f}) {  // wo is 0.93 from the x axis
                cases.push_back(
                    {.metallic = 1, .roughness = roughness, .cosine = cosine, .anisotropy = 0.4f, .turn = turn});
                cases.push_back({.metallic = 0.5f,
                                 .roughness = roughness,
                                 .transmission = 0.5f,
                                 .cosine = cosine,
                                 .anisotropy = 0.9f,
                                 .turn = turn});
            }
        }
    }
    const std::vector<vec4> albedo = albedos(cases, 16384);
    double worst = 0, worst_anisotropic = 0;
    for (std::size_t c = 0; c < cases.size(); ++c) {
        EXPECT_EQ(albedo[c].w, 0) << describe(cases[c]);
        // The table of anisotropic lobes is coarser.
        const bool anisotropic = cases[c].anisotropy > 0;
        EXPECT_NEAR(albedo[c].x, 1, anisotropic ? 5e-3 : 1e-3) << describe(cases[c]);
        double& kind = anisotropic ? worst_anisotropic : worst;
        kind = std::max(kind, std::abs(albedo[c].x - 1.0));
    }
    RecordProperty("worst", fmt::format("{}", worst));
    RecordProperty("worst_anisotropic", fmt::format("{}", worst_anisotropic));
}

TEST_F(ShadingBsdf, IridescenceStaysWithinEnergy) {
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
    const std::vector<vec4> found = albedos(cases, 4096);
    double most = 0;
    for (std::size_t i = 0; i < cases.size(); ++i) {
        const float largest = std::max({found[i].x, found[i].y, found[i].z});
        EXPECT_LT(largest, 1.03f) << describe(cases[i]);
        EXPECT_GE(std::min({found[i].x, found[i].y, found[i].z}), 0) << describe(cases[i]);
        if (cases[i].film_thickness == 0 || cases[i].film_ior == 1) {
            EXPECT_NEAR(largest, 1, 3e-3) << describe(cases[i]);
        }
        most = std::max<double>(most, largest);
    }
    std::printf("  largest albedo: %.5f\n", most);
}

TEST_F(ShadingBsdf, FilmsWithoutThicknessOrFactorChangeNothing) {
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
    const std::vector<vec4> expected = albedos(without, 4096), found = albedos(thin, 4096), zero = albedos(off, 4096);
    for (std::size_t i = 0; i < without.size(); ++i) {
        // The compensation for multiple scattering uses the mean reflectance instead of that at normal incidence.
        EXPECT_NEAR(found[i].x, expected[i].x, 0.02) << describe(without[i]);
        EXPECT_EQ(zero[i], expected[i]) << describe(without[i]);
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
            cases.push_back({.roughness = roughness,
                             .r0 = 0.1f,
                             .specular = 0.7f,
                             .cosine = cosine,
                             .base_color = 0,
                             .specular_color = 0.5f});
            expected.push_back(gain(0.035) * (0.035 * a + 0.7 * b));
            const float turn = 0.5f, strength = 0.6f;
            const double alpha_b = double(roughness) * roughness, alpha_t = glm::mix(alpha_b, 1.0, 0.36);
            const double sine = std::sqrt(1 - double(cosine) * cosine), azimuth = std::atan2(0.8, 0.6) - turn;
            const DirectionalAlbedo e =
                ggx_albedo(dvec3(sine * std::cos(azimuth), sine * std::sin(azimuth), cosine), dvec2(alpha_t, alpha_b));
            cases.push_back({.metallic = 1,
                             .roughness = roughness,
                             .cosine = cosine,
                             .base_color = 0.3f,
                             .anisotropy = strength,
                             .turn = turn});
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
        EXPECT_NEAR(albedo[i].x, expected[i], cases[i].anisotropy > 0 ? 3e-3 : 1e-3) << describe(cases[i]);
}

TEST_F(ShadingBsdf, SheenIsReciprocal) {
    // All above the cosine from which albedo scaling sets in at this roughness.
    const std::vector<Case> cases = {
        {.roughness = 0, .specular = 0, .cosine = 0.3f, .base_color = 0, .sheen = 1, .sheen_roughness = 0.3f},
        {.roughness = 0, .specular = 0, .cosine = 0.9f, .base_color = 0, .sheen = 1, .sheen_roughness = 0.8f}};
    const auto found = run(R"(
        uint c = i / 64u;
        vec3 wo = wo_of(c);
        vec2 xi = vec2(random_at(i, 0u), 0.2 + 0.8 * random_at(i, 1u));
        vec3 wi = sphere_direction(xi.y, xi.x);
        Bsdf b = bsdf_of(c);
        float there = sheen_scattered(b.normal, b.sheen_alpha, wo, wi) / wi.z;
        float back = sheen_scattered(b.normal, b.sheen_alpha, wi, wo) / wo.z;
        result[0] = vec4(there, back, evaluate_bsdf(b, wo, wi).glossy.x / wi.z, 0.0);
    )",
                           cases, 64);
    for (const vec4& f : found) {
        EXPECT_NEAR(f.x, f.y, 1e-5 * f.x);
        EXPECT_NEAR(f.z, f.x, 1e-5 * f.x) << "the whole lobe";
        EXPECT_GT(f.x, 0);
    }
}

TEST_F(ShadingBsdf, AnisotropicLobesAreReciprocal) {
    // The compensation depends on wo alone, so the lobe without it is compared.
    const std::vector<Case> cases = {
        {.metallic = 1, .roughness = 0.5f, .cosine = 0.4f, .anisotropy = 0.6f, .turn = 0.3f},
        {.metallic = 1, .roughness = 0.8f, .cosine = 0.9f, .anisotropy = 1, .turn = 2}};
    const auto found = run(R"(
        uint c = i / 64u;
        vec3 wo = wo_of(c);
        vec3 wi = sphere_direction(0.1 + 0.9 * random_at(i, 1u), random_at(i, 0u));
        Bsdf b = bsdf_of(c);
        mat3 basis = lobe_basis(b.normal, b.rough_direction);
        vec2 alpha = vec2(b.alpha, b.alpha_across);
        GgxValue there = ggx_evaluate(basis, alpha, wo, wi);
        vec3 factor = b.specular + b.specular_edge * there.schlick;
        result[0] = vec4(there.scattered / wi.z, ggx_evaluate(basis, alpha, wi, wo).scattered / wo.z,
                         evaluate_bsdf(b, wo, wi).glossy.x / factor.x / wi.z, alpha.x - alpha.y);
    )",
                           cases, 64);
    for (const vec4& f : found) {
        EXPECT_NEAR(f.x, f.y, 2e-5 * f.x);
        EXPECT_NEAR(f.z, f.x, 1e-4 * f.x) << "the whole lobe";
        EXPECT_GT(f.x, 0);
        EXPECT_GT(f.w, 0.2f);
    }
}

TEST_F(ShadingBsdf, EverythingStaysFiniteAndNonNegative) {
    std::mt19937 random(1);
    const auto uniform = [&] { return static_cast<float>(random() >> 8) * 0x1p-24f; };
    const auto extreme = [&] {
        return std::array{0.0f, 1.0f, uniform(), std::pow(10.0f, -6 * uniform())}[random() % 4];
    };
    std::vector<Case> cases(4096);
    for (Case& c : cases) {
        c = {extreme(),
             extreme(),
             extreme(),
             extreme(),
             extreme(),
             extreme(),
             extreme(),
             std::max(extreme(), 1e-7f),
             extreme(),
             extreme(),
             3 * uniform() - 1.5f,
             extreme(),
             extreme(),
             extreme(),
             7 * uniform(),
             extreme(),
             std::array{1.0f, 1 + uniform(), 20.0f}[random() % 3],
             std::array{0.0f, 1e-3f, 3000 * uniform(), 1e6f, 3e38f}[random() % 5],
             extreme(),
             extreme()};
    }
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
            worst = max(worst, max(g.weight.x, d.weight.x));
            bool is_dark = v.diffuse + v.glossy == vec3(0.0);
            float side_g = dot(wi, b.geometric_normal);
            bool between = side_g * dot(wi, b.normal) <= 0.0 && side_g * dot(wi, base_normal(b, wo)) <= 0.0;
            bad += between && !is_dark && b.coat == 0.0 ? 1.0 : 0.0;
        }
        result[0] = vec4(bad, worst, b.p_diffuse, b.p_coat + b.p_transmission + b.p_sheen);
    )",
                           cases);
    for (std::size_t i = 0; i < cases.size(); ++i) {
        EXPECT_EQ(found[i].x, 0) << describe(cases[i]);
        EXPECT_LT(found[i].y, 100) << describe(cases[i]);
        EXPECT_TRUE(found[i].z >= 0 && found[i].z <= 1 && found[i].w >= 0 && found[i].w <= 1.000001f)
            << describe(cases[i]);
    }
}

TEST_F(ShadingBsdf, BentNormalsReflectAboveTheHorizon) {
    std::mt19937 random(7);
    std::normal_distribution<double> normal;
    const auto direction = [&] { return normalize(dvec3(normal(random), normal(random), normal(random))); };
    std::vector<vec4> inputs;
    for (int i = 0; i < 40000; ++i) {
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
    EXPECT_GT(std::min(bent, kept), 5000);
}

}  // namespace
}  // namespace halflight
