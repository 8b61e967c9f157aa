// Tests that samples of the BSDF follow its density.
#include <algorithm>
#include <cmath>

#include "engine/core/statistics.h"
#include "tests/pass/light/density_check.h"
#include "tests/pass/light/shading_bsdf.h"

namespace halflight {
namespace {

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
    for (const Case& c : cases) {
        const auto kernel = [&](const std::string& body, std::uint32_t count) { return run(body, {c}, count); };
        expect_density(kernel, "sample_diffuse", "pdf_diffuse", describe(c));
        expect_density(kernel, "sample_glossy", "pdf_glossy", describe(c));
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
                            cases, kPoints);
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

}  // namespace
}  // namespace halflight
