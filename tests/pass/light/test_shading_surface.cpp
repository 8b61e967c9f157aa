// Tests geometry at hits, and rays that leave surfaces.
#include <gtest/gtest.h>

#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <random>

#include "tests/pass/light/shading_kernel.h"
#include "tests/support/gpu_test.h"

namespace halflight {
namespace {

class Random {
  public:
    explicit Random(unsigned seed) : engine_(seed) {}
    double unit() { return (static_cast<double>(engine_()) + 0.5) * 0x1p-32; }
    double within(double low, double high) { return low + (high - low) * unit(); }
    vec3 box(double extent) { return {within(-extent, extent), within(-extent, extent), within(-extent, extent)}; }
    vec3 direction() {
        vec3 v;
        do v = box(1);
        while (glm::dot(v, v) > 1 || glm::dot(v, v) < 0.01f);
        return glm::normalize(v);
    }

  private:
    std::mt19937 engine_;
};

Mesh random_mesh(Random& random, int triangles) {
    Mesh mesh;
    for (int i = 0; i < 3 * triangles; ++i) {
        mesh.positions.push_back(random.box(1));
        mesh.normals.push_back(random.direction());
        mesh.tangents.emplace_back(random.direction(), i / 3 % 2 == 0 ? 1.0f : -1.0f);
        mesh.uvs[0].emplace_back(random.unit(), random.unit());
        mesh.uvs[1].emplace_back(random.unit(), random.unit());
        mesh.colors.emplace_back(random.unit(), random.unit(), random.unit(), random.unit());
    }
    for (unsigned i = 0; i < 3u * static_cast<unsigned>(triangles); i += 3) {
        mesh.triangles.emplace_back(i, i + 1, i + 2);
        mesh.triangle_material.push_back(0);
    }
    return mesh;
}

dmat4 random_placement(Random& random, bool mirror) {
    dmat4 m = glm::translate(dmat4(1), dvec3(random.box(20)));
    m = glm::rotate(m, random.within(0, 6), dvec3(random.direction()));
    return glm::scale(m, dvec3(mirror ? -1 : 1, random.within(0.2, 4), random.within(0.5, 2)));
}

const char* const kHit = R"(
    Hit hit;
    hit.t = 1.0; hit.u = inputs[2u * i].x; hit.v = inputs[2u * i].y;
    hit.triangle = uint(inputs[2u * i].z); hit.instance = uint(inputs[2u * i].w);
    vec3 direction = inputs[2u * i + 1u].xyz;
)";

class ShadingSurface : public GpuTest {};

// Compares merged, shared, mirrored and scaled instances with the definitions in double.
TEST_F(ShadingSurface, GeometryOfHits) {
    Random random(1);
    Scene scene = triangle_scene({});
    scene.images = {{"n", 1, 1, {200, 40, 220, 255}}};
    scene.materials[0].normal_texture.image = 0;
    scene.materials[0].normal_scale = 0.7f;
    scene.meshes = {random_mesh(random, 8), random_mesh(random, 8), random_mesh(random, 8)};
    scene.instances.clear();
    for (const int mesh : {0, 1, 2, 2, 2}) {
        Instance instance;
        instance.mesh = mesh;
        instance.object_to_world = random_placement(random, scene.instances.size() % 2 == 1);
        scene.instances.push_back(instance);
    }
    const ShadingScene shading(scene);
    ASSERT_TRUE(shading.tables.needs.instances && shading.tables.needs.normal_maps);
    std::vector<vec4> inputs;
    std::vector<TriangleSource> sources;
    for (std::uint32_t instance = 0; instance < shading.trace.instances.size(); ++instance) {
        const Block& block = shading.trace.blocks[shading.trace.instances[instance].block];
        for (std::uint32_t t = block.first_triangle; t < block.first_triangle + block.triangle_count; ++t) {
            const double u = random.unit(), v = random.unit() * (1 - u);
            inputs.emplace_back(u, v, t, instance);
            inputs.emplace_back(random.direction() * 3.0f, 0);
            sources.push_back(source_of(shading.trace, instance, t));
        }
    }
    const auto count = static_cast<std::uint32_t>(sources.size());
    const auto found = shading.run("#include \"shaders/lib/material.glsl\"", std::string(kHit) + R"(
        Surface s = surface_at(hit, direction);
        result[0] = vec4(s.position, s.offset);
        result[1] = vec4(s.geometric_normal, 0.0);
        result[2] = vec4(s.normal, 0.0);
        result[3] = vec4(s.uv0, s.uv1);
        result[4] = s.color;
        vec3 wo = -normalize(direction);
        Material m = evaluate_material(s, wo);
        result[5] = vec4(m.normal, dot(m.normal, wo));
    )",
                                   count, 6, inputs);
    for (std::uint32_t i = 0; i < count; ++i) {
        const Instance& instance = scene.instances[sources[i].instance];
        const Mesh& mesh = scene.meshes[static_cast<std::size_t>(instance.mesh)];
        const uvec3 corner = mesh.triangles[sources[i].triangle];
        const dvec3 w(1.0 - inputs[2 * i].x - inputs[2 * i].y, inputs[2 * i].x, inputs[2 * i].y);
        const auto blend = [&](const auto& values) {
            return w.x * glm::vec<std::decay_t<decltype(values[0])>::length(), double>(values[corner.x]) +
                   w.y * glm::vec<std::decay_t<decltype(values[0])>::length(), double>(values[corner.y]) +
                   w.z * glm::vec<std::decay_t<decltype(values[0])>::length(), double>(values[corner.z]);
        };
        const dmat4& place = instance.object_to_world;
        const dmat3 linear(place);
        const vec4* r = &found[6 * i];
        const dvec3 wo = -glm::normalize(dvec3(inputs[2 * i + 1]));

        const dvec3 position = dvec3(place * dvec4(blend(mesh.positions), 1)) - shading.trace.origin;
        dvec3 face = glm::normalize(glm::cross(linear * dvec3(mesh.positions[corner.y] - mesh.positions[corner.x]),
                                               linear * dvec3(mesh.positions[corner.z] - mesh.positions[corner.x])));
        if (glm::dot(face, wo) < 0) face = -face;
        EXPECT_NEAR(glm::length(dvec3(r[0]) - position), 0, 2e-5) << i;
        EXPECT_LT(std::abs(glm::dot(dvec3(r[0]) - position, face)), r[0].w) << i;
        EXPECT_LT(r[0].w, 1e-4f) << i;
        EXPECT_NEAR(glm::length(dvec3(r[1]) - face), 0, 2e-5) << i;

        const dvec3 normal = glm::normalize(glm::transpose(glm::inverse(linear)) * blend(mesh.normals));
        const double side = glm::dot(normal, face) < 0 ? -1 : 1;
        EXPECT_NEAR(glm::length(dvec3(r[2]) - side * normal), 0, 5e-5) << i;
        EXPECT_NEAR(glm::length(dvec4(r[3]) - dvec4(blend(mesh.uvs[0]), blend(mesh.uvs[1]))), 0, 1e-6) << i;
        EXPECT_NEAR(glm::length(dvec4(r[4]) - blend(mesh.colors)), 0, 1e-6) << i;

        const dvec4 object_tangent = blend(mesh.tangents);
        const dvec3 tangent = glm::normalize(linear * dvec3(object_tangent));
        const dvec3 bitangent =
            glm::cross(normal, tangent) * object_tangent.w * (glm::determinant(linear) < 0 ? -1.0 : 1.0);
        const dvec3 texel = 2.0 * dvec3(200, 40, 220) / 255.0 - 1.0;
        dvec3 mapped = side * glm::normalize(0.7f * texel.x * tangent + 0.7f * texel.y * bitangent + texel.z * normal);
        const double seen = glm::dot(mapped, wo);
        if (std::abs(seen) < 1e-4) continue;  // rounding decides whether the normal is bent
        if (seen < 0) mapped = glm::normalize(mapped + wo * (1e-3 - seen));
        EXPECT_NEAR(glm::length(dvec3(r[5]) - mapped), 0, 2e-4) << i;
        EXPECT_GT(r[5].w, 0) << i;
    }
}

