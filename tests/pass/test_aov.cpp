// Data outputs of known geometry.
#include "passes/aov.h"

#include <gtest/gtest.h>

#include <cmath>

#include "shaders/shared/aov.h"
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

    /// Where a world point is in the picture, pixels from the upper left.
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
        for (int y = 0; y < image.y; ++y) {
            for (int x = 0; x < image.x; ++x) {
                const dvec2 at = dvec2(x, y) + 0.5;
                const LookResult expected = look_at(scene, camera, image, at);
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
                EXPECT_LT(glm::length(position - expected.seen.position), 1e-5) << x << ", " << y;
                EXPECT_NEAR(r.depth, expected.seen.depth, 1e-5);
                const TriangleSource source = source_of(stage.trace_tables(), r.instance, r.triangle);
                EXPECT_EQ(source.instance, expected.seen.instance);
                EXPECT_EQ(source.triangle, expected.seen.triangle);
                const dvec2 motion = at - place(previous, image, expected.seen.position);
                EXPECT_LT(glm::length(dvec2(r.motion) - motion), 1e-3) << x << ", " << y;
            }
        }
        EXPECT_GT(hits, 300);
        EXPECT_GT(misses, 300);
    }
};

TEST_F(AovTest, StillCamera) {
    expect_known(pyramids(), camera_on_pyramids(), camera_on_pyramids());
}

TEST_F(AovTest, MovingCamera) {
    expect_known(pyramids(), camera_on_pyramids(), look_at_camera({0.7, 3.1, 7.5}, {0.3, 1.2, 0}, {0.05, 1, 0}, 0.85));
}

TEST_F(AovTest, OrthographicCamera) {
    Camera camera = camera_on_pyramids();
    camera.orthographic = true;
    camera.ortho_height = 7;
    Camera previous = look_at_camera({0.7, 3.1, 7.5}, {0.3, 1.2, 0}, {0.05, 1, 0}, 0.85);
    previous.orthographic = true;
    previous.ortho_height = 6;
    expect_known(pyramids(), camera, previous);
}

TEST_F(AovTest, WhatWasBehindTheCameraHasNoMotion) {
    const Camera camera = camera_on_quad();
    Camera away = camera;
    away.camera_to_world[0] *= -1.0;
    away.camera_to_world[2] *= -1.0;
    Stage stage(programs, tilted_quad(), camera, {32, 24});
    stage.look_through(camera, away);
    for (const shared::AovRecord& r : render(stage)) EXPECT_EQ(r.motion, vec2(0));
}

}  // namespace
}  // namespace halflight::test
