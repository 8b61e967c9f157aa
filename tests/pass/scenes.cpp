#include "tests/pass/scenes.h"

#include <glm/gtc/matrix_transform.hpp>

#include <cmath>

namespace halflight::test {

Scene tilted_quad(const dvec3& centre) {
    Scene scene;
    Material m = diffuse_material({0.2f, 0.5f, 0.7f});
    m.emission = {0.5f, 0.25f, 2};
    const vec3 u = 3.0f * glm::normalize(vec3(2, 0.4f, -0.9f));
    const vec3 v = 2.0f * glm::normalize(glm::cross(vec3(0.3f, -0.5f, 1), u));
    const int instance = add_quad(scene, add_material(scene, m), -0.5f * (u + v), u, v);
    scene.instances[static_cast<std::size_t>(instance)].object_to_world[3] = dvec4(centre, 1);
    std::vector<vec3>& normals = scene.meshes[0].normals;
    const vec3 n = normals[0];
    normals = {glm::normalize(n + 0.3f * u), glm::normalize(n - 0.2f * u + 0.1f * v), glm::normalize(n + 0.2f * v),
               glm::normalize(n - 0.3f * v)};
    return scene;
}

Scene thin_strip(double width, int side) {
    Scene scene;
    Material lamp = diffuse_material(vec3(0));
    lamp.emission = vec3(1);
    const int material = add_material(scene, lamp);
    const float pixel = 2.0f / static_cast<float>(side);
    add_quad(scene, material, {-pixel * 8, pixel * 4.3f, 0}, {pixel * 8, 0, 0}, {0, pixel * float(width), 0});
    for (int i = 0; i < 16; ++i)
        add_quad(scene, material, {pixel * float(i), -pixel * 12.7f, 0}, {pixel * 0.37f, 0, 0}, {0, pixel * 9, 0});
    scene.cameras = {spot_camera(dvec3(0), {0, 0, 1}, 2)};
    return scene;
}

Scene shiny_cornell() {
    Scene scene = cornell_box(metal_material({0.9f, 0.7f, 0.4f}, 0.3f));
    scene.environment.color = vec3(0.1f);
    return scene;
}

Camera camera_on_quad(const dvec3& centre, bool orthographic) {
    Camera camera = look_at_camera(centre + dvec3(0.7, 1.4, 3.6), centre + dvec3(0.05, -0.02, 0), {0.1, 1, 0}, 0.9);
    camera.orthographic = orthographic;
    camera.ortho_height = 3.9;
    return camera;
}

Scene pyramids() {
    Scene scene;
    const int material = add_material(scene, diffuse_material(vec3(0.5f)));
    Mesh& mesh = scene.meshes.emplace_back();
    mesh.positions = {{-1, 0, -0.8f}, {1.1f, 0, -1}, {0.9f, 0, 1}, {-0.7f, 0, 1}, {0.2f, 1.7f, 0.1f}};
    for (const vec3& p : mesh.positions) mesh.normals.push_back(glm::normalize(p - vec3(0, 0.4f, 0)));
    mesh.triangles = {{0, 4, 1}, {1, 4, 2}, {2, 4, 3}, {3, 4, 0}, {0, 1, 2}, {0, 2, 3}};
    mesh.triangle_material.assign(6, static_cast<std::uint32_t>(material));
    const auto add = [&](const dvec3& at, double degrees, const dvec3& scale) {
        Instance& i = scene.instances.emplace_back();
        i.mesh = 0;
        i.object_to_world = glm::scale(
            glm::rotate(glm::translate(dmat4(1), at), degrees * kPi / 180, glm::normalize(dvec3(0.4, 1, 0.2))), scale);
    };
    add({0, 0, 0}, 0, {1, 1, 1});
    add({2.6, 0, -1}, 40, {1, 1, 1});
    add({-2.4, 0.3, -0.5}, 75, {0.5, 1.6, 1.2});
    add({0.2, 2, -1}, 0, {-1, 1, 1});
    add({2.4, 2.3, 0.3}, 200, {0.7, -1.1, 0.9});
    return scene;
}

Camera camera_on_pyramids() {
    return look_at_camera({1, 3, 8}, {0.2, 1.3, 0}, {0, 1, 0}, 0.8);
}

Camera spot_camera(const dvec3& at, const dvec3& towards_camera, double size) {
    const dvec3 from = at + 0.5 * glm::normalize(towards_camera);
    const dvec3 up = std::abs(from.y - at.y) > 0.49 ? dvec3(0, 0, -1) : dvec3(0, 1, 0);
    Camera camera = look_at_camera(from, at, up, 1);
    camera.orthographic = true;
    camera.ortho_height = size;
    return camera;
}

Scene floor_scene(const Material& material, float reach) {
    Scene scene;
    add_quad(scene, add_material(scene, material), {-reach, 0, -reach}, {0, 0, 2 * reach}, {2 * reach, 0, 0});
    return scene;
}

Scene closed_box(const Material& material) {
    Scene scene;
    add_box(scene, add_material(scene, material), vec3(-1), vec3(1));
    return scene;
}

Camera camera_in_box() {
    return look_at_camera({0.3, 0.2, 0.5}, {-1, -0.4, -0.6}, {0, 1, 0}, 1.2);
}

}  // namespace halflight::test