TEST_F(ShadingSurface, DegenerateAttributesGiveUnitNormals) {
    Scene scene = triangle_scene({});
    scene.images = {{"n", 1, 1, {0, 0, 0, 255}}};
    scene.materials[0].normal_texture.image = 0;
    scene.meshes[0].normals = {{0, 0, 1}, {0, 0, -1}, {0, 0, 1}};
    scene.meshes[0].tangents = {vec4(1, 0, 0, 1), vec4(-1, 0, 0, 1), vec4(1, 0, 0, 1)};
    const ShadingScene shading(scene);
    const auto found =
        shading.run("#include \"shaders/lib/material.glsl\"", std::string(kHit) + R"(
        Surface s = surface_at(hit, direction);
        Material m = evaluate_material(s, -normalize(direction));
        result[0] = vec4(s.normal, length(s.tangent.xyz));
        result[1] = vec4(m.normal, length(m.normal));
    )",
                    2, 2, {vec4(0.5f, 0.25f, 0, 0), vec4(0, 0, -1, 0), vec4(0.5f, 0.25f, 0, 0), vec4(1, 0, 1e-30f, 0)});
    EXPECT_EQ(found[0], vec4(0, 0, 1, 0));
    EXPECT_EQ(found[1], vec4(0, 0, 1, 1));
    EXPECT_EQ(found[2], vec4(0, 0, -1, 0));
    EXPECT_NEAR(found[3].w, 1, 1e-6);
    EXPECT_TRUE(all_finite(vec3(found[3])));
}

