// Tests the flattening of scenes for tracing: what is merged, what is shared, and how ids map back.
#include <gtest/gtest.h>

#include <cmath>
#include <glm/gtc/matrix_transform.hpp>

#include "engine/tables/tables.h"
#include "tests/unit/renderer/refusal.h"

namespace halflight {
namespace {

Mesh one_triangle(const vec3& at) {
    Mesh mesh;
    mesh.positions = {at, at + vec3(1, 0, 0), at + vec3(0, 1, 0)};
    mesh.normals.assign(3, vec3(0, 0, 1));
    mesh.triangles = {{0, 1, 2}};
    mesh.triangle_material = {0};
    return mesh;
}

Instance instance_of(int mesh, const dmat4& object_to_world = dmat4(1)) {
    return {"", mesh, object_to_world};
}

Scene scene_of(std::vector<Mesh> meshes, std::vector<Instance> instances) {
    Scene scene;
    scene.name = "test";
    scene.materials.emplace_back();
    scene.meshes = std::move(meshes);
    scene.instances = std::move(instances);
    return scene;
}

dmat4 moved(double x, double y, double z) {
    return glm::translate(dmat4(1), dvec3(x, y, z));
}

/// Returns the world position of corner k of a triangle in the tables.
dvec3 placed(const TraceTables& tables, std::uint32_t instance, std::uint32_t triangle, int k) {
    return dvec3(tables.instances[instance].block_to_world * vec4(tables.positions[tables.triangles[triangle][k]], 1)) +
           tables.origin;
}

TEST(TraceTables, OriginMinimizesRounding) {
    const Mesh triangle = one_triangle(vec3(-0.5f, -0.5f, 0));
    const dmat4 hill = glm::scale(dmat4(1), dvec3(1e5));
    const Scene scene = scene_of({triangle, triangle},
                                 {instance_of(1, moved(-1e7, 5e3, 0) * hill), instance_of(0, moved(3e6, -2, 5)),
                                  instance_of(1, moved(1e7, 5e3, 0) * hill), instance_of(1, moved(0, 5e3, 0) * hill)});
    EXPECT_EQ(build_trace_tables(scene).origin, dvec3(3e6, -2, 5));
    const TraceTables empty = build_trace_tables(scene_of({}, {}));
    EXPECT_EQ(empty.origin, dvec3(0));
    EXPECT_TRUE(empty.triangles.empty() && empty.blocks.empty() && empty.instances.empty() && empty.bounds.empty());
}

TEST(TraceTables, OriginOfTheReferencePoseIsReusedWherePreciseEnough) {
    const Mesh triangle = one_triangle(vec3(-0.5f, -0.5f, 0));
    const auto origin = [&](double x, const dvec3& reference) {
        return build_trace_tables(scene_of({triangle}, {instance_of(0, moved(x, 0, 0))}), 0, reference).origin;
    };
    // The triangle's box is 1 x 1, so half its diagonal is 0.71.
    EXPECT_EQ(origin(11, dvec3(0)), dvec3(0));
    EXPECT_EQ(origin(12, dvec3(0)), dvec3(12, 0, 0)) << "17 sizes away";
    EXPECT_EQ(origin(1e6, dvec3(1e6 + 5, 0, 0)), dvec3(1e6 + 5, 0, 0));
    // Two distant triangles have no good origin; that of the reference pose is no worse than others.
    const Scene two = scene_of({triangle, triangle, triangle},
                               {instance_of(0), instance_of(1, moved(1000, 0, 0)), instance_of(2, moved(900, 0, 0))});
    EXPECT_EQ(build_trace_tables(two, 0, dvec3(1000, 0, 0)).origin, dvec3(1000, 0, 0));
    EXPECT_EQ(build_trace_tables(two, 0, dvec3(-5000, 0, 0)).origin, dvec3(900, 0, 0));
}

TEST(TraceTables, MergesMeshesUsedOnceAndSharesOthers) {
    const Scene scene =
        scene_of({one_triangle(vec3(0)), one_triangle(vec3(5)), one_triangle(vec3(9))},
                 {instance_of(1, moved(1, 0, 0)), instance_of(0, moved(0, 2, 0)), instance_of(1, moved(3, 0, 0)),
                  instance_of(2, glm::scale(dmat4(1), dvec3(-1, 1, 1)))});
    const TraceTables tables = build_trace_tables(scene);
    ASSERT_EQ(tables.blocks.size(), 2u);
    ASSERT_EQ(tables.instances.size(), 3u);
    EXPECT_TRUE(tables.instances[0].identity);
    EXPECT_EQ(tables.instances[1].scene_instance, 0u);
    EXPECT_EQ(tables.instances[2].scene_instance, 2u);
    ASSERT_EQ(tables.ranges.size(), 3u);
    EXPECT_TRUE(tables.ranges[0].merged && tables.ranges[1].merged && !tables.ranges[2].merged);
    EXPECT_EQ(tables.ranges[0].instance, 1u);
    EXPECT_EQ(tables.ranges[1].instance, 3u);
    EXPECT_EQ(tables.ranges[2].mesh, 1u);

    const std::pair<std::uint32_t, std::uint32_t> hits[] = {{0, 0}, {0, 1}, {1, 2}, {2, 2}};
    const std::uint32_t expected[] = {1, 3, 0, 2};
    for (int i = 0; i < 4; ++i) {
        const auto [instance, triangle] = hits[i];
        const TriangleSource source = source_of(tables, instance, triangle);
        EXPECT_EQ(source.instance, expected[i]);
        EXPECT_EQ(source.triangle, 0u);
        const Instance& from = scene.instances[source.instance];
        for (int k = 0; k < 3; ++k) {  // corners in file order, mirrored or not
            const vec3 p = scene.meshes[static_cast<std::size_t>(from.mesh)].positions[static_cast<std::size_t>(k)];
            EXPECT_NEAR(glm::distance(placed(tables, instance, triangle, k), dvec3(from.object_to_world * dvec4(p, 1))),
                        0, 1e-5);
        }
    }
}

TEST(TraceTables, FlattensSmallSharedMeshesUpToTheLimit) {
    Mesh large = one_triangle(vec3(0));
    for (int i = 0; i < 9; ++i) large.triangles.push_back(large.triangles[0]);
    large.triangle_material.assign(10, 0);
    std::vector<Instance> instances;
    for (int i = 0; i < 4; ++i) instances.push_back(instance_of(i % 2, moved(i, 0, 0)));
    const Scene scene = scene_of({large, one_triangle(vec3(1))}, instances);
    for (const auto& [limit, count] : {std::pair<std::size_t, std::size_t>(1, 4), {2, 3}, {21, 3}, {22, 1}})
        EXPECT_EQ(build_trace_tables(scene, limit).instances.size(), count) << limit;
    EXPECT_EQ(build_trace_tables(scene, 2).ranges.size(), 3u);
    const TraceTables all = build_trace_tables(scene, 22);
    EXPECT_EQ(all.triangles.size(), 22u);
    EXPECT_EQ(all.positions.size(), 12u);
}

TEST(TraceTables, MergesSingularAndIllConditionedInstances) {
    const Scene scene =
        scene_of({one_triangle(vec3(0))},
                 {instance_of(0), instance_of(0, glm::scale(dmat4(1), dvec3(1, 1, 0))),
                  instance_of(0, glm::scale(dmat4(1), dvec3(1, 1, 1e-6))), instance_of(0, moved(4, 0, 0))});
    const TraceTables tables = build_trace_tables(scene);
    ASSERT_EQ(tables.instances.size(), 3u);
    EXPECT_TRUE(tables.instances[0].identity);
    EXPECT_EQ(tables.blocks[0].triangle_count, 2u);
    for (std::size_t i = 1; i < 3; ++i) {
        const glm::mat4x3 m = tables.instances[i].block_to_world;
        EXPECT_NEAR(glm::distance(tables.instances[i].world_to_block * vec4(m * vec4(1, 2, 3, 1), 1), vec3(1, 2, 3)), 0,
                    1e-5);
    }
}

TEST(TraceTables, KeepPrecisionFarFromTheOrigin) {
    const dvec3 far(1e6, -2e6, 3e6);
    const Scene scene =
        scene_of({one_triangle(vec3(0)), one_triangle(vec3(0, 0, 2))},
                 {instance_of(0, moved(far.x, far.y, far.z)), instance_of(1, moved(far.x + 3, far.y, far.z)),
                  instance_of(1, moved(far.x + 6, far.y, far.z))});
    const TraceTables tables = build_trace_tables(scene);
    EXPECT_LT(glm::length(tables.bounds.extent()), 10.0f);
    EXPECT_NEAR(glm::distance(placed(tables, 0, 0, 1), far + dvec3(1, 0, 0)), 0, 1e-6);
    EXPECT_NEAR(glm::distance(placed(tables, 2, 1, 2), far + dvec3(6, 1, 2)), 0, 1e-6);
}

TEST(TraceTables, RefuseValuesThatFloatsCannotRepresent) {
    const Scene scene = scene_of({one_triangle(vec3(0))}, {instance_of(0, glm::scale(dmat4(1), dvec3(1e14)))});
    expect_refusal([&] { build_trace_tables(scene); }, "test: instance 0");
}

TEST(TraceTables, FlagAlphaOnlyWhereItMatters) {
    const auto flagged = [](AlphaMode mode, float alpha, float cutoff, float vertex_alpha, int texel_alpha) {
        Scene scene = scene_of({one_triangle(vec3(0))}, {instance_of(0)});
        Material& material = scene.materials[0];
        material.alpha_mode = mode;
        material.base_color.a = alpha;
        material.alpha_cutoff = cutoff;
        if (vertex_alpha < 1) scene.meshes[0].colors.assign(3, vec4(1, 1, 1, vertex_alpha));
        if (texel_alpha < 256) {
            scene.images.push_back({"image", 2, 1, {0, 0, 0, 255, 0, 0, 0, static_cast<std::uint8_t>(texel_alpha)}});
            material.base_color_texture.image = 0;
        }
        const TraceTables tables = build_trace_tables(scene);
        EXPECT_EQ(tables.alpha_tested, (tables.triangles[0].w & kTriangleAlpha) != 0);
        return tables.alpha_tested;
    };
    using enum AlphaMode;
    EXPECT_FALSE(flagged(opaque, 0.1f, 0.5f, 1, 0));
    EXPECT_FALSE(flagged(blend, 1, 0.5f, 1, 255));
    EXPECT_TRUE(flagged(blend, 0.9f, 0.5f, 1, 256));
    EXPECT_TRUE(flagged(blend, 1, 0.5f, 0.5f, 256));
    EXPECT_TRUE(flagged(blend, 1, 0.5f, 1, 254));
    EXPECT_FALSE(flagged(mask, 1, 0.5f, 0.6f, 256));
    EXPECT_FALSE(flagged(mask, 1, 0.5f, 1, 200));
    EXPECT_TRUE(flagged(mask, 1, 0.5f, 1, 100));
    EXPECT_TRUE(flagged(mask, 0.4f, 0.5f, 1, 256));
}

}  // namespace
}  // namespace halflight
