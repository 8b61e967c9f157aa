// Tests AOVs on known geometry.
#include "passes/picture/aov.h"

#include "passes/light/shadow.h"
#include "passes/surface/gbuffer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "shaders/shared/aov_record.h"
#include "tests/pass/picture/pixels.h"
#include "tests/pass/scenes.h"
#include "tests/pass/stage.h"

namespace halflight::test {
namespace {

class AovTest : public PassTest {
  protected:
    std::vector<shared::AovRecord> render(Stage& stage) {
        graph::Graph graph;
        const SceneView view = stage.view(graph);
        const graph::BufferHandle records = add_aov(graph, view, add_gbuffer(graph, view));
        graph.output(records);
        run(graph);
        return executor.read<shared::AovRecord>(records);
    }

    /// Returns the position of a world point in the picture, pixels from the upper left corner.
    static dvec2 place(const Camera& camera, const ivec2& image, const dvec3& p) {
        const dvec3 q(glm::inverse(camera.camera_to_world) * dvec4(p, 1));
        const double half = camera.orthographic ? camera.ortho_height / 2 : std::tan(camera.vertical_fov / 2) * -q.z;
        return {(q.x / half * image.y / image.x + 1) / 2 * image.x, (1 - q.y / half) / 2 * image.y};
    }

    void expect_known(const Scene& scene, const Camera& camera, const Camera& previous) {
        const ivec2 image(60, 45);
        Stage stage(programs, scene, camera, image);
        stage.look_through(camera, previous);
        const std::vector<shared::AovRecord> records = render(stage);
        int hits = 0, misses = 0;
        for (const auto& [x, y] : pixels_of(image)) {
            const dvec2 at = dvec2(x, y) + 0.5;
            const CameraRayResult expected = trace_camera_ray(scene, camera, image, at);
            if (!expected.clear) continue;
            const shared::AovRecord& r = records[stage.path(x, y)];
            if (!expected.hit) {
                ++misses;
                EXPECT_EQ(r.triangle, shared::kMiss);
                EXPECT_EQ(r.depth, shared::kNoDepth);
                EXPECT_EQ(r.position, vec3(0));
                EXPECT_EQ(r.motion, vec2(0));
                continue;
            }
            ++hits;
            const dvec3 position = dvec3(r.position) + stage.trace_tables().origin;
            EXPECT_LT(glm::length(position - expected.surface.position), 1e-5) << x << ", " << y;
            EXPECT_NEAR(r.depth, expected.surface.depth, 1e-5);
            const TriangleSource source = source_of(stage.trace_tables(), r.instance, r.triangle);
            EXPECT_EQ(source.instance, expected.surface.instance);
            EXPECT_EQ(source.triangle, expected.surface.triangle);
            const dvec2 motion = at - place(previous, image, expected.surface.position);
            EXPECT_LT(glm::length(dvec2(r.motion) - motion), 1e-3) << x << ", " << y;
        }
        EXPECT_GT(hits, 300);
        EXPECT_GT(misses, 300);
    }
};

TEST_F(AovTest, RecordsAreKnown) {
    const Camera camera = camera_on_pyramids();
    Camera previous = look_at_camera({0.7, 3.1, 7.5}, {0.3, 1.2, 0}, {0.05, 1, 0}, 0.85);
    expect_known(pyramids(), camera, camera);
    expect_known(pyramids(), camera, previous);
    Camera orthographic = camera;
    orthographic.orthographic = previous.orthographic = true;
    orthographic.ortho_height = 7, previous.ortho_height = 6;
    expect_known(pyramids(), orthographic, previous);
}

/// Triangles at a silhouette are seen edge-on. Where the pixel's ray passes between them, the record is of the triangle
/// that was rasterized, at a point beside the ray.
TEST_F(AovTest, StillCamerasSeeNoMotionAtSilhouettes) {
    Scene scene;
    const int material = add_material(scene, diffuse_material(vec3(0.5f)));
    add_quad(scene, material, {-40, -40, -3}, {80, 0, 0}, {0, 80, 0});
    for (int i = 0; i < 12; ++i)
        add_ball(scene, material, vec3(0.9 * (i % 4) - 1.4, 0.9 * (i / 4) - 0.95, 0.07 * i), 0.41f, 40);
    for (const bool orthographic : {false, true}) {
        Camera camera = look_at_camera({0.3, 0.2, 6}, {0, 0, 0}, {0.1, 1, 0}, 0.6);
        camera.orthographic = orthographic, camera.ortho_height = 3.5;
        const ivec2 image(240, 180);
        Stage stage(programs, scene, camera, image);
        stage.look_through(camera, camera);
        const std::vector<shared::AovRecord> records = render(stage);
        float most = 0;
        for (const auto& [x, y] : pixels_of(image))
            most = std::max(most, glm::length(records[stage.path(x, y)].motion));
        EXPECT_LT(most, 1e-3f);
    }
}

TEST_F(AovTest, PointsBehindThePreviousCameraHaveNoMotion) {
    const Camera camera = camera_on_quad();
    Camera away = camera;
    away.camera_to_world[0] *= -1.0;
    away.camera_to_world[2] *= -1.0;
    Stage stage(programs, tilted_quad(), camera, {32, 24});
    stage.look_through(camera, away);
    for (const shared::AovRecord& r : render(stage)) EXPECT_EQ(r.motion, vec2(0));
}

// --- Cost of tracing ------------------------------------------------------------------------------------------------

class DebugAovTest : public PassTest {
  protected:
    /// Results of the shadow pass with one tracer, and of a second graph that reads the tracer's counters.
    struct Traced {
        std::vector<shared::DebugRecord> records;
        std::vector<int> surface;  // 1 where a surface is visible, by path
    };
    Traced trace(Stage& stage, const DebugOptions& options, rays::Culling culling = rays::Culling::compute,
                 std::uint32_t shadow_rays = 1) {
        graph::Graph unused;
        rays::Tracer tracer(stage.view(unused).trace, culling);
        const auto view_of = [&](graph::Graph& graph) {
            const SceneView v = stage.view(graph);
            SceneView view{v.scene, v.trace, tracer, v.band, v.frame_constants};
            view.shadow_rays = shadow_rays;
            return view;
        };
        graph::Graph frame;
        const SceneView view = view_of(frame);
        const GBuffer g = add_gbuffer(frame, view);
        frame.output(add_shadow(frame, view, g).occluded);
        frame.output(g.hits);
        run(frame);
        Traced traced;
        for (const shared::Hit& hit : executor.read<shared::Hit>(g.hits))
            traced.surface.push_back(hit.triangle != shared::kMiss ? 1 : 0);

        graph::Graph data;
        const SceneView again = view_of(data);
        const graph::BufferHandle records = add_debug_aov(data, again, add_gbuffer(data, again), options);
        data.output(records);
        run(data);
        traced.records = executor.read<shared::DebugRecord>(records);
        return traced;
    }

