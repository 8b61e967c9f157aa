// Tests that every variant of shaders/lib that shader_defines() can select compiles.
#include <gtest/gtest.h>

#include "tests/pass/light/shading_kernel.h"
#include "tests/support/gpu_test.h"

namespace halflight {
namespace {

const char* const kEverything = R"(
#include "shaders/geometry_tables.glsl"
#include "shaders/scene_tables.glsl"
layout(local_size_x = 64) in;
layout(std430) writeonly buffer Results { vec4 results[]; };
#include "shaders/lib/material.glsl"
#include "shaders/lib/bsdf.glsl"
#include "shaders/lib/lights.glsl"
void main() {
    uint i = gl_GlobalInvocationID.x;
    Sampler random = make_sampler(i, 0u, 0u, 0u);
    Hit hit = Hit(1.0, 0.3, 0.3, i, i);
    vec3 wo = vec3(0.0, 0.0, 1.0);
    Surface s = surface_at(hit, -wo);
    Material m = evaluate_material(s, wo);
    Bsdf b = make_bsdf(m, s.geometric_normal, wo);
    Receiver at = receiver_at(s.position, s.geometric_normal);
    LightSample l = sample_light(at, sample_2d_bits(random, 1u));
    if (HALFLIGHT_EVERY_LIGHT != 0) l = sample_of_light(at, i % light_count(), sample_2d(random, 1u), 1.0, 0.0);
    BsdfValue v = evaluate_bsdf(b, wo, l.direction);
    BsdfSample d = sample_diffuse(b, wo, sample_2d(random, 2u), sample_1d(random, 5u));
    BsdfSample g = sample_glossy(b, wo, sample_2d(random, 3u), sample_1d(random, 4u));
    Ray ray = shadow_ray(s.position, s.offset, s.geometric_normal, l);
    vec3 sum = m.emission + v.diffuse * v.pdf_diffuse + v.glossy * v.pdf_glossy + d.weight + g.weight + ray.direction +
               environment_radiance(d.direction) * environment_pdf(at, g.direction);
    results[i] = vec4(sum, light_pdf(at, hit, wo, 1.0, s.geometric_normal) +
                               (alpha_accept(i, i, i, 0.3, 0.3, Sampler(i, 1u)) ? 1.0 : 0.0));
}
)";

class ShadingVariants : public GpuTest {};

TEST_F(ShadingVariants, Compile) {
    SceneNeeds all = kept_needs(Kept::everything()), sky = all, tree = all, every = all;
    sky.environment_map = tree.environment_map = every.environment_map = true;
    tree.light_tree = every.every_light = true;
    std::vector<SceneNeeds> variants = {SceneNeeds(), all, sky, tree, every};
    for (const SceneNeed& need : known_scene_needs()) {
        SceneNeeds one;
        one.*need.flag = true;
        one.punctual_lights = one.punctual_lights || one.every_light;  // only scenes with lights need every_light
        variants.push_back(united(one, {}));
    }
    for (const bool map : {false, true}) {
        SceneNeeds lobes;
        lobes.glossy = lobes.clearcoat = lobes.transmission = lobes.environment = true;
        lobes.environment_map = map;
        variants.push_back(lobes);
    }
    for (const SceneNeeds& needs : variants) {
        gpu::Defines defines;
        std::string text;
        for (const auto& [name, value] : shader_defines(needs)) {
            defines.set(name, value);
            text += " " + name;
        }
        EXPECT_NO_THROW(gpu::Program::compute({"shading variant", kEverything}, defines)) << text;
    }
}

}  // namespace
}  // namespace halflight
