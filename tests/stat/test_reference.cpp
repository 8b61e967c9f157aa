// Tests the oracle's path tracing: closed furnaces, components, determinism, transforms, precision.
#include "engine/reference/reference.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "engine/reference/random.h"
#include "engine/reference/surface.h"
#include "tests/support/image_tests.h"
#include "tests/support/reference_renders.h"
#include "tests/support/scenes.h"

namespace halflight {
namespace {

using namespace test;

/// Expects a mean within four standard errors, and a 95 % interval narrower than +- 0.5 %. A bias of 1.6 % is found
/// with a probability of 99 %, and a correct mean is refused with one of 6e-5.
void expect_mean(const ReferenceResult& result, double expected, const std::string& what) {
    for (int c = 0; c < 3; ++c) {
        const MeanRadiance mean = mean_radiance(result, c);
        EXPECT_NEAR(mean.value, expected, 4 * mean.error + 2e-4 * expected) << what;
        EXPECT_LT(1.96 * mean.error, 0.005 * expected) << what;
    }
    EXPECT_EQ(result.non_finite_samples, 0u) << what;
    EXPECT_EQ(count_non_finite(result.beauty).nans, 0u) << what;
}

Material glowing(double albedo) {
    Material m = diffuse_material(vec3(static_cast<float>(albedo)));
    m.emission = vec3(1);
    return m;
}

TEST(Reference, ClosedBoxSumsTheSeriesOfItsAlbedo) {
    const double albedo = 0.8;
    Scene scene;
    add_box(scene, add_material(scene, glowing(albedo)), vec3(-1), vec3(1));
    const Camera inside = look_at_camera({0.3, 0.2, 0.5}, {-1, -0.4, -0.6}, {0, 1, 0}, 1.2);
    double expected = 0, power = 1;
    for (int bounces = 0; bounces <= 40; ++bounces, power *= albedo) {
        expected += power;
        if (bounces != 0 && bounces != 1 && bounces != 2 && bounces != 5 && bounces != 40) continue;
        const ReferenceResult result = render_oracle(scene, inside, 24, 192, bounces);
        expect_mean(result, expected, "bounces " + std::to_string(bounces));
    }
    EXPECT_NEAR(expected, 1 / (1 - albedo), 1e-3);
}

TEST(Reference, WhiteFurnaceIsOneForEveryMaterial) {
    std::vector<std::pair<const char*, Material>> cases = {{"diffuse", diffuse_material(vec3(1))}};
    for (const float roughness : {0.0f, 0.1f, 0.5f, 1.0f}) {
        cases.emplace_back("metal", metal_material(vec3(1), roughness));
        Material dielectric = metal_material(vec3(1), roughness);
        dielectric.metallic = 0;
        for (const float ior : {1.0f, 1.5f, 2.5f}) {
            dielectric.ior = ior;
            cases.emplace_back("dielectric", dielectric);
        }
        dielectric.specular = 0.4f;
        cases.emplace_back("specular", dielectric);
        dielectric.specular = 1, dielectric.clearcoat = 0.9f, dielectric.clearcoat_roughness = 0.3f;
        cases.emplace_back("clearcoat", dielectric);
        dielectric.transmission = 0.7f;
        cases.emplace_back("transmission under clearcoat", dielectric);
        dielectric.clearcoat = 0;
        cases.emplace_back("transmission", dielectric);
    }
    for (const auto& [name, material] : cases) {
        Scene scene;
        scene.environment.color = vec3(1);
        add_quad(scene, add_material(scene, material), {-50, 0, -50}, {0, 0, 100}, {100, 0, 0});
        for (const double height : {0.3, 4.0}) {  // grazing and steep views; both sides are front sides
            const Camera camera = look_at_camera({2, height == 4.0 ? -height : height, 1}, {0, 0, 0}, {0, 1, 0}, 0.02);
            const std::string what =
                fmt::format("{}, roughness {}, ior {}, height {}", name, material.roughness, material.ior, height);
            const int samples = material.roughness == 1 ? 256 : 128;
            expect_mean(render_oracle(scene, camera, 24, samples, 1), 1, what);
        }
    }
}

TEST(Reference, NoLightLeaksThroughClosedWalls) {
    for (const dvec3& at : {dvec3(0), dvec3(1e6, -3e5, 2e6)}) {
        Scene scene;
        scene.environment.color = vec3(1e9f);
        const int instance = add_box(scene, add_material(scene, diffuse_material(vec3(0.9f))), vec3(-1), {1, 1, 3});
        const double c = std::cos(0.5), s = std::sin(0.5);
        scene.instances[instance].object_to_world =
            dmat4(dvec4(c, s, 0, 0), dvec4(-s * c, c * c, s, 0), dvec4(s * s, -c * s, c, 0), dvec4(at, 1));
        const Camera inside = look_at_camera(at, at + dvec3(1, 0.7, 0.2), {0, 1, 0}, 2.5);
        const ReferenceResult result = render_oracle(scene, inside, 32, 64, 16);
        double leaked = 0;
        for (const float value : result.beauty.pixels) leaked += value > 0;
        EXPECT_EQ(leaked, 0) << "at x = " << at.x;
    }
}

TEST(Reference, ComponentsSumToBeauty) {
    const Scene scene = cornell_box(metal_material({0.9f, 0.7f, 0.4f}, 0.3f));
    const ReferenceResult r = render_oracle(scene, scene.cameras[0], 32, 16, 5);
    double direct_glossy = 0, indirect_glossy = 0;
    for (std::size_t i = 0; i < r.beauty.pixels.size(); ++i) {
        const ReferenceComponents& c = r.components;
        const float sum = c.emission.pixels[i] + c.direct_diffuse.pixels[i] + c.direct_glossy.pixels[i] +
                          c.indirect_diffuse.pixels[i] + c.indirect_glossy.pixels[i];
        EXPECT_NEAR(sum, r.beauty.pixels[i], 1e-5f * (1 + sum));
        direct_glossy += c.direct_glossy.pixels[i], indirect_glossy += c.indirect_glossy.pixels[i];
    }
    EXPECT_GT(direct_glossy, 0);
    EXPECT_GT(indirect_glossy, 0);

    // The picture of one bounce has only direct components, and the metal (instance 7) has no diffuse component.
    const ReferenceResult one = render_oracle(scene, scene.cameras[0], 32, 16, 1);
    for (const float value : one.components.indirect_diffuse.pixels) EXPECT_EQ(value, 0);
    int inner = 0;
    for (std::size_t i = 33; i + 33 < r.aovs.instance.size(); ++i) {
        const std::size_t pixel_and_neighbours[] = {i, i - 1, i + 1, i - 32, i + 32};
        if (std::ranges::any_of(pixel_and_neighbours, [&](std::size_t p) { return r.aovs.instance[p] != 7; })) continue;
        EXPECT_EQ(one.components.direct_diffuse.pixels[3 * i], 0);
        ++inner;
    }
    EXPECT_GT(inner, 10);
}

TEST(Reference, DoesNotDependOnThreadsAndSplitsIntoRanges) {
    const Scene scene = cornell_box();
    const ReferenceScene prepared(scene);
    ReferenceSettings settings;
    settings.width = 40, settings.height = 24, settings.samples = 8, settings.camera = scene.cameras[0];
    const ReferenceResult all = render_reference(prepared, settings);
    for (const int threads : {1, 2, 3}) {
        settings.threads = threads;
        const ReferenceResult other = render_reference(ReferenceScene(scene), settings);
        EXPECT_EQ(all.beauty.pixels, other.beauty.pixels);
        EXPECT_EQ(all.variance.pixels, other.variance.pixels);
    }
    settings.samples = 4;
    const ReferenceResult first = render_reference(prepared, settings);
    settings.first_sample = 4;
    const ReferenceResult second = render_reference(prepared, settings);
    for (std::size_t i = 0; i < all.beauty.pixels.size(); ++i) {
        EXPECT_NEAR(all.beauty.pixels[i], 0.5f * (first.beauty.pixels[i] + second.beauty.pixels[i]),
                    1e-5f * (1 + all.beauty.pixels[i]));
    }
    settings.seed = 5;
    EXPECT_NE(second.beauty.pixels, render_reference(prepared, settings).beauty.pixels);
}

/// Applies a matrix to the instance and its inverse to the mesh.
Scene with_baked_transform(Scene scene, const dmat4& transform) {
    const dmat4 inverse = glm::inverse(transform);
    const dmat3 normals = transpose(dmat3(transform));
    for (Instance& instance : scene.instances) instance.object_to_world = instance.object_to_world * transform;
    for (Mesh& mesh : scene.meshes) {
        for (vec3& p : mesh.positions) p = vec3(inverse * dvec4(p, 1));
        for (vec3& n : mesh.normals) n = vec3(normalize(normals * dvec3(n)));
        for (vec4& t : mesh.tangents) {
            t = vec4(vec3(normalize(dmat3(inverse) * dvec3(t))), determinant(transform) < 0 ? -t.w : t.w);
        }
    }
    return scene;
}

/// Returns a Cornell box whose tall block is a bumpy metal.
Scene bumpy_box() {
    Material bumpy = metal_material({0.9f, 0.8f, 0.6f}, 0.4f);
    bumpy.normal_texture.image = 0;
    Scene scene = cornell_box(bumpy);
    scene.images.push_back({"bumps",
                            2,
                            2,
                            {160, 128, 240, 255, 100, 160, 240, 255,  //
                             128, 90, 240, 255, 150, 150, 230, 255}});
    Mesh& block = scene.meshes.back();
    for (std::size_t i = 0; i < block.normals.size(); i += 4) {
        // t points along u, and v along -cross(n, t).
        const vec3 t = normalize(block.positions[i + 1] - block.positions[i]);
        block.tangents.insert(block.tangents.end(), 4, vec4(t, 1));
    }
    return scene;
}

TEST(Reference, TransformsOfInstancesAndMeshesAreEqual) {
    const Scene scene = bumpy_box();
    const dmat4 mirror(dvec4(-1, 0, 0, 0), dvec4(0, 1, 0, 0), dvec4(0, 0, 1, 0), dvec4(0.3, 0, 0, 1));
    const dmat4 stretch(dvec4(3, 0, 0, 0), dvec4(0.5, 0.2, 0, 0), dvec4(0, 0, -7, 0), dvec4(0, 5, 0, 1));
    for (const auto& [name, transform] : {std::pair{"reference-mirrored", mirror}, {"reference-stretched", stretch}}) {
        Scene still = scene;
        if (transform == stretch) {  // not orthogonal: baking changes tangent frames, so bumps are off
            for (Mesh& mesh : still.meshes) mesh.tangents.clear();
        }
        const Scene moved = with_baked_transform(still, transform);
        const ReferenceResult expected = render_oracle(still, scene.cameras[0], 32, 64, 4);
        const ReferenceResult result = render_oracle(moved, scene.cameras[0], 32, 64, 4, 2);
        EXPECT_TRUE(agree(name, {result.beauty, result.variance, 64}, {expected.beauty, expected.variance, 64},
                          {.block = 8, .relative_difference = 0}));
        // Paths of equal seeds are equal except for rounding.
        const ReferenceResult twin = render_oracle(moved, scene.cameras[0], 32, 64, 4, 1);
        EXPECT_NEAR(mean_radiance(twin).value, mean_radiance(expected).value, 1e-3 * mean_radiance(expected).value);
        int same_normals = 0;
        for (std::size_t i = 0; i < twin.aovs.normal.pixels.size(); ++i) {
            same_normals += std::abs(twin.aovs.normal.pixels[i] - expected.aovs.normal.pixels[i]) < 1e-4f;
        }
        EXPECT_GT(same_normals, 0.995 * static_cast<double>(twin.aovs.normal.pixels.size()));
    }
}

TEST(Reference, WindingAndNormalSignsDoNotMatter) {
    const Scene scene = bumpy_box();
    Scene flipped = scene;
    for (Mesh& mesh : flipped.meshes) {
        for (uvec3& t : mesh.triangles) std::swap(t.y, t.z);
    }
    const ReferenceResult a = render_oracle(scene, scene.cameras[0], 32, 16, 3);
    const ReferenceResult b = render_oracle(flipped, scene.cameras[0], 32, 16, 3);
    for (std::size_t i = 0; i < a.aovs.normal.pixels.size(); ++i) {
        ASSERT_NEAR(a.aovs.normal.pixels[i], b.aovs.normal.pixels[i], 1e-5f);
    }
    EXPECT_TRUE(agree("reference-winding", {a.beauty, a.variance, 16}, {b.beauty, b.variance, 16}, {.block = 8}));
}

TEST(Reference, FarFromTheOriginLooksLikeTheOrigin) {
    const dvec3 far(1e6, 2e6, -3e6);
    const Scene scene = cornell_box();
    Scene moved = scene;
    for (Instance& instance : moved.instances) instance.object_to_world[3] += dvec4(far, 0);
    moved.cameras[0].camera_to_world[3] += dvec4(far, 0);
    const ReferenceResult a = render_oracle(scene, scene.cameras[0], 32, 64, 4, 1);
    const ReferenceResult b = render_oracle(moved, moved.cameras[0], 32, 64, 4, 2);
    EXPECT_TRUE(agree("reference-far", {b.beauty, b.variance, 64}, {a.beauty, a.variance, 64}, {.block = 4}));
    for (std::size_t i = 0; i < a.aovs.position.pixels.size(); ++i) {
        ASSERT_NEAR(a.aovs.position.pixels[i], b.aovs.position.pixels[i], 1e-5f);
    }
}

TEST(Reference, DistantCamerasArePrecise) {
    const Scene scene = cornell_box();
    const dvec3 from(1.1e5 + 0.3, 2.3e5 + 0.7, 1e6 + 0.1);
    const Camera camera = look_at_camera(from, {0, 0, 0}, {0, 1, 0}, 1.2e-6);
    const ReferenceResult result = render_oracle(scene, camera, 8, 1, 0);
    const dmat4 world_to_camera = glm::inverse(camera.camera_to_world);
    const ReferenceScene prepared(scene);
    for (int y = 0; y < 8; ++y) {
        for (int x = 0; x < 8; ++x) {  // the hit must be on the ray through the pixel's centre
            const dvec3 ray((2 * (x + 0.5) / 8 - 1) * std::tan(0.6e-6), (1 - 2 * (y + 0.5) / 8) * std::tan(0.6e-6), -1);
            const auto hit = prepared.closest_hit({from, dmat3(camera.camera_to_world) * ray});
            ASSERT_TRUE(hit);
            const Mesh& mesh = scene.meshes[scene.instances[hit->instance].mesh];
            const uvec3 t = mesh.triangles[hit->triangle];
            const dvec3 local = (1 - hit->u - hit->v) * dvec3(mesh.positions[t.x]) +
                                hit->u * dvec3(mesh.positions[t.y]) + hit->v * dvec3(mesh.positions[t.z]);
            const dvec3 seen(world_to_camera * scene.instances[hit->instance].object_to_world * dvec4(local, 1));
            const double pixel = 2 * std::tan(0.6e-6) / 8;
            EXPECT_NEAR(-seen.x / seen.z, ray.x, 1e-3 * pixel);
            EXPECT_NEAR(-seen.y / seen.z, ray.y, 1e-3 * pixel);
            EXPECT_EQ(hit->instance, result.aovs.instance[8 * y + x]);
        }
    }
}

TEST(Reference, RaysLeavingASurfaceDoNotHitIt) {
    // Quads have all sizes, down to slivers, at all distances from the origin. Angles are 1e-6 radians or more.
    reference::Random random(5);
    const auto anywhere = [&] {
        const double x = random.uniform(), y = random.uniform();
        return dvec3(x, y, random.uniform()) - 0.5;
    };
    int tried = 0, met = 0;
    for (int i = 0; i < 200; ++i) {
        const double aspect = std::pow(10, -5 * random.uniform()), size = std::pow(10, 4 * random.uniform() - 2);
        const double distance = std::pow(10, 3 * random.uniform() - 1);
        const dvec3 p = anywhere() * distance, u = anywhere() * size;
        const dvec3 v = normalize(cross(u, anywhere())) * length(u) * aspect;
        Scene scene;
        const int material = add_material(scene, diffuse_material(vec3(1)));
        add_quad(scene, material, vec3(p), vec3(u), vec3(v));
        // This quad shifts the centre of the scene.
        add_quad(scene, material, vec3(p + 10 * distance), {0.1f, 0, 0}, {0, 0.1f, 0});
        const reference::Tracer tracer(scene);
        for (int j = 0; j < 1000; ++j) {
            const reference::TriangleId id{0, j % 2};
            const auto corners = tracer.corners(id);
            const dvec3 area = cross(corners[1] - corners[0], corners[2] - corners[0]);
            if (!(length(area) > 0)) continue;  // a quad rounded to area 0 is never hit
            const dvec3 n = random.uniform() < 0.5 ? normalize(area) : -normalize(area);
            const double root = std::sqrt(random.uniform()), split = random.uniform();
            const ReferenceHit point{0, root * (1 - split), root * split, id.instance, id.triangle};
            const reference::Surface surface = make_surface(tracer, point, n);
            const double mu = std::pow(10, -6 * random.uniform()), phi = 2 * kPi * random.uniform();
            const dvec3 along = std::sqrt(1 - mu * mu) * dvec3(std::cos(phi), std::sin(phi), 0);
            const dvec3 direction = reference::Frame(n).to_world({along.x, along.y, mu});
            const auto hit = tracer.closest_hit({surface.leave(direction), direction}, {});
            ++tried;
            met += hit && hit->instance == 0;
        }
    }
    EXPECT_GT(tried, 100000);
    EXPECT_EQ(met, 0);
}

TEST(Reference, AlphaAndUnlitAreApplied) {
    Scene scene;
    scene.environment.color = vec3(3);
    Material paint;
    paint.unlit = true;
    paint.base_color = {0.25f, 0.5f, 1, 0.5f};
    paint.alpha_mode = AlphaMode::blend;
    add_quad(scene, add_material(scene, paint), {-1, -1, 0}, {2, 0, 0}, {0, 2, 0});
    const Camera camera = look_at_camera({0, 0, 2}, {0, 0, 0}, {0, 1, 0}, 0.3);
    const ReferenceResult result = render_oracle(scene, camera, 16, 256, 4);
    for (int c = 0; c < 3; ++c) {
        const MeanRadiance mean = mean_radiance(result, c);
        EXPECT_NEAR(mean.value, 0.5 * paint.base_color[c] + 0.5 * 3, 4 * mean.error);
        EXPECT_LT(mean.error, 0.01);
    }
    EXPECT_NEAR(*result.alpha.at(3, 4), 0.5, 0.2);

    scene.materials[0].alpha_mode = AlphaMode::mask;
    EXPECT_EQ(mean_radiance(render_oracle(scene, camera, 4, 4, 4)).value, 0.25);  // 0.5 >= 0.5: opaque
    scene.materials[0].alpha_cutoff = 0.51f;
    EXPECT_EQ(mean_radiance(render_oracle(scene, camera, 4, 4, 4)).value, 3);
    scene.materials[0].alpha_mode = AlphaMode::opaque;
    EXPECT_EQ(mean_radiance(render_oracle(scene, camera, 4, 4, 4)).value, 0.25);
}

TEST(Reference, OutputsOfThePixelCentre) {
    Scene scene;
    Material material = diffuse_material({0.2f, 0.4f, 0.6f});
    add_quad(scene, add_material(scene, material), {-4, -4, -3}, {8, 0, 0}, {0, 8, 0});
    scene.meshes[0].colors.assign(4, vec4(0.5f, 1, 1, 1));
    Camera camera;
    camera.orthographic = true;
    camera.ortho_height = 4;
    camera.camera_to_world[3] = dvec4(10, 0, 1, 1);
    scene.instances[0].object_to_world[3] = dvec4(10, 0, 0, 1);
    const ReferenceResult r = render_oracle(scene, camera, 4, 1, 0);
    // Embree's distances and barycentric coordinates have the precision of floats, and their last bits depend on the
    // processor.
    EXPECT_NEAR(*r.aovs.depth.at(1, 0), 4, 2e-6);
    EXPECT_NEAR(r.aovs.position.at(1, 0)[0], -0.5, 2e-6);
    EXPECT_NEAR(r.aovs.position.at(1, 0)[1], 1.5, 2e-6);
    EXPECT_EQ(r.aovs.normal.at(3, 3)[2], 1);
    EXPECT_FLOAT_EQ(r.aovs.albedo.at(3, 3)[0], 0.1f);
    EXPECT_EQ(r.aovs.instance[0], 0);
    EXPECT_EQ(r.aovs.triangle[0], 1);

    camera.near_plane = 4.5;  // the near plane clips the wall
    EXPECT_EQ(*render_oracle(scene, camera, 4, 1, 0).alpha.at(0, 0), 0);
    camera.near_plane = 0;
    camera.far_plane = 3.5;
    EXPECT_EQ(*render_oracle(scene, camera, 4, 1, 0).alpha.at(0, 0), 0);
}

TEST(Reference, HitsAreDecidedByTheLowerTriangleAndByTheCaller) {
    Scene scene;
    const int plain = add_material(scene, diffuse_material(vec3(1)));
    Material veil = diffuse_material(vec3(1));
    veil.alpha_mode = AlphaMode::blend;
    veil.base_color.a = 0.5f;
    for (int i = 0; i < 5; ++i) add_quad(scene, plain, {-1, -1, 0}, {2, 0, 0}, {0, 2, 0});  // five coincident quads
    add_quad(scene, add_material(scene, veil), {-1, -1, 1}, {2, 0, 0}, {0, 2, 0});
    const ReferenceScene prepared(scene);
    const ReferenceRay ray{{0.25, 0.125, 5}, {0, 0, -2}, 0, 100};
    const auto never = +[](std::uint64_t, std::uint32_t, std::uint32_t) { return 0.75; };
    const auto always = +[](std::uint64_t, std::uint32_t, std::uint32_t) { return 0.25; };
    const auto through = prepared.closest_hit(ray, {0, never});
    ASSERT_TRUE(through);
    EXPECT_EQ(through->instance, 0);
    EXPECT_EQ(through->triangle, 0);
    EXPECT_NEAR(through->t, 2.5, 1e-6);
    EXPECT_EQ(prepared.closest_hit(ray, {0, always})->instance, 5);
    ReferenceRay before = ray;
    before.t_max = 2.25;
    EXPECT_TRUE(prepared.occluded(before, {0, always}));
    EXPECT_FALSE(prepared.occluded(before, {0, never}));
    int hits = 0;
    for (std::uint64_t key = 0; key < 1000; ++key) hits += prepared.occluded(before, {key});
    EXPECT_NEAR(hits, 500, 4 * std::sqrt(250.0));
}

TEST(Reference, EmptyScenesAndInvalidSettings) {
    const Scene empty;
    const ReferenceResult nothing = render_oracle(empty, Camera{}, 4, 2, 8);
    EXPECT_EQ(mean_radiance(nothing).value, 0);
    EXPECT_EQ(nothing.aovs.instance[0], kNone);
    EXPECT_THROW(render_oracle(empty, Camera{}, 0, 1, 1), std::exception);
    EXPECT_THROW(render_oracle(empty, Camera{}, 4, 0, 1), std::exception);
    EXPECT_THROW(render_oracle(empty, Camera{}, 4, 1, -1), std::exception);
}

/// A point of a profile in the plane z = 0, and the normal there.
struct ProfilePoint {
    dvec2 position, normal;
};

/// Returns the direction of +Y turned towards -X.
dvec2 turned_up(double degrees) {
    return {-std::sin(glm::radians(degrees)), std::cos(glm::radians(degrees))};
}

/// Adds a strip of triangles along a profile from z = -6 to 0. Each side becomes `pieces` long pieces of the cubic
/// curve that has the normals of its ends. With one piece, vertex normals are those of the profile.
void add_strip(Scene& scene, int material, const std::vector<ProfilePoint>& profile, int pieces) {
    Mesh mesh;
    const auto add = [&](const dvec2& point, const dvec2& normal) {
        for (const float z : {-6.0f, 0.0f}) {
            mesh.positions.emplace_back(point.x, point.y, z);
            mesh.normals.push_back(glm::normalize(vec3(vec2(normal), 0)));
        }
    };
    for (std::size_t i = 0; i + 1 < profile.size(); ++i) {
        const auto& [a, a_normal] = profile[i];
        const auto& [b, b_normal] = profile[i + 1];
        const dvec2 p = (2.0 * a + b - glm::dot(b - a, a_normal) * a_normal) / 3.0;  // control points (Vlachos 2001)
        const dvec2 q = (2.0 * b + a - glm::dot(a - b, b_normal) * b_normal) / 3.0;
        for (int k = i > 0; k <= pieces; ++k) {
            const double t = double(k) / pieces, r = 1 - t;
            const dvec2 along = r * r * (p - a) + 2 * r * t * (q - p) + t * t * (b - q);
            const dvec2 normal = k == 0 ? a_normal : k == pieces ? b_normal : dvec2(-along.y, along.x);
            add(r * r * r * a + 3 * r * r * t * p + 3 * r * t * t * q + t * t * t * b, normal);
        }
    }
    for (std::uint32_t i = 0; i + 3 < mesh.positions.size(); i += 2) {
        mesh.triangles.insert(mesh.triangles.end(), {{i, i + 1, i + 3}, {i, i + 3, i + 2}});
        mesh.triangle_material.insert(mesh.triangle_material.end(), 2, static_cast<std::uint32_t>(material));
    }
    scene.instances.emplace_back().mesh = static_cast<int>(scene.meshes.size());
    scene.meshes.push_back(std::move(mesh));
}

PunctualLight sun_along(const vec3& direction) {
    PunctualLight sun;
    sun.type = LightType::directional;
    sun.direction = glm::normalize(direction);
    sun.intensity = vec3(1);
    return sun;
}

TEST(Reference, RaysFromASmoothBallStartAtItsSphere) {
    Scene scene;
    add_smooth_ball(scene, add_material(scene, diffuse_material(vec3(0.8f))), vec3(0), 1, 6);
    const reference::Tracer tracer(scene);
    double deepest = 1;
    for (int i = 0; i < 500; ++i) {
        const double y = 1 - (2 * i + 1) / 500.0, turn = 2.4 * i;
        const dvec3 out(std::sqrt(1 - y * y) * std::cos(turn), y, std::sqrt(1 - y * y) * std::sin(turn));
        const auto hit = tracer.closest_hit({2.0 * out, -out}, {});
        const reference::Surface s = make_surface(tracer, hit.value(), out);
        deepest = std::min(deepest, glm::length(s.seen));
        EXPECT_NEAR(glm::length(s.position), 1, 0.02) << i;
        EXPECT_GT(glm::dot(s.n_g, out), 0.99) << i;
    }
    EXPECT_LT(deepest, 0.94);
}

TEST(Reference, SmoothMeshesAreNoBrighterThanTheirSubdivision) {
    std::vector<ProfilePoint> column;
    for (int i = 0; i <= 8; ++i) column.push_back({0.8 * turned_up(90 - 22.5 * i), turned_up(90 - 22.5 * i)});
    const double width = 1 / std::tan(glm::radians(65.0));
    const std::vector<ProfilePoint> bank = {
        {{-2, 0}, turned_up(0)}, {{0, 0}, turned_up(40)}, {{width, 1}, turned_up(25)}, {{2.5, 1}, turned_up(0)}};
    const Camera at_column = look_at_camera({0.6, 3.2, -0.5}, {0, 0.6, -0.3}, {0, 0, 1}, 0.6);
    const Camera at_bank = look_at_camera({-1.5, 1.2, -3}, {width / 2, 0.5, -3.3}, {0, 1, 0}, 0.6);
    const struct {
        const char* name;
        const std::vector<ProfilePoint>& profile;
        const Camera& camera;
        float sky;
        std::vector<PunctualLight> suns;
        double least, most;  // brightness relative to the subdivision
    } cases[] = {{"column under a slab", column, at_column, 0, {sun_along({-0.5f, -0.4f, -1})}, 0.98, 1.02},
                 {"bank under the sky", bank, at_bank, 1, {}, 0.96, 1.01},
                 {"bank in the sun", bank, at_bank, 0, {sun_along({-0.55f, -1, 0})}, 0.8, 1.02}};
    for (const auto& [name, profile, camera, sky, suns, least, most] : cases) {
        double found[2];
        for (const int pieces : {1, 24}) {
            Scene scene;
            scene.environment.color = vec3(sky);
            scene.lights = suns;
            const int material = add_material(scene, diffuse_material(vec3(0.7f)));
            add_strip(scene, material, profile, pieces);
            if (&profile == &column) add_quad(scene, material, {-1.1f, -0.5f, 0}, {2.2f, 0, 0}, {0, 1.6f, 0});
            found[pieces > 1] = mean_radiance(render_oracle(scene, camera, 32, 24, 4)).value;
        }
        EXPECT_GT(found[0], least * found[1]) << name;
        EXPECT_LT(found[0], most * found[1]) << name;
    }
}

}  // namespace
}  // namespace halflight
