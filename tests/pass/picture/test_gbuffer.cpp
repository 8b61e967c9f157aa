// Tests the G-buffer against a search over all triangles in double, and its special cases.
#include "passes/surface/gbuffer.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "tests/pass/scenes.h"
#include "tests/pass/stage.h"

namespace halflight::test {
namespace {

class GBufferTest : public PassTest, public testing::WithParamInterface<PrimaryVisibility> {
  protected:
    struct Content {
        std::vector<float> depth;  // depth of each pixel; empty if visibility is traced
        std::vector<shared::Ray> rays;
        std::vector<shared::Hit> hits;
        std::vector<vec4> rows;
        std::vector<SurfaceRecord> surfaces;
    };
    Content render(Stage& stage) {
        graph::Graph graph;
        const GBuffer g = add_gbuffer(graph, stage.view(graph), {}, GetParam());
        if (g.depth) graph.output(g.depth);
        graph.output(g.rays);
        graph.output(g.hits);
        graph.output(g.surfaces);
        run(graph);
        Content c{g.depth ? executor.texture(g.depth).read_float() : std::vector<float>{},
                  executor.read<shared::Ray>(g.rays),
                  executor.read<shared::Hit>(g.hits),
                  executor.read<vec4>(g.surfaces),
                  {}};
        c.surfaces = unpack_surfaces(c.rows, stage.buffers().needs());
        return c;
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
        for (int y = 0; y < image.y; ++y) {
            for (int x = 0; x < image.x; ++x) {
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
                const double size =
                    glm::length(s.position - eye) + glm::length(s.position - stage.trace_tables().origin);
                const double grazing = std::abs(glm::dot(s.direction, s.geometric_normal));
                const double error = 20 * 0x1p-24 * size / grazing;
                const dvec3 above = double(record.lift) * dvec3(record.geometric_normal);
                const dvec3 position = dvec3(record.position) - above + stage.trace_tables().origin;
                EXPECT_LT(glm::length(position - s.position), error) << x << ", " << y;
                EXPECT_NEAR(hit.t, glm::length(s.depth * s.direction / glm::dot(s.direction, forward(camera))), error);
                // Triangles are about one unit large, and the normals of their corners differ by less than one unit.
                EXPECT_NEAR(hit.u, s.u, 2 * error) << x << ", " << y;
                EXPECT_NEAR(hit.v, s.v, 2 * error) << x << ", " << y;
                const dvec3 horizon = record.lift > 0 ? bent(s) : s.geometric_normal;
                EXPECT_LT(glm::length(dvec3(record.geometric_normal) - horizon), 1e-6 + 8 * error);
                EXPECT_LT(glm::length(dvec3(record.normal) - bent(s)), 1e-6 + 8 * error) << x << ", " << y;
                EXPECT_GT(record.offset, 0);
                EXPECT_LT(record.offset, 200 * 0x1p-24 * size);
                if (!found.depth.empty()) expect_depth(camera, stage, found.depth, image, {x, y}, s.depth);
            }
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
    /// Compares depth at a pixel. Rasterizers round corners to pixels / 2^GL_SUBPIXEL_BITS, so the bound of hardware
    /// grows with the difference to the neighbours. Software drivers do not need it here.
    void expect_depth(const Camera& camera, const Stage& stage, const std::vector<float>& depths, const ivec2& image,
                      const ivec2& pixel, double distance) {
        const auto at = [&](const ivec2& p) { return double{depths[static_cast<std::size_t>(p.y * image.x + p.x)]}; };
        const double depth = at(pixel);
        double slope = 0;
        for (const ivec2& axis : {ivec2(1, 0), ivec2(0, 1)}) {
            double least = 1;
            for (const ivec2& p : {pixel - axis, pixel + axis})
                if (p.x >= 0 && p.y >= 0 && p.x < image.x && p.y < image.y)
                    least = std::min(least, std::abs(at(p) - depth));
            slope += least;
        }
        GLint bits = 0;
        glGetIntegerv(GL_SUBPIXEL_BITS, &bits);
        const double rounding = context.software() ? 0 : std::ldexp(slope, -bits);
        const double near = stage.frame().clip.x;
        if (camera.orthographic) {
            const double far = camera.far_plane > 0 ? camera.far_plane : near + 2 * stage.reach();
            EXPECT_NEAR(depth, (far - distance) / (far - near), 1e-5 + rounding);
        } else {
            EXPECT_NEAR(depth * distance / near, 1, 1e-4 + rounding * distance / near)
                << "reversed float depth keeps its relative precision";
        }
    }
};

INSTANTIATE_TEST_SUITE_P(, GBufferTest, testing::Values(PrimaryVisibility::raster, PrimaryVisibility::traced),
                         [](const auto& way) { return std::string(name(way.param)); });

TEST_P(GBufferTest, TiltedQuad) {
    expect_as_seen(tilted_quad(), camera_on_quad(), {96, 64}, 0, 0.9, 0.15);
}

TEST_P(GBufferTest, TiltedQuadThroughOtherPointsOfThePixels) {
    for (std::uint32_t sample = 1; sample < 5; ++sample)
        expect_as_seen(tilted_quad(), camera_on_quad(), {61, 35}, sample, 0.9, 0.1);
}

TEST_P(GBufferTest, TiltedQuadFromBehind) {
    const Camera camera = look_at_camera({-0.7, -1.4, -3.6}, {0, 0, 0}, {0.1, 1, 0}, 0.9);
    expect_as_seen(tilted_quad(), camera, {61, 35}, 0, 0.9, 0.1);
}

TEST_P(GBufferTest, TiltedQuadFarFromTheOrigin) {
    const dvec3 centre(1e6, -3e5, 2e6);
    expect_as_seen(tilted_quad(centre), camera_on_quad(centre), {61, 35}, 0, 0.9, 0.1);
}

TEST_P(GBufferTest, Orthographic) {
    expect_as_seen(tilted_quad(), camera_on_quad(dvec3(0), true), {61, 35}, 3, 0.9, 0.1);
}

TEST_P(GBufferTest, InstancesRotatedScaledAndMirrored) {
    expect_as_seen(pyramids(), camera_on_pyramids(), {160, 120}, 2, 0.85, 0.15);
}

TEST_P(GBufferTest, NearAndFarPlanesClip) {
    Camera camera = camera_on_quad();
    camera.near_plane = 3.6;
    camera.far_plane = 4.2;
    expect_as_seen(tilted_quad(), camera, {61, 35}, 0, 0.8, 0.03);
    camera.orthographic = true;
    camera.ortho_height = 3.9;
    expect_as_seen(tilted_quad(), camera, {61, 35}, 0, 0.8, 0.03);
}

TEST_P(GBufferTest, MaterialRowsAndEmission) {
    Stage stage(programs, tilted_quad(), camera_on_quad(), {33, 17});
    const SurfaceRecord s = render(stage).surfaces[stage.path(16, 8)];
    ASSERT_TRUE(s.is_surface);
    EXPECT_LT(glm::length(s.diffuse - vec3(0.2f, 0.5f, 0.7f)), 1e-6f);
    EXPECT_EQ(s.emission, vec3(0.5f, 0.25f, 2));
    EXPECT_EQ(s.p_diffuse, 1);

    Material metal = metal_material({0.9f, 0.6f, 0.3f}, 0.5f);
    metal.clearcoat = 0.5f;
    metal.clearcoat_roughness = 0.3f;
    Scene scene = floor_scene(metal);
    Stage coated(programs, scene, spot_camera({0, 0, 0}, {0, 1, 0}, 1), {16, 16});
    const SurfaceRecord m = render(coated).surfaces[coated.path(7, 7)];
    ASSERT_TRUE(m.is_surface);
    EXPECT_EQ(m.diffuse, vec3(0));
    EXPECT_EQ(m.p_diffuse, 0);
    EXPECT_NEAR(m.alpha, 0.25, 1e-6);
    EXPECT_NEAR(m.coat_alpha, 0.09, 1e-6);
    // The coat has k M(0.04), where M is within 4 % of 1 (Turquin 2019, eq. 16).
    EXPECT_NEAR(m.coat, 0.51, 0.011);
    EXPECT_LT(glm::length(m.coat_normal - vec3(0, 1, 0)), 1e-6f);
    // The metal is (1 - E_coat) c M(c), M(c) = 1 + c (1 - E_1) / E_1 (SHADING.md); divided by c, it is linear in c.
    const vec3 gain = m.specular / vec3(metal.base_color);
    EXPECT_NEAR(gain.g, 0.5f * (gain.r + gain.b), 1e-5f);
    EXPECT_GT(gain.r, gain.b);
    EXPECT_NEAR(gain.b, 1, 0.05);
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

TEST_P(GBufferTest, TheEnvironmentIsVisibleWithoutSurface) {
    Scene scene = tilted_quad();
    scene.environment.color = {0.5f, 1, 2};
    scene.environment.map = Image(64, 32, 3);
    // The radiance is linear in the direction's height, so bilinear lookups are exact except for its curvature.
    for (int y = 0; y < 32; ++y)
        for (int x = 0; x < 64; ++x)
            for (int c = 0; c < 3; ++c)
                scene.environment.map.at(x, y)[c] = static_cast<float>(2 + std::cos(kPi * (y + 0.5) / 32));
    const Camera camera = camera_on_quad();
    const ivec2 image(40, 30);
    Stage stage(programs, scene, camera, image);
    const Content c = render(stage);
    int misses = 0;
    for (int y = 0; y < image.y; ++y) {
        for (int x = 0; x < image.x; ++x) {
            const std::size_t path = stage.path(x, y);
            if (c.surfaces[path].is_surface) continue;
            ++misses;
            EXPECT_EQ(c.hits[path].triangle, shared::kMiss);
            const double radiance = 2 + c.rays[path].direction.y;
            // Linear interpolation between texel centres has an error of at most h^2 / 8 times the second derivative,
            // which is at most 1 here.
            const double error = kPi / 32 * kPi / 32 / 8 + 1e-5;
            for (int i = 0; i < 3; ++i)
                EXPECT_NEAR(c.surfaces[path].emission[i], radiance * scene.environment.color[i], 2 * error);
        }
    }
    EXPECT_GT(misses, image.x * image.y / 3);
}

TEST_P(GBufferTest, BandsEqualTheWhole) {
    const Scene scene = pyramids();
    const ivec2 image(70, 90);
    Stage stage(programs, scene, camera_on_pyramids(), image);
    SampleView sample;
    sample.band = {image, 0, image.y};
    sample.jitter = {0.3f, 0.8f};
    stage.select_sample(sample);
    const Content whole = render(stage);
    const std::size_t row_bytes = stage.buffers().surface_record_bytes();
    std::vector<std::size_t> path_in_whole;
    for (int y = 0; y < image.y; ++y)
        for (int x = 0; x < image.x; ++x) path_in_whole.push_back(stage.path(x, y));
    for (sample.band = {image, 0, 32}; sample.band.y < image.y; sample.band.y += 32) {
        stage.select_sample(sample);
        const Content part = render(stage);
        for (int y = sample.band.y; y < std::min(sample.band.y + 32, image.y); ++y) {
            for (int x = 0; x < image.x; ++x) {
                const std::size_t a = path_in_whole[static_cast<std::size_t>(y * image.x + x)], b = stage.path(x, y);
                ASSERT_EQ(std::memcmp(&whole.rays[a], &part.rays[b], sizeof(shared::Ray)), 0) << x << ", " << y;
                ASSERT_EQ(std::memcmp(&whole.hits[a], &part.hits[b], sizeof(shared::Hit)), 0) << x << ", " << y;
                const auto bytes = [&](const Content& c, std::size_t path) {
                    return reinterpret_cast<const char*>(c.rows.data()) + path * row_bytes;
                };
                ASSERT_EQ(std::memcmp(bytes(whole, a), bytes(part, b), row_bytes), 0) << x << ", " << y;
            }
        }
    }
}

TEST_P(GBufferTest, PathsOutsideThePictureAreEmpty) {
    Scene scene = floor_scene(diffuse_material(vec3(0.5f)));
    scene.environment.color = vec3(1);
    Stage stage(programs, scene, spot_camera({0, 0, 0}, {0, 1, 0}, 1), {17, 19});
    const Content c = render(stage);
    ASSERT_EQ(c.hits.size(), 1024u);
    std::vector<char> inside(1024);
    for (int y = 0; y < 19; ++y)
        for (int x = 0; x < 17; ++x) inside[stage.path(x, y)] = 1;
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
        for (int y = 0; y < 64; ++y)
            for (int x = 0; x < 64; ++x)
                ASSERT_EQ(c.surfaces[stage.path(x, y)].diffuse.x, front ? 1 : 0) << x << ", " << y;
    }
}

TEST_P(GBufferTest, EmptyScene) {
    Scene scene;
    scene.environment.color = {1, 2, 3};
    Stage stage(programs, scene, look_at_camera({0, 0, 1}, {0, 0, 0}, {0, 1, 0}, 1), {16, 16});
    for (const SurfaceRecord& s : render(stage).surfaces) {
        EXPECT_FALSE(s.is_surface);
        EXPECT_EQ(s.emission, vec3(1, 2, 3));
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

// --- Alpha ----------------------------------------------------------------------------------------------------------

/// Returns a quad that faces the camera in front of a white wall. Half of the quad (s < 1/2) has alpha 0.3.
Scene curtain(AlphaMode mode) {
    Scene scene;
    TextureImage& image = scene.images.emplace_back();
    image.width = 2, image.height = 1;
    image.rgba = {255, 255, 255, 77, 255, 255, 255, 204};  // alpha of 0.302 and 0.8
    Material m = diffuse_material(vec3(0.25f));
    m.base_color_texture.image = 0;
    m.base_color_texture.nearest = true;
    m.alpha_mode = mode;
    add_quad(scene, add_material(scene, m), {-1, -1, 0}, {2, 0, 0}, {0, 2, 0});
    add_quad(scene, add_material(scene, diffuse_material(vec3(1))), {-9, -9, -1}, {18, 0, 0}, {0, 18, 0});
    return scene;
}

TEST_P(GBufferTest, MaskIsTransparentBelowTheCutoff) {
    const ivec2 image(32, 32);
    Stage stage(programs, curtain(AlphaMode::mask), spot_camera({0, 0, 0}, {0, 0, 1}, 2), image);
    const Content c = render(stage);
    for (int y = 0; y < 32; ++y)
        for (int x = 0; x < 32; ++x)
            EXPECT_EQ(c.surfaces[stage.path(x, y)].diffuse.x, x < 16 ? 1 : 0.25f) << x << ", " << y;
}

TEST_P(GBufferTest, BlendIsHitWithProbabilityAlpha) {
    const ivec2 image(32, 32);
    Stage stage(programs, curtain(AlphaMode::blend), spot_camera({0, 0, 0}, {0, 0, 1}, 2), image);
    const int samples = 40;
    int met[2] = {0, 0};
    std::vector<int> of_pixel(image.x * image.y);
    for (std::uint32_t sample = 0; sample < samples; ++sample) {
        stage.select_sample(sample);
        const Content c = render(stage);
        for (int y = 0; y < 32; ++y) {
            for (int x = 0; x < 32; ++x) {
                const bool is_met = c.surfaces[stage.path(x, y)].diffuse.x == 0.25f;
                met[x / 16] += is_met;
                of_pixel[static_cast<std::size_t>(y * 32 + x)] += is_met;
            }
        }
    }
    for (int half = 0; half < 2; ++half) {
        const double alpha = half == 0 ? 77 / 255.0 : 204 / 255.0, count = 512.0 * samples;
        EXPECT_NEAR(met[half] / count, alpha, 4 * std::sqrt(alpha * (1 - alpha) / count));
        // Samples of one pixel are as independent as pixels, so the counts have the binomial variance.
        double variance = 0;
        for (int y = 0; y < 32; ++y)
            for (int x = 16 * half; x < 16 * half + 16; ++x)
                variance += std::pow(of_pixel[static_cast<std::size_t>(y * 32 + x)] - samples * alpha, 2) / 512;
        EXPECT_NEAR(variance / (samples * alpha * (1 - alpha)), 1, 4 * std::sqrt(2 / 512.0));
    }
}

}  // namespace
}  // namespace halflight::test