    /// Returns a scene whose hierarchy is one leaf, so that a cut gains nothing.
    static Scene lit_quad() {
        Scene scene;
        add_quad(scene, add_material(scene, diffuse_material(vec3(0.5f))), {-1.5f, -1, 0}, {3, 0, 0}, {0, 2, 0});
        scene.environment.color = vec3(1);
        return scene;
    }
};

/// The first one of several shadow rays is counted.
TEST_F(DebugAovTest, OneQuadIsOneNodeAndOneEntry) {
    Stage stage(programs, lit_quad(), camera_on_quad(), {60, 45});
    for (const std::uint32_t shadow_rays : {1u, 3u}) {
        SCOPED_TRACE(shadow_rays);
        const Traced traced = trace(stage, {.nodes = true, .culling = true}, rays::Culling::compute, shadow_rays);
        int met = 0, empty = 0;
        for (std::size_t tile = 0; tile < traced.records.size(); tile += 64) {
            const auto surfaces =
                std::count_if(&traced.surface[tile], &traced.surface[tile] + 64, [](int s) { return s != 0; });
            met += surfaces == 64;
            empty += surfaces == 0;
            for (std::size_t path = tile; path < tile + 64; ++path) {
                // Tiles with few surfaces may have only rays that start below a surface.
                EXPECT_GE(traced.records[path].leaves, surfaces == 64 ? 1u : 0u) << path;
                EXPECT_LE(traced.records[path].leaves, surfaces == 0 ? 0u : 1u) << path;
                EXPECT_EQ(traced.records[path].leaves, traced.records[tile].leaves);
                EXPECT_EQ(traced.records[path].others, 0u) << path;
            }
        }
        EXPECT_GE(met, 5);
        EXPECT_GT(empty, 10);
        for (const auto& [x, y] : pixels_of({60, 45}))
            EXPECT_EQ(traced.records[stage.path(x, y)].nodes, 1u) << x << ", " << y;
    }
}

TEST_F(DebugAovTest, WhatIsNotRequestedOrNotThereIsNotCounted) {
    Stage stage(programs, lit_quad(), camera_on_quad(), {60, 45});
    for (const shared::DebugRecord& r : trace(stage, {.culling = true}).records) EXPECT_EQ(r.nodes, 0u);
    for (const shared::DebugRecord& r : trace(stage, {.nodes = true}).records) EXPECT_EQ(r.leaves, 0u);
    // Tracers without lists; the automatic tracer's first run is plain.
    for (const rays::Culling culling : {rays::Culling::off, rays::Culling::automatic})
        for (const shared::DebugRecord& r : trace(stage, {.culling = true}, culling).records) EXPECT_EQ(r.leaves, 0u);
}

TEST_F(DebugAovTest, DenseGeometryCostsMoreVisits) {
    Stage stage(programs, pyramids(), camera_on_pyramids(), {60, 45});
    const Traced traced = trace(stage, {.nodes = true}, rays::Culling::automatic);
    double nodes[2] = {}, rays[2] = {};
    for (const auto& [x, y] : pixels_of({60, 45})) {
        const std::size_t path = stage.path(x, y);
        EXPECT_GE(traced.records[path].nodes, 1u);
        nodes[traced.surface[path]] += traced.records[path].nodes;
        ++rays[traced.surface[path]];
    }
    EXPECT_GT(nodes[1] / rays[1], nodes[0] / rays[0]);
}

}  // namespace
}  // namespace halflight::test
