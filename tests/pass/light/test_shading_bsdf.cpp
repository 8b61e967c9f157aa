// Tests the BSDF of shaders/lib/bsdf.glsl: energy, densities, sampling, extremes.
#include <gtest/gtest.h>

#include <fmt/format.h>
#include <cmath>
#include <random>

#include "engine/core/statistics.h"
#include "tests/pass/light/shading_kernel.h"
#include "tests/support/gpu_test.h"

namespace halflight {
namespace {

/// A material and a pair of directions as six rows of input.
struct Case {
    float metallic = 0, roughness = 0.5f, r0 = 0.04f, specular = 1;
    float coat = 0, coat_roughness = 0, transmission = 0, cosine = 0.7f;
    float base_color = 1, specular_color = 1, tilt = 0;  // radians between n_g (+z) and n, towards wo if > 0
    float sheen = 0, sheen_roughness = 0;
    float anisotropy = 0, turn = 0;  // strength; radians from the x axis of the basis around n
    float film = 0, film_ior = 1.3f, film_thickness = 400;
    float through = 0, through_color = 1;  // diffuse transmission
};

/// Returns a scene with all lobes, so that all code is compiled.
Scene full_scene() {
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

const char* const kLibrary = R"(
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

std::vector<vec4> rows_of(const std::vector<Case>& cases) {
    std::vector<vec4> rows;
    for (const Case& c : cases) {
        rows.emplace_back(c.metallic, c.roughness, c.r0, c.specular);
        rows.emplace_back(c.coat, c.coat_roughness, c.transmission, c.cosine);
        rows.emplace_back(c.base_color, c.specular_color, c.tilt, 0);
        rows.emplace_back(c.sheen, c.sheen_roughness, c.anisotropy, c.turn);
        rows.emplace_back(c.film, c.film_ior, c.film_thickness, 0);
        rows.emplace_back(c.through, c.through_color, 0, 0);
    }
    return rows;
}

std::string describe(const Case& c) {
    return fmt::format(
        "metallic {} roughness {} r0 {} specular {} coat {} coat roughness {} transmission {} cosine {} tilt {} "
        "sheen {} sheen roughness {} anisotropy {} turn {} film {} ior {} thickness {} through {}, {}",
        c.metallic, c.roughness, c.r0, c.specular, c.coat, c.coat_roughness, c.transmission, c.cosine, c.tilt, c.sheen,
        c.sheen_roughness, c.anisotropy, c.turn, c.film, c.film_ior, c.film_thickness, c.through, c.through_color);
}

class ShadingBsdf : public GpuTest {
  protected:
    ShadingScene scene{full_scene()};
    std::vector<vec4> run(const std::string& body, std::uint32_t count, std::uint32_t rows,
                          const std::vector<Case>& cases) const {
        return scene.run(kLibrary, body, count, rows, rows_of(cases));
    }
    std::vector<vec4> albedos(const std::vector<Case>& cases) const;
};

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
    const auto albedo = run(R"(
        Bsdf b = bsdf_of(i);
        vec3 wo = wo_of(i);
        vec3 sum = vec3(0.0);
        float bad = 0.0;
        float rest = 1.0 - b.p_coat - b.p_transmission - b.p_sheen;
        for (uint n = 0u; n < 16384u; ++n) {
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
        result[0] = vec4(sum / 16384.0, bad);
    )",
                            static_cast<std::uint32_t>(cases.size()), 1, cases);
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

/// Returns the directional albedo of each case.
std::vector<vec4> ShadingBsdf::albedos(const std::vector<Case>& cases) const {
    return run(R"(
        Bsdf b = bsdf_of(i);
        vec3 wo = wo_of(i);
        vec3 sum = vec3(0.0);
        float rest = 1.0 - b.p_coat - b.p_transmission - b.p_sheen;
        for (uint n = 0u; n < 4096u; ++n) {
            vec2 xi = sample_2d(make_sampler(i, 0u, n, 7u), 0u);
            sum += sample_diffuse(b, wo, xi, random_at(n, 2u)).weight + b.p_coat * sample_glossy(b, wo, xi, 0.5 * b.p_coat).weight +
                   b.p_transmission * sample_glossy(b, wo, xi, b.p_coat + 0.5 * b.p_transmission).weight +
                   rest * sample_glossy(b, wo, xi, b.p_coat + b.p_transmission + b.p_sheen + 0.5 * rest).weight;
        }
        result[0] = vec4(sum / 4096.0, 0.0);
    )",
               static_cast<std::uint32_t>(cases.size()), 1, cases);
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
    const std::vector<vec4> found = albedos(cases);
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
    const std::vector<vec4> expected = albedos(without), found = albedos(thin), zero = albedos(off);
    for (std::size_t i = 0; i < without.size(); ++i) {
        // The compensation for multiple scattering uses the mean reflectance instead of that at normal incidence.
        EXPECT_NEAR(found[i].x, expected[i].x, 0.02) << describe(without[i]);
        EXPECT_EQ(zero[i], expected[i]) << describe(without[i]);
    }
}

/// Returns the upper tail probability of chi-square by a normal approximation of its cube root (Wilson, Hilferty 1931).
double chi_square_tail(double value, double degrees) {
    const double s = 2 / (9 * degrees);
    const double z = (std::cbrt(value / degrees) - (1 - s)) / std::sqrt(s);
    return 0.5 * std::erfc(z / std::sqrt(2.0));
}

TEST_F(ShadingBsdf, SamplesFollowTheirDensity) {
    const std::vector<Case> cases = {
        {.metallic = 1, .roughness = 0.3f, .cosine = 0.9f},
        {.metallic = 1, .roughness = 0.5f, .cosine = 0.15f},
        {.metallic = 1, .roughness = 1, .cosine = 0.5f},
        {.roughness = 0.6f, .transmission = 0.8f, .cosine = 0.6f},
        {.metallic = 0.2f,
         .roughness = 0.8f,
         .coat = 0.9f,
         .coat_roughness = 0.35f,
         .transmission = 0.5f,
         .cosine = 0.4f},
        {.metallic = 0.2f,
         .roughness = 0.8f,
         .coat = 0.9f,
         .coat_roughness = 0.35f,
         .transmission = 0.5f,
         .cosine = 0.4f,
         .tilt = 0.5f},
        {.roughness = 0.5f, .transmission = 0.5f, .cosine = 0.3f, .tilt = -0.9f},
        {.roughness = 0.5f, .specular = 0, .cosine = 0.2f, .sheen = 1, .sheen_roughness = 0.3f},
        {.metallic = 0.3f,
         .roughness = 0.4f,
         .coat = 0.5f,
         .coat_roughness = 0.4f,
         .transmission = 0.5f,
         .cosine = 0.4f,
         .tilt = 0.4f,
         .sheen = 0.8f,
         .sheen_roughness = 0.5f},
        {.metallic = 1, .roughness = 0.3f, .cosine = 0.6f, .anisotropy = 0.7f, .turn = 0.4f},
        {.metallic = 0.3f,
         .roughness = 0.5f,
         .coat = 0.5f,
         .coat_roughness = 0.4f,
         .transmission = 0.6f,
         .cosine = 0.3f,
         .tilt = 0.4f,
         .anisotropy = 0.5f,
         .turn = 2},
        {.roughness = 0.5f, .cosine = 0.5f, .through = 0.3f, .through_color = 0.8f},
        {.roughness = 0.5f, .transmission = 0.5f, .cosine = 0.3f, .tilt = 0.6f, .through = 0.7f},
    };
    constexpr std::uint32_t kSamples = 1u << 17;
    constexpr int kRows = 24, kColumns = 32, kSub = 16;  // rows and columns of bins; sub-steps per edge of a bin
    for (std::size_t c = 0; c < cases.size(); ++c) {
        for (const bool glossy : {false, true}) {
            const std::vector<Case> one = {cases[c]};
            const auto samples = run(std::string(R"(
                Bsdf b = bsdf_of(0u);
                vec2 xi = vec2(random_at(i, 0u), random_at(i, 1u));
                BsdfSample s = )") +
                                         (glossy ? "sample_glossy(b, wo_of(0u), xi, random_at(i, 2u))"
                                                 : "sample_diffuse(b, wo_of(0u), xi, random_at(i, 2u))") +
                                         R"(;
                result[0] = vec4(s.direction, s.pdf);
            )",
                                     kSamples, 1, one);
            const auto densities = run(R"(
                uint x = i % 512u;
                uint y = i / 512u;
                float z = -1.0 + 2.0 * (float(y) + 0.5) / 384.0;
                float phi = 6.28318530718 * (float(x) + 0.5) / 512.0;
                vec3 wi = vec3(sqrt(1.0 - z * z) * vec2(cos(phi), sin(phi)), z);
                BsdfValue v = evaluate_bsdf(bsdf_of(0u), wo_of(0u), wi);
                result[0] = vec4(v.pdf_diffuse, v.pdf_glossy, 0.0, 0.0);
            )",
                                       kRows * kSub * kColumns * kSub, 1, one);

            std::vector<double> expected(kRows * kColumns, 0), found(kRows * kColumns, 0);
            for (int y = 0; y < kRows * kSub; ++y) {
                for (int x = 0; x < kColumns * kSub; ++x) {
                    const vec4& d = densities[static_cast<std::size_t>(y * kColumns * kSub + x)];
                    expected[static_cast<std::size_t>(y / kSub * kColumns + x / kSub)] +=
                        (glossy ? d.y : d.x) * 4 * kPi / (kRows * kSub * kColumns * kSub) * kSamples;
                }
            }
            double lost = 0, lost_expected = kSamples;
            for (const vec4& s : samples) {
                if (s.w <= 0) {
                    ++lost;
                    continue;
                }
                const int y = std::clamp(static_cast<int>((s.z + 1) / 2 * kRows), 0, kRows - 1);
                const double turn = std::atan2(s.y, s.x) / (2 * kPi);
                const int x = std::clamp(static_cast<int>((turn < 0 ? turn + 1 : turn) * kColumns), 0, kColumns - 1);
                ++found[static_cast<std::size_t>(y * kColumns + x)];
            }
            // Too few points integrate the bins at the lobe's edge, so these are pooled with their neighbours. The rest
            // of the unit mass belongs to directions that the side rules or the horizon reject.
            double chi_square = 0, degrees = 0, pooled_expected = 0, pooled_found = 0;
            for (std::size_t i = 0; i < expected.size(); ++i) {
                lost_expected -= expected[i];
                pooled_expected += expected[i];
                pooled_found += found[i];
                if (pooled_expected < 100) continue;
                chi_square += (pooled_found - pooled_expected) * (pooled_found - pooled_expected) / pooled_expected;
                ++degrees;
                pooled_expected = pooled_found = 0;
            }
            const std::string what = fmt::format("{}, {}", describe(cases[c]), glossy ? "glossy" : "diffuse");
            EXPECT_GT(chi_square_tail(chi_square, degrees), 1e-4) << what << ": " << chi_square << " of " << degrees;
            EXPECT_NEAR(lost, lost_expected, 5 * std::sqrt(std::max(lost, 100.0)) + 1e-3 * kSamples) << what;
        }
    }
}

