// Tests scenes: validation, bounds, lights, sky, cameras, and previous positions of points of moving surfaces.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <glm/gtc/matrix_transform.hpp>

#include "engine/scene/motion.h"
#include "engine/scene/scene.h"
#include "tests/unit/renderer/refusal.h"

namespace halflight {
namespace {

/// Returns a valid scene with one triangle and one instance.
Scene good_scene() {
    Scene scene;
    scene.images.push_back({"white", 1, 1, {255, 255, 255, 255}});
    scene.materials.emplace_back().base_color_texture.image = 0;
    Mesh& mesh = scene.meshes.emplace_back();
    mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    mesh.normals.assign(3, {0, 0, 1});
    mesh.tangents.assign(3, {1, 0, 0, -1});
    mesh.uvs[0].assign(3, vec2(0.5f));
    mesh.colors.assign(3, vec4(1));
    mesh.triangles = {{0, 1, 2}};
    mesh.triangle_material = {0};
    scene.instances.push_back({"triangle", 0, dmat4(1), 0});
    scene.lights.emplace_back();
    scene.cameras.emplace_back();
    return scene;
}

TEST(SceneValidation, NamesInvalidElements) {
    EXPECT_NO_THROW(validate(good_scene()));
    EXPECT_NO_THROW(validate(Scene()));
    constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
    const std::pair<const char*, std::function<void(Scene&)>> cases[] = {
        {"images[0].rgba", [](Scene& s) { s.images[0].rgba.edit().pop_back(); }},
        {"images[0].width", [](Scene& s) { s.images[0].width = 0; }},
        {"materials[0].base_color_texture", [](Scene& s) { s.materials[0].base_color_texture.image = 1; }},
        {"materials[0].normal_texture", [](Scene& s) { s.materials[0].normal_texture.image = -2; }},
        {"materials[0].base_color_texture", [](Scene& s) { s.materials[0].base_color_texture.uv_set = 2; }},
        {"materials[0].base_color_texture",
         [](Scene& s) { s.materials[0].base_color_texture.uv_transform[2].y = kNan; }},
        {"meshes[0].normals", [](Scene& s) { s.meshes[0].normals.pop_back(); }},
        {"meshes[0].normals[1]", [](Scene& s) { s.meshes[0].normals[1] = vec3(0, 0, 2); }},
        {"meshes[0].positions[2]", [](Scene& s) { s.meshes[0].positions[2].x = kInfinity; }},
        {"meshes[0].tangents[0]", [](Scene& s) { s.meshes[0].tangents[0].w = 0; }},
        {"meshes[0].uvs[1]", [](Scene& s) { s.meshes[0].uvs[1].resize(2); }},
        {"meshes[0].uvs[0][1]", [](Scene& s) { s.meshes[0].uvs[0][1].y = kNan; }},
        {"meshes[0].colors[2]", [](Scene& s) { s.meshes[0].colors[2].a = 1.5f; }},
        {"meshes[0].triangles[0]", [](Scene& s) { s.meshes[0].triangles[0].z = 3; }},
        {"meshes[0].triangles[0]", [](Scene& s) { s.meshes[0].positions[2] = vec3(2, 0, 0); }},
        {"meshes[0].triangle_material[0]", [](Scene& s) { s.meshes[0].triangle_material[0] = 1; }},
        {"meshes[0].triangle_material", [](Scene& s) { s.meshes[0].triangle_material.clear(); }},
        {"instances[0].mesh", [](Scene& s) { s.instances[0].mesh = 1; }},
        {"instances[0].mesh", [](Scene& s) { s.instances[0].mesh = kNone; }},
        {"instances[0].object_to_world", [](Scene& s) { s.instances[0].object_to_world[1].z = kNan; }},
        {"instances[0].object_to_world", [](Scene& s) { s.instances[0].object_to_world[1].w = 1; }},
        {"lights[0].intensity", [](Scene& s) { s.lights[0].intensity.r = -1; }},
        {"lights[0].direction", [](Scene& s) { s.lights[0].direction = vec3(0); }},
        {"lights[0].outer_cone", [](Scene& s) { s.lights[0].inner_cone = s.lights[0].outer_cone; }},
        {"lights[0].outer_cone", [](Scene& s) { s.lights[0].outer_cone = 2; }},
        {"lights[0].inner_cone", [](Scene& s) { s.lights[0].inner_cone = -1; }},
        {"lights[0].inner_cone", [](Scene& s) { s.lights[0].inner_cone = kNan; }},
        {"cameras[0].camera_to_world", [](Scene& s) { s.cameras[0].camera_to_world[0].x = 2; }},
        {"cameras[0].vertical_fov", [](Scene& s) { s.cameras[0].vertical_fov = 0; }},
        {"cameras[0].far_plane", [](Scene& s) { s.cameras[0].near_plane = 2, s.cameras[0].far_plane = 1; }},
        {"environment.color", [](Scene& s) { s.environment.color.b = -1; }},
        {"environment.map", [](Scene& s) { s.environment.map = Image(2, 1, 1); }}};
    for (const auto& [subject, spoil] : cases) {
        Scene scene = good_scene();
        spoil(scene);
        expect_refusal([&] { validate(scene); }, std::string(subject) + ": ");
    }
}

TEST(SceneBounds, ContainAllInstances) {
    Scene scene = good_scene();
    scene.instances.push_back({"far", 0, glm::translate(dmat4(1), dvec3(1e6, 0, -2)), 0});
    scene.instances.push_back({"mirrored", 0, glm::scale(dmat4(1), dvec3(-3, 1, 1)), 0});
    const WorldBounds bounds = world_bounds(scene);
    EXPECT_EQ(bounds.lower, dvec3(-3, 0, -2));
    EXPECT_EQ(bounds.upper, dvec3(1e6 + 1, 1, 0));
    EXPECT_TRUE(world_bounds(Scene()).empty());
}

TEST(SceneLight, IsDetectedFromEverySource) {
    Scene dark = good_scene();
    dark.lights.clear();
    EXPECT_FALSE(has_light(dark));
    Scene glowing = dark, unlit = dark, lamp = dark, sky = dark;
    glowing.materials[0].emission = {0, 0.1f, 0};
    EXPECT_TRUE(has_light(glowing) && has_emission(glowing.materials[0]));
    glowing.instances.clear();
    EXPECT_FALSE(has_light(glowing)) << "no instance uses the emitter";
    unlit.materials[0].unlit = true;
    EXPECT_TRUE(has_light(unlit));
    unlit.materials[0].emission = vec3(1);
    EXPECT_FALSE(has_emission(unlit.materials[0])) << "unlit surfaces show their base colour only";
    lamp.lights.emplace_back().intensity = vec3(0);
    EXPECT_FALSE(has_light(lamp));
    lamp.lights[0].intensity = vec3(0, 0, 1);
    EXPECT_TRUE(has_light(lamp));
    sky.environment = default_sky();
    EXPECT_TRUE(has_light(sky));
}

TEST(SceneCamera, LooksFromAPointAtAPoint) {
    const Camera camera = look_at_camera({1, 2, 3}, {1, 2, -5}, {0, 7, 7}, 1.0);
    EXPECT_EQ(camera.camera_to_world, glm::translate(dmat4(1), dvec3(1, 2, 3)));
    const Camera down = look_at_camera({0, 5, 0}, {0, 0, 0}, {0, 0, -1}, 1.0);
    EXPECT_EQ(dvec3(down.camera_to_world[2]), dvec3(0, 1, 0));
    EXPECT_EQ(dvec3(down.camera_to_world[0]), dvec3(1, 0, 0));
}

TEST(SceneCamera, LengthsOfDirectionsDoNotMatter) {
    const dvec3 from(0), at(0.3, -0.2, -1), up(0.1, 1, 0.7);
    const dmat4 view = look_at_camera(from, at, up, 1).camera_to_world;
    for (const double scale : {std::ldexp(1.0, -600), std::ldexp(1.0, 600)}) {
        EXPECT_EQ(look_at_camera(from, at, scale * up, 1).camera_to_world, view);
        EXPECT_EQ(look_at_camera(from, scale * at, up, 1).camera_to_world, view);
    }
}

TEST(SceneCamera, RefusesDegenerateViews) {
    const dvec3 a(0), b(0, 0, -1), up(0, 1, 0);
    const auto refuse = [](const dvec3& from, const dvec3& at, const dvec3& upwards, double fov, const char* element) {
        expect_refusal([&] { look_at_camera(from, at, upwards, fov); }, element);
    };
    refuse(a, a, up, 1, "same point");
    refuse(a, b, dvec3(0, 0, 3), 1, "up");
    refuse(a, b, dvec3(0), 1, "up");
    refuse(a, b, up, 0, "field of view");
    refuse(a, b, up, kPi, "field of view");
    refuse(a, dvec3(NAN), up, 1, "finite");
}

TEST(SceneCamera, FramesTheWholeScene) {
    Scene scene = good_scene();
    scene.instances[0].object_to_world = glm::scale(glm::translate(dmat4(1), dvec3(100, -20, 7)), dvec3(1, 50, 3));
    scene.instances.push_back({"other", 0, glm::translate(dmat4(1), dvec3(90, 0, 9)), 0});
    const Camera camera = framing_camera(scene);
    EXPECT_GT(camera.camera_to_world[2].x, 0);
    EXPECT_GT(camera.camera_to_world[2].y, 0);
    EXPECT_GT(camera.camera_to_world[2].z, 0);
    const dmat4 world_to_camera = glm::inverse(camera.camera_to_world);
    dvec2 lower(0), upper(0);  // bounds of the scene in the picture, whose edges are at -1 and 1
    for (const Instance& instance : scene.instances)
        for (const vec3& p : scene.meshes[static_cast<std::size_t>(instance.mesh)].positions) {
            const dvec3 q(world_to_camera * instance.object_to_world * dvec4(p, 1));
            ASSERT_LT(q.z, 0);
            const dvec2 seen = dvec2(q) / (std::tan(camera.vertical_fov / 2) * -q.z);
            lower = glm::min(lower, seen), upper = glm::max(upper, seen);
        }
    const int axis = upper.x > upper.y ? 0 : 1;
    EXPECT_NEAR(upper[axis], 0.9, 1e-9) << "a margin of a tenth, and not farther away than necessary";
    EXPECT_NEAR(lower[axis], -0.9, 1e-9) << "the scene is in the middle";
    EXPECT_TRUE(lower[1 - axis] >= -0.9 && upper[1 - axis] <= 0.9);
    EXPECT_NO_THROW(framing_camera(Scene()));
}

/// Returns two instances, at nodes 3 and 5, of a mesh of two triangles.
Scene pair_of_squares() {
    Scene scene;
    Mesh mesh;
    mesh.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    scene.meshes.push_back(mesh);
    scene.instances = {{"a", 0, dmat4(1), 3}, {"b", 0, glm::translate(dmat4(1), dvec3(0, 0, 7)), 5}};
    return scene;
}

TEST(PreviousSurfaces, StaticSurfacesHaveNoMotion) {
    const Scene now = pair_of_squares();
    const PreviousSurfaces surfaces(now, pair_of_squares());
    EXPECT_FALSE(surfaces.moved(0));
    EXPECT_FALSE(surfaces.moved(1));
}

TEST(PreviousSurfaces, FollowsNodesAndCorners) {
    const Scene now = pair_of_squares();
    Scene before = now;
    std::swap(before.instances[0], before.instances[1]);  // nodes identify the instances
    before.instances[0].object_to_world = glm::scale(dmat4(1), dvec3(2, 1, 1));
    PreviousSurfaces turned(now, before);
    EXPECT_FALSE(turned.moved(0));
    ASSERT_TRUE(turned.moved(1));
    EXPECT_LT(glm::distance(turned.before(1, 0, {0.75, 0.25, 7}), dvec3(1.5, 0.25, 0)), 1e-15);
    EXPECT_LT(glm::distance(turned.before(1, 1, {0.25, 0.75, 7 + 1e-3}), dvec3(0.5, 0.75, 0)), 1e-12)
        << "beside its plane, as rounding may have it";

    Scene bent = pair_of_squares();
    bent.meshes[0].positions[2].z = 4;
    PreviousSurfaces deformed(now, bent);
    ASSERT_TRUE(deformed.moved(0));
    EXPECT_LT(glm::distance(deformed.before(0, 0, {0.75, 0.25, 0}), dvec3(0.75, 0.25, 1)), 1e-15);
}

TEST(PreviousSurfaces, UnmatchedInstancesCountAsStatic) {
    const Scene now = pair_of_squares();
    Scene before = now;
    before.instances[0].node = 4;
    before.meshes[0].triangles.pop_back();
    before.instances[1].object_to_world = glm::scale(dmat4(1), dvec3(2, 1, 1));
    const PreviousSurfaces surfaces(now, before);
    EXPECT_FALSE(surfaces.moved(0)) << "was not there";
    EXPECT_FALSE(surfaces.moved(1)) << "other triangles";
}

}  // namespace
}  // namespace halflight
