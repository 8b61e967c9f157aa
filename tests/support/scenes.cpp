#include "tests/support/scenes.h"

#include <cmath>

namespace halflight::test {

Material diffuse_material(const vec3& albedo) {
    Material m;
    m.base_color = vec4(albedo, 1);
    m.metallic = 0;
    m.specular = 0;
    m.double_sided = true;
    return m;
}

Material metal_material(const vec3& albedo, float roughness) {
    Material m;
    m.base_color = vec4(albedo, 1);
    m.roughness = roughness;
    m.double_sided = true;
    return m;
}

Material glass_material(float roughness, float ior) {
    Material m;
    m.metallic = 0;
    m.roughness = roughness;
    m.ior = ior;
    m.transmission = 1;
    m.thickness = 1;
    return m;
}

Material light_material(const vec3& radiance) {
    Material m = diffuse_material(vec3(0));
    m.emission = radiance;
    return m;
}

int add_material(Scene& scene, const Material& material) {
    scene.materials.push_back(material);
    return static_cast<int>(scene.materials.size()) - 1;
}

namespace {

void append_quad(Mesh& mesh, int material, const vec3& p, const vec3& u, const vec3& v) {
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    mesh.positions.insert(mesh.positions.end(), {p, p + u, p + u + v, p + v});
    mesh.normals.insert(mesh.normals.end(), 4, normalize(cross(u, v)));
    mesh.uvs[0].insert(mesh.uvs[0].end(), {vec2(0, 0), vec2(1, 0), vec2(1, 1), vec2(0, 1)});
    mesh.triangles.insert(mesh.triangles.end(), {first + uvec3(0, 1, 2), first + uvec3(0, 2, 3)});
    mesh.triangle_material.insert(mesh.triangle_material.end(), 2, static_cast<std::uint32_t>(material));
}

int add_instance(Scene& scene, Mesh mesh) {
    scene.meshes.push_back(std::move(mesh));
    Instance instance;
    instance.mesh = static_cast<int>(scene.meshes.size()) - 1;
    scene.instances.push_back(instance);
    return static_cast<int>(scene.instances.size()) - 1;
}

}  // namespace

int add_quad(Scene& scene, int material, const vec3& p, const vec3& u, const vec3& v) {
    Mesh mesh;
    append_quad(mesh, material, p, u, v);
    return add_instance(scene, std::move(mesh));
}

int add_box(Scene& scene, int material, const vec3& lower, const vec3& upper) {
    const vec3 size = upper - lower, x(size.x, 0, 0), y(0, size.y, 0), z(0, 0, size.z);
    Mesh mesh;
    append_quad(mesh, material, lower, y, x);
    append_quad(mesh, material, lower, z, y);
    append_quad(mesh, material, lower, x, z);
    append_quad(mesh, material, lower + z, x, y);
    append_quad(mesh, material, lower + x, y, z);
    append_quad(mesh, material, lower + y, z, x);
    return add_instance(scene, std::move(mesh));
}

int add_ball(Scene& scene, int material, const vec3& centre, float radius, int rings) {
    Mesh mesh;
    const int columns = 2 * rings;
    const auto at = [&](int row, int column) {
        const double polar = kPi * row / rings, turn = 2 * kPi * (column % columns) / columns;
        return centre +
               radius * vec3(std::sin(polar) * std::cos(turn), std::cos(polar), std::sin(polar) * std::sin(turn));
    };
    const auto add = [&](const vec3& a, const vec3& b, const vec3& c) {
        const auto first = static_cast<std::uint32_t>(mesh.positions.size());
        mesh.positions.insert(mesh.positions.end(), {a, b, c});
        mesh.normals.insert(mesh.normals.end(), 3, glm::normalize(glm::cross(b - a, c - a)));
        mesh.triangles.emplace_back(first, first + 1, first + 2);
        mesh.triangle_material.push_back(static_cast<std::uint32_t>(material));
    };
    for (int row = 0; row < rings; ++row) {
        for (int column = 0; column < columns; ++column) {
            const vec3 a = at(row, column), b = at(row, column + 1), c = at(row + 1, column + 1),
                       d = at(row + 1, column);
            if (row > 0) add(a, b, c);
            if (row < rings - 1) add(a, c, d);
        }
    }
    return add_instance(scene, std::move(mesh));
}

int add_smooth_ball(Scene& scene, int material, const vec3& centre, float radius, int rings) {
    const int ball = add_ball(scene, material, centre, radius, rings);
    Mesh& mesh = scene.meshes.back();
    for (std::size_t i = 0; i < mesh.positions.size(); ++i)
        mesh.normals[i] = glm::normalize(mesh.positions[i] - centre);
    return ball;
}

Scene cornell_box(const Material& tall) {
    Scene scene;
    scene.name = "cornell box";
    const int white = add_material(scene, diffuse_material(vec3(0.73f)));
    const int red = add_material(scene, diffuse_material({0.63f, 0.06f, 0.05f}));
    const int green = add_material(scene, diffuse_material({0.14f, 0.45f, 0.09f}));
    const int light = add_material(scene, light_material({17, 12, 4}));
    const int block = add_material(scene, tall);
    const vec3 x(2, 0, 0), y(0, 2, 0), z(0, 0, 2);
    add_quad(scene, white, {-1, -1, -1}, z, x);  // floor
    add_quad(scene, white, {-1, 1, -1}, x, z);   // ceiling
    add_quad(scene, white, {-1, -1, -1}, x, y);  // back
    add_quad(scene, red, {-1, -1, -1}, y, z);    // left
    add_quad(scene, green, {1, -1, -1}, z, y);   // right
    add_quad(scene, light, {-0.25f, 0.99f, -0.25f}, {0.5f, 0, 0}, {0, 0, 0.5f});

    const auto turned = [](double degrees, const dvec3& at) {
        const double a = degrees * kPi / 180;
        return dmat4(dvec4(std::cos(a), 0, -std::sin(a), 0), dvec4(0, 1, 0, 0), dvec4(std::sin(a), 0, std::cos(a), 0),
                     dvec4(at, 1));
    };
    const int small = add_box(scene, white, {-0.3f, 0, -0.3f}, {0.3f, 0.6f, 0.3f});
    scene.instances[small].object_to_world = turned(-17, {0.33, -1, 0.35});
    const int large = add_box(scene, block, {-0.3f, 0, -0.3f}, {0.3f, 1.2f, 0.3f});
    scene.instances[large].object_to_world = turned(19, {-0.35, -1, -0.3});
    scene.cameras.push_back(look_at_camera({0, 0, 3.9}, {0, 0, 0}, {0, 1, 0}, 0.68));
    return scene;
}

}  // namespace halflight::test