// Some lobes are too sharp for bins. Their mapping from the unit square to directions has the Jacobian 1 / pdf.
TEST_F(ShadingBsdf, DensityIsTheSamplersJacobianDownToTheMirror) {
    std::vector<Case> cases;
    for (const float alpha : {1.5e-4f, 1e-3f, 1e-2f, 0.1f, 1.0f}) {
        for (const float cosine : {0.05f, 0.5f, 0.99f}) {
            cases.push_back({.metallic = 1, .roughness = std::sqrt(alpha), .cosine = cosine});
            // The differences are too coarse for grazing lobes of very different roughnesses.
            if (cosine < 0.1f) continue;
            cases.push_back({.metallic = 1,
                             .roughness = std::sqrt(alpha),
                             .cosine = cosine,
                             .anisotropy = std::min(2 * std::sqrt(alpha), 1.0f),
                             .turn = 5 * cosine});
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
                            static_cast<std::uint32_t>(cases.size()) * kPoints, 1, cases);
    for (std::size_t c = 0; c < cases.size(); ++c) {
        std::vector<double> of_case;
        for (std::size_t i = 0; i < kPoints; ++i) {
            const vec4& r = ratios[c * kPoints + i];
            if (r.y > 0) of_case.push_back(r.x);
        }
        ASSERT_GT(of_case.size(), kPoints / 4) << describe(cases[c]);
        EXPECT_NEAR(median(of_case), 1, 0.02) << describe(cases[c]);
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
                            static_cast<std::uint32_t>(cases.size()), 1, cases);
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
                           64 * static_cast<std::uint32_t>(cases.size()), 1, cases);
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
                           64 * static_cast<std::uint32_t>(cases.size()), 1, cases);
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
                           static_cast<std::uint32_t>(cases.size()), 1, cases);
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
    const auto found = scene.run(kLibrary, R"(
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
