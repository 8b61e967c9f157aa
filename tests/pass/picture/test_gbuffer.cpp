// Tests the G-buffer against a search over all triangles in double, and its special cases.
#include "passes/surface/gbuffer.h"

#include <gtest/gtest.h>

#include <cmath>

#include "engine/reference/surface.h"
#include "tests/pass/picture/pixels.h"
#include "tests/pass/scenes.h"
#include "tests/pass/stage.h"

namespace halflight::test {
namespace {

class GBufferTest : public PassTest, public testing::WithParamInterface<PrimaryVisibility> {
  protected:
    struct Content {
        std::vector<shared::Ray> rays;
        std::vector<shared::Hit> hits;
        std::vector<SurfaceRecord> surfaces;
    };
    Content render(Stage& stage) {
        graph::Graph graph;
        const GBuffer g = add_gbuffer(graph, stage.view(graph), {}, GetParam());
        graph.output(g.rays);
        graph.output(g.hits);
        graph.output(g.surfaces);
        run(graph);
        return {executor.read<shared::Ray>(g.rays), executor.read<shared::Hit>(g.hits),
                unpack_surfaces(executor.read<vec4>(g.surfaces), stage.buffers().needs())};
    }

    /// Expects every pixel without an edge to agree with trace_camera_ray(). At least `clear` pixels have no edge, and
    /// `hits` pixels see a surface.
    void expect_as_seen(const Scene& scene, const Camera& camera, const ivec2& image, std::uint32_t sample,
                        double clear, double hits) {
        Stage stage(programs, scene, camera, image);
        if (sample > 0) stage.select_sample(sample);
        const vec2 jitter = stage.frame().jitter;
        const Content found = render(stage);
        const dvec3 eye(camera.camera_to_world[3]);
        int clear_count = 0, hit_count = 0;
        for (const auto& [x, y] : pixels_of(image)) {
            const CameraRayResult expected = trace_camera_ray(scene, camera, image, dvec2(x, y) + dvec2(jitter));
            if (!expected.clear) continue;
            ++clear_count;
            const std::size_t path = stage.path(x, y);
            const SurfaceRecord& record = found.surfaces[path];
            const shared::Hit& hit = found.hits[path];
            ASSERT_EQ(hit.triangle != shared::kMiss, expected.hit) << x << ", " << y;
            ASSERT_EQ(record.is_surface, expected.hit) << x << ", " << y;
            if (!expected.hit) continue;
            ++hit_count;
            const CameraHit& s = expected.surface;
            const TriangleSource source = source_of(stage.trace_tables(), hit.instance, hit.triangle);
            ASSERT_EQ(source.instance, s.instance) << x << ", " << y;
            ASSERT_EQ(source.triangle, s.triangle) << x << ", " << y;
            // The float error is about ten roundings of coordinates relative to the scene's centre and to the
            // camera. It is divided by the cosine of the angle of incidence.
            const double size = glm::length(s.position - eye) + glm::length(s.position - stage.trace_tables().origin);
            const double grazing = std::abs(glm::dot(s.direction, s.geometric_normal));
            const double error = 20 * 0x1p-24 * size / grazing;
            const dvec3 above = double(record.lift) * dvec3(record.geometric_normal);
            const dvec3 position = dvec3(record.position) - above + stage.trace_tables().origin;
            EXPECT_LT(glm::length(position - s.position), error) << x << ", " << y;
            EXPECT_NEAR(hit.t, glm::length(s.depth * s.direction / glm::dot(s.direction, forward(camera))), error);
            // Triangles are about one unit large, and the normals of their corners differ by less than one unit.
            EXPECT_NEAR(hit.u, s.u, 2 * error) << x << ", " << y;
            EXPECT_NEAR(hit.v, s.v, 2 * error) << x << ", " << y;
            const dvec3 horizon(record.geometric_normal);
            if (record.lift > 0) {  // the position is on the smooth surface
                EXPECT_NEAR(glm::length(horizon), 1, 1e-6) << x << ", " << y;
                EXPECT_GT(std::min(glm::dot(horizon, s.geometric_normal), -glm::dot(horizon, s.direction)), 0);
            } else {
                EXPECT_LT(glm::length(horizon - s.geometric_normal), 1e-6 + 8 * error) << x << ", " << y;
            }
            EXPECT_LT(glm::length(dvec3(record.normal) - bent(s)), 1e-6 + 8 * error) << x << ", " << y;
            EXPECT_GT(record.offset, 0);
            EXPECT_LT(record.offset, 200 * 0x1p-24 * size);
        }
        EXPECT_GE(clear_count, clear * image.x * image.y);
        EXPECT_GE(hit_count, hits * image.x * image.y);
    }

