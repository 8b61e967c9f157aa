#include "tests/pass/rays/tracer_inputs.h"

#include <algorithm>
#include <cmath>
#include <random>

namespace halflight::test {

namespace fs = std::filesystem;

std::vector<fs::path> scenes_under(const fs::path& folder) {
    std::vector<fs::path> files;
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder)) {
        const bool bad = entry.path().string().find("/bad/") != std::string::npos;  // invalid files
        if (!bad && (entry.path().extension() == ".glb" || entry.path().extension() == ".gltf"))
            files.push_back(entry.path());
    }
    std::sort(files.begin(), files.end());
    return files;
}

TraceTables opaque_tables(const Scene& scene, std::size_t flatten) {
    TraceTables tables = build_trace_tables(scene, flatten);
    for (uvec4& t : tables.triangles) t.w &= ~kTriangleAlpha;
    tables.alpha_tested = false;
    return tables;
}

int add_mesh(Scene& scene, const std::vector<vec3>& positions, const std::vector<uvec3>& triangles) {
    if (scene.materials.empty()) scene.materials.emplace_back();
    Mesh mesh;
    mesh.normals.assign(positions.size(), vec3(0, 1, 0));
    mesh.triangle_material.assign(triangles.size(), 0);
    mesh.positions = positions;
    mesh.triangles = triangles;
    scene.meshes.push_back(std::move(mesh));
    return static_cast<int>(scene.meshes.size()) - 1;
}

void add_instance(Scene& scene, int mesh, const dmat4& object_to_world) {
    Instance instance;
    instance.mesh = mesh;
    instance.object_to_world = object_to_world;
    scene.instances.push_back(instance);
}

Scene of_one_mesh(const std::vector<vec3>& positions, const std::vector<uvec3>& triangles) {
    Scene scene;
    scene.name = "test";
    add_instance(scene, add_mesh(scene, positions, triangles));
    return scene;
}

Scene sphere(unsigned n, const vec3& centre, float radius) {
    std::vector<vec3> positions{centre + vec3(0, radius, 0), centre - vec3(0, radius, 0)};
    std::vector<uvec3> triangles;
    const unsigned columns = 2 * n;
    const auto at = [&](unsigned row, unsigned column) {
        if (row == 0) return 0u;
        return row == n ? 1u : 2 + (row - 1) * columns + column % columns;
    };
    for (unsigned row = 1; row < n; ++row) {
        for (unsigned column = 0; column < columns; ++column) {
            const double theta = kPi * row / n, phi = 2 * kPi * column / columns;
            positions.push_back(centre + radius * vec3(std::sin(theta) * std::cos(phi), std::cos(theta),
                                                       std::sin(theta) * std::sin(phi)));
        }
    }
    for (unsigned row = 0; row < n; ++row) {
        for (unsigned column = 0; column < columns; ++column) {
            const unsigned a = at(row, column), b = at(row + 1, column), c = at(row + 1, column + 1),
                           d = at(row, column + 1);
            if (row + 1 < n) triangles.emplace_back(a, b, c);
            if (row > 0) triangles.emplace_back(a, c, d);
        }
    }
    return of_one_mesh(positions, triangles);
}

Scene height_field(unsigned n, float height) {
    std::vector<vec3> positions;
    std::vector<uvec3> triangles;
    for (unsigned j = 0; j <= n; ++j) {
        for (unsigned i = 0; i <= n; ++i) {
            const float x = 2 * static_cast<float>(i) / static_cast<float>(n) - 1;
            const float z = 2 * static_cast<float>(j) / static_cast<float>(n) - 1;
            positions.emplace_back(x, height * std::sin(5 * x) * std::cos(7 * z), z);
            const unsigned a = j * (n + 1) + i;
            if (i == n || j == n) continue;
            triangles.emplace_back(a, a + n + 1, a + 1);
            triangles.emplace_back(a + 1, a + n + 1, a + n + 2);
        }
    }
    return of_one_mesh(positions, triangles);
}

