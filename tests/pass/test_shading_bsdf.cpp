// The BSDF of shaders/lib/bsdf.glsl: energy, densities, sampling, extremes.
#include <gtest/gtest.h>

#include <fmt/format.h>
#include <cmath>
#include <random>

#include "engine/core/statistics.h"
#include "tests/pass/shading_kernel.h"
#include "tests/support/gpu_test.h"

namespace halflight {
namespace {

/// Two rows of input: metallic, roughness, ior term, specular; coat, coat roughness, transmission, cosine of wo.
struct Case {
    float metallic = 0, roughness = 0.5f, r0 = 0.04f, specular = 1;
    float coat = 0, coat_roughness = 0, transmission = 0, cosine = 0.7f;
};

/// Everything that a BSDF can have is compiled in.
Scene full_scene() {
    Material m;
    m.metallic = 0.5f;
    m.clearcoat = 1;
    m.transmission = 0.5f;
    m.specular_color = vec3(0.5f);
    return triangle_scene(m);
}

const char* const kLibrary = R"(
#include "shaders/lib/bsdf.glsl"
#include "shaders/lib/sobol.glsl"
vec3 wo_of(uint c) {
    float cosine = inputs[2u * c + 1u].w;
    return vec3(sqrt((1.0 - cosine) * (1.0 + cosine)) * vec2(0.6, 0.8), cosine);
}
Bsdf bsdf_of(uint c) {
    vec4 a = inputs[2u * c];
    vec4 b = inputs[2u * c + 1u];
    Material m;
    m.base_color = vec3(1.0);
    m.metallic = a.x;
    m.emission = vec3(0.0);
    m.roughness = a.y;
    m.normal = vec3(0.0, 0.0, 1.0);
    m.specular = a.w;
    m.specular_color = vec3(1.0);
    m.dielectric_f0 = a.z;
    m.coat_normal = vec3(0.0, 0.0, 1.0);
    m.coat = b.x;
    m.coat_roughness = b.y;
    m.transmission = b.z;
    return make_bsdf(m, vec3(0.0, 0.0, 1.0), wo_of(c));
}
)";

std::vector<vec4> rows_of(const std::vector<Case>& cases) {
    std::vector<vec4> rows;
    for (const Case& c : cases) {
        rows.emplace_back(c.metallic, c.roughness, c.r0, c.specular);
        rows.emplace_back(c.coat, c.coat_roughness, c.transmission, c.cosine);
    }
    return rows;
}

std::string describe(const Case& c) {
    return fmt::format("metallic {} roughness {} r0 {} specular {} coat {} coat roughness {} transmission {} cosine {}",
                       c.metallic, c.roughness, c.r0, c.specular, c.coat, c.coat_roughness, c.transmission, c.cosine);
}

class ShadingBsdf : public GpuTest {
  protected:
    ShadingScene scene{full_scene()};
    /// Declarations of inputs[] come after the library, which refers to them.
    std::vector<vec4> run(const std::string& body, std::uint32_t count, std::uint32_t rows,
                          const std::vector<Case>& cases) const {
        return scene.run(kLibrary, body, count, rows, rows_of(cases));
    }
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
        }
    }
    const auto albedo = run(R"(
        Bsdf b = bsdf_of(i);
        vec3 wo = wo_of(i);
        vec3 sum = vec3(0.0);
        float bad = 0.0;
        float rest = 1.0 - b.p_coat - b.p_transmission;
        for (uint n = 0u; n < 16384u; ++n) {
            Sampler s = make_sampler(i, 0u, n, 7u);
            vec2 xi = sample_2d(s, 0u);
            // Every lobe, times its probability.
            BsdfSample d = sample_diffuse(b, wo, xi);
            BsdfSample coat = sample_glossy(b, wo, xi, 0.5 * b.p_coat);
            BsdfSample through = sample_glossy(b, wo, xi, b.p_coat + 0.5 * b.p_transmission);
            BsdfSample specular = sample_glossy(b, wo, xi, b.p_coat + b.p_transmission + 0.5 * rest);
            sum += d.weight + b.p_coat * coat.weight + b.p_transmission * through.weight + rest * specular.weight;
            bad += abs(length(specular.direction) - 1.0) > 1e-6 ? 1.0 : 0.0;
        }
        result[0] = vec4(sum / 16384.0, bad);
    )",
                            static_cast<std::uint32_t>(cases.size()), 1, cases);
    double worst = 0;
    for (std::size_t c = 0; c < cases.size(); ++c) {
        EXPECT_EQ(albedo[c].w, 0) << describe(cases[c]);
        EXPECT_NEAR(albedo[c].x, 1, 1e-3) << describe(cases[c]);
        worst = std::max(worst, std::abs(albedo[c].x - 1.0));
    }
    RecordProperty("worst", fmt::format("{}", worst));
}

}  // namespace
}  // namespace halflight