    static dvec3 forward(const Camera& camera) { return -dvec3(camera.camera_to_world[2]); }
    /// Returns the shading normal defined by SHADING.md, "Surfaces".
    static dvec3 bent(const CameraHit& s) {
        const double cosine = -glm::dot(s.normal, s.direction);
        return cosine <= 0 ? glm::normalize(s.normal - s.direction * (1e-3 - cosine)) : s.normal;
    }
};

INSTANTIATE_TEST_SUITE_P(, GBufferTest, testing::Values(PrimaryVisibility::raster, PrimaryVisibility::traced),
                         [](const auto& way) { return std::string(name(way.param)); });

TEST_P(GBufferTest, ShowsWhatRaysSee) {
    const dvec3 far(1e6, -3e5, 2e6);
    Camera near_and_far = camera_on_quad();
    near_and_far.near_plane = 3.6, near_and_far.far_plane = 4.2;
    Camera orthographic_slab = near_and_far;
    orthographic_slab.orthographic = true, orthographic_slab.ortho_height = 3.9;
    const struct {
        const char* name;
        Scene scene;
        Camera camera;
        ivec2 image;
        std::uint32_t sample;
        double clear, hits;  // least shares of pixels without an edge, and of pixels that see a surface
    } views[] = {
        {"tilted quad", tilted_quad(), camera_on_quad(), {96, 64}, 0, 0.9, 0.15},
        {"other points of the pixels", tilted_quad(), camera_on_quad(), {61, 35}, 1, 0.9, 0.1},
        {"other points of the pixels", tilted_quad(), camera_on_quad(), {61, 35}, 4, 0.9, 0.1},
        {"from behind",
         tilted_quad(),
         look_at_camera({-0.7, -1.4, -3.6}, {0, 0, 0}, {0.1, 1, 0}, 0.9),
         {61, 35},
         0,
         0.9,
         0.1},
        {"far from the origin", tilted_quad(far), camera_on_quad(far), {61, 35}, 0, 0.9, 0.1},
        {"orthographic", tilted_quad(), camera_on_quad(dvec3(0), true), {61, 35}, 3, 0.9, 0.1},
        {"rotated, scaled and mirrored instances", pyramids(), camera_on_pyramids(), {120, 90}, 2, 0.85, 0.15},
        {"clipped by near and far plane", tilted_quad(), near_and_far, {61, 35}, 0, 0.8, 0.03},
        {"orthographic and clipped", tilted_quad(), orthographic_slab, {61, 35}, 0, 0.8, 0.03},
    };
    for (const auto& view : views) {
        SCOPED_TRACE(view.name);
        expect_as_seen(view.scene, view.camera, view.image, view.sample, view.clear, view.hits);
    }
}

TEST_P(GBufferTest, SmoothSurfacesAreThoseOfTheOracle) {
    Scene scene;
    const int ball = add_smooth_ball(scene, add_material(scene, diffuse_material(vec3(0.8f))), vec3(0), 1, 5);
    Mesh& mesh = scene.meshes.back();
    for (std::size_t i = 0; i < mesh.normals.size(); ++i)  // bends differ in sign and along each edge
        mesh.normals[i] = glm::normalize(mesh.normals[i] + 0.5f * glm::sin(7.0f * mesh.positions[i]));
    scene.instances[static_cast<std::size_t>(ball)].object_to_world =
        dmat4(dvec4(-1, 0.2, 0, 0), dvec4(0, 0.7, 0.3, 0), dvec4(0, -0.3, 1.1, 0), dvec4(2, 0.7, -0.6, 1));  // mirrors
    const Camera camera = look_at_camera({3, 1.5, 3}, {2, 0.7, -0.6}, {0, 1, 0}, 0.6);
    Stage stage(programs, scene, camera, {64, 64});
    const Content found = render(stage);
    const reference::Tracer tracer(scene);
    const dvec3 between = stage.trace_tables().origin - tracer.origin();
    int lifted = 0, flat = 0;
    for (std::size_t path = 0; path < found.hits.size(); ++path) {
        const SurfaceRecord& record = found.surfaces[path];
        if (!record.is_surface) continue;
        const shared::Hit& hit = found.hits[path];
        const TriangleSource source = source_of(stage.trace_tables(), hit.instance, hit.triangle);
        const ReferenceHit same{hit.t, hit.u, hit.v, static_cast<int>(source.instance),
                                static_cast<int>(source.triangle)};
        const reference::Surface s = make_surface(tracer, same, -glm::normalize(dvec3(found.rays[path].direction)));
        if ((s.position == s.seen) != (record.lift == 0)) continue;  // rounding decides about the error bound
        ++(record.lift > 0 ? lifted : flat);
        EXPECT_LT(glm::length(dvec3(record.position) + between - s.position), 1e-5) << path;
        EXPECT_LT(glm::length(dvec3(record.geometric_normal) - s.n_g), 2e-5) << path;
    }
    EXPECT_GT(lifted, 500);
    EXPECT_GT(flat, 50);
}

TEST_P(GBufferTest, UnlitEmitsItsColourAndReflectsNothing) {
    Material m = diffuse_material({0.2f, 0.5f, 0.7f});
    m.unlit = true;
    m.emission = vec3(9);
    Scene scene = floor_scene(m);
    add_quad(scene, add_material(scene, metal_material(vec3(1), 0.5f)), {0, 1, 0}, {0, 1, 0}, {1, 0, 0});
    Stage stage(programs, scene, spot_camera({5, 0, 5}, {0, 1, 0}, 1), {16, 16});
    const SurfaceRecord s = render(stage).surfaces[stage.path(3, 9)];
    ASSERT_TRUE(s.is_surface);
    EXPECT_LT(glm::length(s.emission - vec3(0.2f, 0.5f, 0.7f)), 1e-6f);
    EXPECT_EQ(s.diffuse, vec3(0));
    EXPECT_EQ(s.specular, vec3(0));
}

TEST_P(GBufferTest, PathsOutsideThePictureAreEmpty) {
    Scene scene = floor_scene(diffuse_material(vec3(0.5f)));
    scene.environment.color = vec3(1);
    Stage stage(programs, scene, spot_camera({0, 0, 0}, {0, 1, 0}, 1), {17, 19});
    const Content c = render(stage);
    ASSERT_EQ(c.hits.size(), 1024u);
    std::vector<char> inside(1024);
    for (const auto& [x, y] : pixels_of({17, 19})) inside[stage.path(x, y)] = 1;
    for (std::size_t path = 0; path < 1024; ++path) {
        EXPECT_EQ(c.surfaces[path].is_surface, inside[path] != 0);
        EXPECT_EQ(c.hits[path].triangle != shared::kMiss, inside[path] != 0);
        EXPECT_EQ(c.rays[path].t_max >= c.rays[path].t_min, inside[path] != 0) << "dead rays";
        if (!inside[path]) {
            EXPECT_EQ(c.surfaces[path].emission, vec3(0));
        }
    }
}

TEST_P(GBufferTest, CloseSurfacesAreDistinguishedThousandsOfUnitsAway) {
    // Two sheets are 1/16 apart and 4000 units away from the camera, with an automatic near plane. Depth needs a
    // precision of 2^-16.
    Scene scene;
    add_quad(scene, add_material(scene, diffuse_material(vec3(0))), {-2000, -2000, 0}, {4000, 0, 0}, {0, 4000, 0});
    add_quad(scene, add_material(scene, diffuse_material(vec3(1))), {-2000, -2000, 0.0625f}, {4000, 0, 0},
             {0, 4000, 0});
    for (const bool front : {true, false}) {
        const Camera camera = look_at_camera({0, 0, front ? 4000 : -4000}, {0, 0, 0}, {0, 1, 0}, 0.8);
        Stage stage(programs, scene, camera, {64, 64});
        stage.select_sample(3);
        const Content c = render(stage);
        for (const Pixel p : pixels_of(ivec2(64)))
            ASSERT_EQ(c.surfaces[stage.path(p.x, p.y)].diffuse.x, front ? 1 : 0) << p.x << ", " << p.y;
    }
}

TEST(PrimaryVisibility, IsTracedWhereTrianglesAreMany) {
    using enum PrimaryVisibility;
    const ivec2 image(200, 100);
    EXPECT_EQ(resolved(automatic, 5000, image), raster);
    EXPECT_EQ(resolved(automatic, 5001, image), traced);
    EXPECT_EQ(resolved(automatic, std::uint64_t{1} << 40, {65536, 65536}), traced);
    EXPECT_EQ(resolved(raster, 5001, image), raster);
    EXPECT_EQ(resolved(traced, 0, image), traced);
}

}  // namespace
}  // namespace halflight::test