Scene soup(unsigned count, float size, const vec3& stretch, std::uint32_t seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> uniform(-1, 1);
    const auto point = [&] { return vec3(uniform(random), uniform(random), uniform(random)); };
    std::vector<vec3> positions;
    std::vector<uvec3> triangles;
    for (unsigned i = 0; i < count; ++i) {
        const vec3 centre = point();
        for (int k = 0; k < 3; ++k) positions.push_back(centre + size * stretch * point());
        triangles.emplace_back(3 * i, 3 * i + 1, 3 * i + 2);
    }
    return of_one_mesh(positions, triangles);
}

std::vector<Ray> rays_through(const Bounds& bounds, std::size_t count, std::uint32_t seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> uniform(0, 1);
    const auto point = [&](float grow) {
        const vec3 s = (vec3(uniform(random), uniform(random), uniform(random)) - 0.5f) * grow + 0.5f;
        return glm::mix(bounds.lower, bounds.upper, s);
    };
    std::vector<Ray> rays;
    while (rays.size() < count) {
        const vec3 from = point(rays.size() % 2 ? 3.0f : 1.0f), to = point(1);
        if (from == to) continue;
        const float length = rays.size() % 3 ? glm::length(to - from) : 1.0f;
        rays.push_back({from, 0, (to - from) / length, rays.size() % 5 ? kInfinity : 1.5f * length});
    }
    return rays;
}

Scene instanced_spheres() {
    Scene scene = sphere(8, vec3(0), 0.3f);
    scene.instances.clear();
    for (int i = 0; i < 60; ++i) {
        const double a = 0.7 * i;
        dmat4 m(1);
        m[0] = {std::cos(a), 0.1 * std::sin(3 * a), std::sin(a), 0};
        m[1] = {0, 0.5 + 0.4 * std::sin(a), 0, 0};
        m[2] = {-std::sin(a), 0, std::cos(a), 0};
        m[3] = {0.1 * i * std::cos(a), 0.6 * std::sin(2 * a), 0.1 * i * std::sin(a), 1};
        add_instance(scene, 0, m);
    }
    const Scene field = height_field(24, 0.3f);
    add_instance(scene, add_mesh(scene, field.meshes[0].positions, field.meshes[0].triangles));
    return scene;
}

Scene veils(int count) {
    Scene scene;
    scene.name = "veils";
    for (int i = 0; i < count; ++i) {
        Material material;
        material.alpha_mode = AlphaMode::blend;
        material.base_color.a = 0.05f * static_cast<float>(i % 7);
        Mesh mesh;
        const float z = 0.1f * static_cast<float>(i);
        mesh.positions = {{0, 0, z}, {1, 0, z}, {1, 1, z}, {0, 1, z}};
        mesh.normals.assign(4, vec3(0, 0, 1));
        mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
        mesh.triangle_material.assign(2, static_cast<std::uint32_t>(i));
        scene.materials.push_back(material);
        add_instance(scene, i);
        scene.meshes.push_back(mesh);
    }
    return scene;
}

std::vector<Ray> camera_rays(const vec3& from, const vec3& to, const vec2& jitter) {
    const vec3 ahead = glm::normalize(to - from);
    const vec3 right = glm::normalize(glm::cross(ahead, std::abs(ahead.y) < 0.9f ? vec3(0, 1, 0) : vec3(1, 0, 0)));
    const vec3 up = glm::cross(right, ahead);
    std::vector<Ray> rays;
    for (int i = 0; i < 64 * 64; ++i) {
        const int tile = i / 64, x = tile % 8 * 8 + i % 8, y = tile / 8 * 8 + i % 64 / 8;
        const vec2 p = (vec2(x, y) + jitter) / 32.0f - 1.0f;
        rays.push_back({from, 0, glm::normalize(ahead + 0.6f * (p.x * right + p.y * up)), kInfinity});
    }
    return rays;
}

std::vector<Ray> camera_rays(const Bounds& bounds, const vec3& from_direction) {
    const float radius = 0.5f * glm::length(bounds.extent());
    return camera_rays(bounds.centre() + 2.0f * radius * glm::normalize(from_direction), bounds.centre());
}

