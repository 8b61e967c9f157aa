// Glossy objects on a table: metals, coats, ceramics and a frosted pane under two softboxes.
#include <cmath>

#include "tools/scenes/exact.h"
#include "tools/scenes/scenes.h"
#include "tools/scenes/shapes.h"
#include "tools/scenes/textures.h"

namespace halflight::scenes {
namespace {

Mesh ball(const char* name, int material, double radius) {
    MeshBuilder mesh(name);
    mesh.material(material);
    sphere(mesh, {0, radius, 0}, radius, 72, 36);
    return mesh.take();
}

Mesh turned(const char* name, int material, std::span<const dvec2> points, int steps, int segments) {
    MeshBuilder mesh(name);
    mesh.material(material);
    lathe(mesh, curve(points, steps), segments);
    return mesh.take();
}

Mesh cube(int material, double size) {
    MeshBuilder mesh("cube");
    mesh.material(material);
    const double h = size / 2;
    for (const dmat4& turn : {turn_y(0), turn_y(90), turn_y(180), turn_y(270), turn_x(-90), turn_x(90)}) {
        mesh.frame(move(0, h, 0) * turn);
        mesh.picture({-h, -h, h}, {h, -h, h}, {h, h, h}, {-h, h, h});
    }
    return mesh.take();
}

Mesh drapery(int material) {
    MeshBuilder mesh("drapery");
    mesh.material(material);
    surface(mesh, 160, 24, [](double u, double v) {
        const double drift = 0.5 * sine(2.1 * v + 9 * u), depth = 0.030 + 0.018 * sine(7 * u + 1);
        const double fold = sine(2 * kPi * 13 * u + drift) + 0.3 * sine(2 * kPi * 29 * u + 2 * drift);
        return dvec3(3.2 * (u - 0.5), 1.9 * v - 0.25, -0.62 + depth * fold - 0.02 * v);
    });
    return mesh.take();
}

/// Returns twigs with leaves that grow from the origin.
Mesh twigs(int bark, int leaf) {
    MeshBuilder mesh("twigs");
    Random random(5);
    for (int i = 0; i < 5; ++i) {
        const dvec2 around = cos_sin_degrees(72.0 * i + 20);
        std::vector<dvec3> path;
        for (int k = 0; k <= 8; ++k) {
            const double t = k / 8.0, out = 0.02 + (0.10 + 0.02 * i) * t * t;
            path.push_back({out * around.x + 0.008 * sine(9 * t + i), 0.17 * t + 0.03 * t * (i % 3), out * around.y});
        }
        mesh.material(bark);
        tube(mesh, path, 0.0025, 6);
        mesh.material(leaf);
        for (std::size_t k = 3; k <= 8; ++k) {
            const dvec2 turn = cos_sin_degrees(random.in(0, 360));
            const dvec3 side = dvec3(turn.x, 0.35, turn.y) * 0.03, up = dvec3(-0.4 * turn.y, 0.9, 0.4 * turn.x) * 0.085;
            mesh.picture(path[k] - side, path[k] + side, path[k] + side + up, path[k] - side + up);
        }
    }
    return mesh.take();
}

Mesh panel(const char* name, int material, const dvec3& centre, const dvec3& toward, double width, double height) {
    const dvec3 n = glm::normalize(toward - centre), right = glm::normalize(glm::cross(dvec3(0, 1, 0), n));
    const dvec3 u = right * (width / 2), v = glm::cross(n, right) * (height / 2);
    MeshBuilder mesh(name);
    mesh.material(material).quad(centre - u - v, centre + u - v, centre + u + v, centre - u + v);
    return mesh.take();
}

}  // namespace

Document still_life() {
    Document document("still life");
    const auto place = [&](const Mesh& mesh, const dmat4& matrix = dmat4(1)) {
        document.node(mesh.name, document.mesh(mesh), matrix);
    };
    const auto add = [&](const Material& material) { return document.material(material); };
    const auto textured = [&](Material material, const char* name, const TextureSet& set) {
        material.color_texture = document.texture(name, set.color);
        return material;
    };

    const int oak = add(textured(glossy("oak", dvec3(0.9), 0.35), "planks", planks()));
    MeshBuilder table("table");
    table.material(oak).texel_size(0.6);
    bevelled_box(table, {-1.2, -0.05, -0.55}, {1.2, 0, 0.85}, 0.006);
    place(table.take());
    place(drapery(add(matte("drapery", {0.10, 0.16, 0.20}))));

    place(ball("chrome ball", add(metal("chrome", {0.70, 0.71, 0.72}, 0.05)), 0.115), move(-0.04, 0, -0.12));
    place(ball("gold ball", add(metal("gold", {1.0, 0.78, 0.34}, 0.2)), 0.075), move(-0.20, 0, 0.10));
    place(ball("copper ball", add(metal("copper", {0.95, 0.64, 0.54}, 0.5)), 0.06), move(0.13, 0, 0.15));
    place(ball("lacquer ball", add(glossy("red lacquer", {0.62, 0.03, 0.025}, 0.08)), 0.05), move(-0.05, 0, 0.20));
    Material paint = metal("car paint", {0.04, 0.14, 0.52}, 0.45);
    paint.metallic = 0.7, paint.clearcoat = 1, paint.clearcoat_roughness = 0.03;
    place(ball("car paint ball", add(paint), 0.09), move(0.27, 0, 0.00));

    // The profile has foot, belly, neck and lip, then goes down inside the neck.
    const dvec2 vase[] = {{0.0, 0.0},     {0.045, 0.0},  {0.05, 0.008},  {0.045, 0.02},  {0.075, 0.07},
                          {0.095, 0.13},  {0.082, 0.20}, {0.045, 0.255}, {0.032, 0.295}, {0.04, 0.33},
                          {0.052, 0.342}, {0.05, 0.346}, {0.04, 0.335},  {0.028, 0.29},  {0.0, 0.25}};
    place(turned("vase", add(glossy("glazed ceramic", {0.78, 0.74, 0.64}, 0.12)), vase, 5, 72), move(-0.38, 0, -0.16));
    Material leaf = textured(glossy("leaves", dvec3(1), 0.5), "leaves", leaves());
    leaf.alpha_cutoff = 0.5, leaf.double_sided = true;
    place(twigs(add(matte("bark", {0.16, 0.10, 0.06})), add(leaf)), move(-0.38, 0.27, -0.16));

    const int pear_skin = add(glossy("pear", {0.62, 0.52, 0.10}, 0.3)), stem = add(matte("stem", {0.10, 0.06, 0.03}));
    const dvec2 pear[] = {{0.0, 0.006},   {0.016, 0.0},   {0.040, 0.012}, {0.052, 0.040}, {0.047, 0.068},
                          {0.030, 0.095}, {0.022, 0.115}, {0.014, 0.130}, {0.003, 0.132}, {0.0, 0.128}};
    MeshBuilder fruit("pear");
    fruit.material(pear_skin);
    lathe(fruit, curve(pear, 5), 48);
    const dvec3 stalk[] = {{0, 0.126, 0}, {0.002, 0.138, 0}, {0.008, 0.150, 0.002}};
    fruit.material(stem);
    tube(fruit, stalk, 0.0025, 8);
    const int fruit_mesh = document.mesh(fruit.take());
    document.node("pear", fruit_mesh, move(-0.33, 0, 0.15));
    document.node("lying pear", fruit_mesh, move(-0.42, 0.046, 0.03) * turn_y(35) * turn_z(97));

    place(cube(add(textured(glossy("checkered cube", dvec3(1), 0.4), "checker", checker())), 0.13),
          move(0.43, 0, 0.16) * turn_y(32));

    // The pane is one sheet, because transmission is thin-walled here.
    Material frosted = glossy("frosted glass", {0.90, 0.97, 0.94}, 0.35);
    frosted.transmission = 1, frosted.double_sided = true;
    MeshBuilder pane("pane");
    pane.material(add(frosted));
    pane.quad({-0.15, 0.012, 0}, {0.15, 0.012, 0}, {0.15, 0.36, 0}, {-0.15, 0.36, 0});
    pane.material(add(metal("steel", {0.56, 0.57, 0.58}, 0.35)));
    bevelled_box(pane, {-0.17, 0, -0.03}, {0.17, 0.014, 0.03}, 0.003);
    for (const double x : {-0.155, 0.155})
        bevelled_box(pane, {x - 0.006, 0.013, -0.006}, {x + 0.006, 0.366, 0.006}, 0.0015);
    bevelled_box(pane, {-0.149, 0.354, -0.006}, {0.149, 0.366, 0.006}, 0.0015);
    const dmat4 pane_place = move(0.40, 0, -0.20) * turn_y(-16);
    place(pane.take(), pane_place);
    place(ball("jade ball", add(glossy("jade", {0.10, 0.42, 0.22}, 0.2)), 0.09), move(0.40, 0, -0.42));

    const dvec3 middle(0, 0.1, 0);
    place(panel("key light", add(light("key light", {38, 35, 30.5})), {-1.15, 1.25, 0.95}, middle, 0.8, 0.6));
    place(panel("rim light", add(light("rim light", {17, 20, 25})), {1.3, 0.75, 0.25}, middle, 0.18, 1.0));
    document.sky({0.18, 0.20, 0.24});
    document.camera("camera", {0.10, 0.50, 1.60}, {0.015, 0.175, 0}, 23, 16.0 / 9);
    return document;
}

}  // namespace halflight::scenes
