// Tests transforms that flatten, mirror and stretch, deep hierarchies of transforms, and very many instances.
#include <algorithm>
#include <bit>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>

#include "engine/io/gltf/gltf.h"
#include "engine/tables/tables.h"
#include "tests/stiff/stiff.h"
#include "tests/support/error_message.h"
#include "tests/unit/io/gltf_builder.h"

namespace halflight::test {
namespace {

class Transforms : public StiffTest {
  protected:
    static Scene load(const GltfBuilder& builder) {
        return loaded(builder, [](const auto& file) { return load_gltf(file); });
    }
    static dmat4& matrix(Scene& scene, int instance) {
        return scene.instances[static_cast<std::size_t>(instance)].object_to_world;
    }
    static Material glowing(float albedo) {
        Material m = diffuse_material(vec3(albedo));
        m.emission = vec3(1);
        return m;
    }
};

TEST_F(Transforms, Mirrored) {
    const Scene plain = cornell_box(metal_material({0.9f, 0.7f, 0.4f}, 0.3f));
    Scene mirrored = plain;
    for (Mesh& mesh : mirrored.meshes) {
        for (vec3& p : mesh.positions) p.x = -p.x;
        for (vec3& n : mesh.normals) n.x = -n.x;
    }
    for (Instance& i : mirrored.instances) i.object_to_world = glm::scale(i.object_to_world, dvec3(-1, 1, 1));
    expect("mirrored meshes, mirrored back by their nodes",
           pixels_that_differ(picture(mirrored, plain.cameras[0], 48, 8, 4).beauty,
                              picture(plain, plain.cameras[0], 48, 8, 4).beauty),
           0, "pixels differ", "exact: signs do not round");
}

TEST_F(Transforms, Stretched) {
    // One box is scaled by a node from 10^-4 x 1 x 10^4 to its shape, another is stretched by 400. From 2000 on, the
    // float weights of a hit are less precise than the height of such triangles.
    for (const bool undone : {true, false}) {
        Scene scene;
        const vec3 stretch = undone ? vec3(1e-4f, 1, 1e4f) : vec3(0.05f, 1, 20);
        const int box = add_box(scene, add_material(scene, glowing(0.5f)), -stretch, stretch);
        if (undone) matrix(scene, box) = glm::scale(dmat4(1), 1.0 / dvec3(stretch));
        scene.environment.color = vec3(1e6f);
        const Camera camera =
            undone ? camera_in_box() : look_at_camera({0.01, 0.2, 0.3}, {-0.05, 0.1, -0.7}, {0, 1, 0}, 1);
        const std::string name =
            undone ? "room of 10^-4 x 1 x 10^4 m that its node makes a cube" : "room of 0.1 x 2 x 40 m";
        const double exact = 2 * (1 - std::pow(0.5, 5));
        expect_both(name + " under a sky of 10^6", scene, camera, 24, 16, 4, exact);
    }
}

TEST_F(Transforms, Singular) {
    // White surfaces under a white sky are white in every shape. Boxes are flattened to a sheet, a line and a point
    // above a floor.
    Scene scene;
    scene.environment.color = vec3(1);
    const int white = add_material(scene, diffuse_material(vec3(1)));
    add_quad(scene, white, {-1, 0, -1}, {0, 0, 2}, {2, 0, 0});
    const dvec3 scales[] = {{1, 0, 1}, {0, 1, 0}, {0, 0, 0}};
    for (int i = 0; i < 3; ++i) {
        const int box = add_box(scene, white, vec3(-0.2f), vec3(0.2f));
        matrix(scene, box) = glm::scale(glm::translate(dmat4(1), dvec3(0.6 * (i - 1), 0.3, 0)), scales[i]);
    }
    const Camera camera = look_at_camera({0.3, 2, 1}, {0, 0, 0}, {0, 1, 0}, 0.7);
    expect_both("white boxes flattened to a sheet, a line, a point under a white sky", scene, camera, 32, 24, 24, 1,
                1e-3, "1/1000 for paths of more than 24 bounces");
}

TEST_F(Transforms, NestedNodes) {
    GltfBuilder builder;
    builder.add_triangle();
    const double half = kPi / 10;
    for (int i = 1; i < 200; ++i) {
        builder.push("nodes", {{"children", {i - 1}},
                               {"rotation", {0, 0, std::sin(half), std::cos(half)}},
                               {"translation", {1, 2, 3}},
                               {"scale", {i % 2 ? 2.0 : 0.5, i % 2 ? 2.0 : 0.5, i % 2 ? 2.0 : 0.5}}});
    }
    builder.json["scenes"] = {{{"nodes", {199}}}};
    const dmat4 found = load(builder).instances.at(0).object_to_world;
    using Wide = glm::mat<4, 4, long double>;
    Wide product(1);
    for (int i = 1; i < 200; ++i) {
        const long double angle = 3.141592653589793238462643383279502884L / 5, s = i % 2 ? 2 : 0.5;
        const long double c = std::cos(angle) * s, d = std::sin(angle) * s;
        Wide m(1);
        m[0] = {c, d, 0, 0}, m[1] = {-d, c, 0, 0}, m[2] = {0, 0, s, 0}, m[3] = {1, 2, 3, 1};
        product = m * product;
    }
    double worst = 0, size = 0;
    for (int i = 0; i < 16; ++i) {
        worst = std::max(worst, std::abs(found[i / 4][i % 4] - static_cast<double>(product[i / 4][i % 4])));
        size = std::max(size, std::abs(static_cast<double>(product[i / 4][i % 4])));
    }
    expect("200 nested nodes, turned, moved and scaled: error of the transform", worst / size, 200 * 8 * 0x1p-53,
           "of its greatest element", "eight roundings of doubles per node");
}

TEST_F(Transforms, CyclesAreRefused) {
    double loaded = 0;
    for (const std::vector<std::vector<int>>& children :
         {std::vector<std::vector<int>>{{0}}, {{1}, {0}}, {{1}, {2}, {3}, {1}}, {{1, 2}, {2}, {}}}) {
        GltfBuilder builder;
        builder.floats("VEC3", {0, 0, 0});
        for (const auto& c : children) builder.push("nodes", c.empty() ? Json::object() : Json{{"children", c}});
        const std::string message = error_message([&] { load(builder); });
        loaded += message.find("nodes[") == std::string::npos;
    }
    expect("files whose nodes go round in circles or have two parents: not refused by name", loaded, 0, "files",
           "glTF 2.0, section 3.5.2");
}

TEST_F(Transforms, ManyInstances) {
    // A plane of 317 x 317 white tiles lies under a white sky, one tile per pixel. Each tile is a rotated or mirrored
    // instance of one mesh with so many triangles that the renderer keeps it as an instance.
    constexpr int kSide = 317;
    constexpr unsigned kCuts = 4;
    static_assert(2 * kCuts * kCuts * kSide * kSide > kFlattenLimit);
    Scene scene;
    scene.environment.color = vec3(1);
    add_material(scene, diffuse_material(vec3(1)));
    Mesh tile;
    for (unsigned i = 0; i < kCuts * kCuts; ++i) {
        const vec3 corner = vec3(i % kCuts, 0, i / kCuts) * (0.5f / kCuts) - vec3(0.25f, 0, 0.25f);
        for (const vec2& at : {vec2(0, 0), vec2(0, 1), vec2(1, 1), vec2(1, 0)})
            tile.positions.push_back(corner + (0.5f / kCuts) * vec3(at.x, 0, at.y));
        tile.triangles.insert(tile.triangles.end(), {4 * i + uvec3(0, 1, 2), 4 * i + uvec3(0, 2, 3)});
    }
    tile.normals.assign(tile.positions.size(), vec3(0, 1, 0));
    tile.triangle_material.assign(tile.triangles.size(), 0);
    scene.meshes.push_back(tile);
    scene.instances.push_back({"tile", 0, dmat4(1), kNone});
    const Instance first = scene.instances[0];
    scene.instances.clear();
    for (int i = 0; i < kSide * kSide; ++i) {
        dmat4& m = scene.instances.emplace_back(first).object_to_world;
        if (i % 2) std::swap(m[0], m[2]);
        if (i % 3 == 0) m[0] = -m[0];
        m[3] = dvec4(i % kSide, 0, i / kSide, 1);
    }
    const double middle = (kSide - 1) / 2.0;
    Camera camera = look_at_camera({middle, 10, middle}, {middle, 0, middle}, {0, 0, -1}, 1);
    camera.orthographic = true;
    camera.ortho_height = kSide;
    RenderSettings settings = small_settings(camera, kSide, kSide, 4, 1);
    settings.aovs.emplace_back("ids");
    const RenderResult seen = picture(scene, settings);
    expect_mean("10^5 instances of a white tile under a white sky", mean_of(seen), 1);
    const Image& ids = layer(seen, "ids.instance");
    double wrong = 0;
    for (int i = 0; i < kSide * kSide; ++i)
        wrong += std::bit_cast<std::uint32_t>(*ids.at(i % kSide, i / kSide)) != static_cast<std::uint32_t>(i);
    expect("10^5 instances: pixels that do not see theirs", wrong, 0, "pixels", "exact: each is in its pixel's middle");
}

}  // namespace
}  // namespace halflight::test