std::vector<Ray> mixed_rays(const Bounds& bounds, std::size_t count, std::uint32_t seed) {
    std::vector<Ray> rays = rays_through(bounds, count, seed);
    rays.resize(rays.size() / 64 * 64);  // the next rays start a new tile
    const float radius = 0.5f * glm::length(bounds.extent());
    for (const vec3& from : {vec3(1, 0.4f, 0.3f), vec3(-0.2f, 1, -0.3f)}) {
        const std::vector<Ray> view = camera_rays(bounds, from);
        rays.insert(rays.end(), view.begin(), view.end());
    }
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> uniform(-1, 1);
    const auto point = [&] { return vec3(uniform(random), uniform(random), uniform(random)); };
    for (int tile = 0; tile < 100; ++tile) {
        const vec3 from = bounds.centre() + 0.6f * bounds.extent() * point();
        const vec3 to = bounds.centre() + 0.5f * bounds.extent() * point();
        const float from_size = radius * std::exp2(-static_cast<float>(random() % 16));
        const float to_size = radius * std::exp2(-static_cast<float>(random() % 16));
        for (int i = 0; i < 64; ++i) {
            const vec3 origin = from + from_size * point();
            rays.push_back({origin, 0, to + to_size * point() - origin, tile % 2 ? 1.0f : kInfinity});
        }
    }
    return rays;
}

std::vector<std::vector<Ray>> degenerate_tiles() {
    const std::vector<Ray> all = rays_through({vec3(-1), vec3(1)}, 64, 5);
    std::vector<std::vector<Ray>> tiles{{all[0]}};
    const auto add = [&](auto make) {
        std::vector<Ray>& rays = tiles.emplace_back();
        for (std::size_t i = 0; i < 64; ++i) rays.push_back(make(all[i], i));
    };
    const float inf = kInfinity;
    add([&](const Ray&, std::size_t) { return all[1]; });
    add([&](const Ray& r, std::size_t i) { return Ray{r.origin, 0, vec3(i % 2 ? 1 : -1, 0, 0), inf}; });
    add([&](const Ray& r, std::size_t i) { return i % 2 ? Ray{r.origin, 0, -all[0].direction, inf} : all[0]; });
    add([&](const Ray& r, std::size_t) { return Ray{vec3(0), 0, r.direction, inf}; });
    add([&](const Ray& r, std::size_t i) {
        vec3 d(0);
        d[static_cast<int>(i % 3)] = r.direction.x;
        return Ray{r.origin, 0, d, inf};
    });
    add([](const Ray& r, std::size_t i) { return Ray{r.origin, 0, r.direction, i % 2 ? 0.0f : 0.5f}; });
    add([](const Ray& r, std::size_t) { return Ray{r.origin, 0, r.direction, 0}; });
    add([](const Ray& r, std::size_t i) { return Ray{r.origin, i % 2 ? 0.6f : 0.0f, r.direction, 0.5f}; });
    add([](const Ray& r, std::size_t) { return Ray{r.origin, 1, r.direction, 0}; });
    add([&](const Ray& r, std::size_t i) { return Ray{r.origin, 0, r.direction * std::exp2(float(i) - 32), inf}; });
    add([](const Ray& r, std::size_t i) { return Ray{r.origin * (i % 8 ? 1.0f : 1e9f), 0, r.direction, 1e30f}; });
    add([&](const Ray& r, std::size_t i) { return Ray{r.origin, 0, r.direction * (i % 8 ? 1.0f : 1e-30f), inf}; });
    add([&](const Ray& r, std::size_t i) {
        return Ray{r.origin + vec3(0, 0, i % 4 ? 0.0f : 100.0f), 0, vec3(0, 1e-30f, 1), inf};
    });
    return tiles;
}

void kill_some(std::vector<Ray>& rays) {
    for (std::size_t i = 0; i < rays.size(); ++i)
        if (i < 100 || i % 7 == 0) rays[i].t_max = -1;
}

std::vector<std::uint32_t> uneven_list(std::uint32_t count) {
    std::vector<std::uint32_t> list;
    for (std::uint32_t i = 0; i < count; i += 1 + i % 3) list.push_back(i);
    std::reverse(list.begin() + 100, list.begin() + 3000);
    return list;
}

}  // namespace halflight::test