/// Returns whether floats near the triangle can represent its normal. The smallest height must be at least 100 units in
/// the last place, or two if normals are computed in double precision.
bool has_normal(const TraceTables& trace, std::uint32_t triangle) {
    const uvec4 corner = trace.triangles[triangle];
    const dvec3 a(trace.positions[corner.x]), b(trace.positions[corner.y]), c(trace.positions[corner.z]);
    const double longest = std::max({glm::length(b - a), glm::length(c - a), glm::length(c - b)});
    const dvec3 reach = glm::max(glm::max(glm::abs(a), glm::abs(b)), glm::abs(c));
    return glm::length(glm::cross(b - a, c - a)) / longest >
           (trace.slivers ? 2 : 100) * 0x1p-23 * std::max({reach.x, reach.y, reach.z});
}

// A ray that leaves a surface must never hit it, whatever the triangle's size, position and shape, and the ray's angle.
class ShadingSurfaceScales : public ShadingSurface,
                             public ::testing::WithParamInterface<std::tuple<int, bool, bool>> {};
INSTANTIATE_TEST_SUITE_P(Decades, ShadingSurfaceScales,
                         ::testing::Combine(::testing::Values(-6, -3, 0, 3, 6), ::testing::Bool(), ::testing::Bool()));

TEST_P(ShadingSurfaceScales, RaysThatLeaveMissTheirOrigin) {
    const auto [decade, instanced, slivers] = GetParam();
    Random random(7);
    Scene scene = triangle_scene({});
    scene.meshes.clear();
    scene.instances.clear();
    for (int m = 0; m < 24; ++m) {
        const double size = std::pow(10.0, decade + random.within(-0.5, 0.5));
        Mesh mesh;
        for (int i = 0; i < 16; ++i) {
            // The triangle is in a plane through the origin, a sliver of aspect ratio 10^3 to 10^7, far away, or
            // general.
            vec3 a, b, c;
            do {
                a = random.box(size), b = random.box(size), c = random.box(size);
                if (i % 4 == 0) a.y = b.y = c.y = 0;
                const double height = slivers ? std::pow(10, random.within(-7, -3)) : 1e-3;
                if (i % 4 == 1) c = glm::mix(a, b, 0.7f) + static_cast<float>(height) * c;
                const vec3 far = i % 4 == 2 ? random.direction() * static_cast<float>(size * 300) : vec3(0);
                a += far, b += far, c += far;
            } while (!slivers && is_sliver(a, b, c));
            mesh.positions.insert(mesh.positions.end(), {a, b, c});
        }
        mesh.normals.assign(mesh.positions.size(), vec3(0, 1, 0));
        for (unsigned i = 0; i < 48; i += 3) mesh.triangles.emplace_back(i, i + 1, i + 2);
        mesh.triangle_material.assign(16, 0);
        scene.meshes.push_back(mesh);
        for (int copy = 0; copy < (instanced ? 2 : 1); ++copy) {
            Instance instance;
            instance.mesh = m;
            if (instanced) {
                instance.object_to_world = glm::translate(dmat4(1), size * dvec3(random.box(100))) *
                                           glm::rotate(dmat4(1), random.within(0, 6), dvec3(random.direction())) *
                                           glm::scale(dmat4(1), dvec3(1, random.within(0.1, 10), 1));
            }
            scene.instances.push_back(instance);
        }
    }
    const ShadingScene shading(scene);
    ASSERT_EQ(shading.trace.slivers, slivers);
    std::vector<vec4> inputs;
    for (std::uint32_t instance = 0; instance < shading.trace.instances.size(); ++instance) {
        const Block& block = shading.trace.blocks[shading.trace.instances[instance].block];
        for (std::uint32_t t = block.first_triangle; t < block.first_triangle + block.triangle_count; ++t) {
            if (!has_normal(shading.trace, t)) continue;
            for (int k = 0; k < 4; ++k) {
                const double u = k == 0 ? 0 : random.unit();
                inputs.emplace_back(u, random.unit() * (1 - u), t, instance);
                inputs.emplace_back(random.direction(), 0);
            }
        }
    }
    const auto count = static_cast<std::uint32_t>(inputs.size() / 2);
    ASSERT_GT(count, 0.6 * 24 * 16 * 4);
    const std::string library = std::string(R"(
        #include "shaders/lib/sobol.glsl"
        #include "shaders/lib/sampling.glsl"
        #include "shaders/lib/onb.glsl"
        #include "shaders/lib/surface.glsl"
    )") + kMeetLibrary + R"(
        bool meets(Hit hit, vec3 origin, vec3 direction) {
            Hit best = Hit(1e38, 0.0, 0.0, kMiss, 0u);
            meet(Ray(origin, 0.0, direction, 1e38), hit.instance, hit.triangle, hit.triangle + 1u, best);
            return best.triangle != kMiss;
        }
    )";
    const auto found = shading.run(library, std::string(kHit) + R"(
            Surface s = surface_at(hit, direction);
            float again = 0.0;
            float bare = 0.0;
            for (uint n = 0u; n < 64u; ++n) {
                vec3 local = sample_cosine(sample_2d(make_sampler(i, 0u, n, 1u), 0u));
                float slant = n % 4u == 0u ? 1e-5 : n % 4u == 1u ? 1e-2 : 1.0;
                local = normalize(vec3(local.xy, (n % 2u == 0u ? slant : -slant) * local.z));
                vec3 leaving = basis_around(s.geometric_normal) * local;
                vec3 origin = offset_ray_origin(s.position, s.offset, s.geometric_normal, leaving);
                again += meets(hit, origin, leaving) ? 1.0 : 0.0;
                bare += meets(hit, s.position, leaving) ? 1.0 : 0.0;
            }
            result[0] = vec4(again, bare, s.offset, length(s.position));
        )",
                                   count, 1, inputs);
    double bare = 0;
    for (std::uint32_t i = 0; i < count; ++i) {
        EXPECT_EQ(found[i].x, 0) << i << ": offset " << found[i].z << " at " << found[i].w;
        EXPECT_GT(found[i].z, 0) << i;
        bare += found[i].y;
    }
    EXPECT_GT(bare, 0.05 * 64 * count);  // many rays hit without the offset
}

}  // namespace
}  // namespace halflight
