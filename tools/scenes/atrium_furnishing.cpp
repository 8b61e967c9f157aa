// The furnishing of the atrium.
#include <array>
#include <cmath>

#include "tools/scenes/atrium.h"
#include "tools/scenes/exact.h"
#include "tools/scenes/shapes.h"

namespace halflight::scenes::atrium {
namespace {

/// Adds a card with a picture of leaves, from `root` along `direction`, its tip hanging by `droop` radians.
void leaf_card(MeshBuilder& mesh, const dvec3& root, const dvec3& direction, double length, double droop) {
    const dvec3 side = glm::normalize(glm::cross(direction, dvec3(0.1, 1, 0.05))) * (length * 0.42);
    const dvec3 down(0, -1, 0);
    std::array<dvec3, 3> spine{root, root + 0.5 * length * direction, {}};
    spine[2] = spine[1] + 0.5 * length * glm::normalize(direction + down * std::min(droop, 1.2));
    std::uint32_t first = 0;
    for (std::size_t k = 0; k < 3; ++k) {
        const dvec3 along = glm::normalize(spine[std::min<std::size_t>(k + 1, 2)] - spine[k == 0 ? 0 : k - 1]);
        const dvec3 n = glm::normalize(glm::cross(side, along));
        const double v = 1 - 0.5 * static_cast<double>(k);
        const std::uint32_t index = mesh.vertex({spine[k] - side, n, {0, v}});
        mesh.vertex({spine[k] + side, n, {1, v}});
        if (k == 0) first = index;
    }
    for (std::uint32_t k = first; k < first + 4; k += 2) mesh.triangle(k, k + 1, k + 3), mesh.triangle(k, k + 3, k + 2);
}

/// Returns the unit vector at two angles: above the horizon and around the vertical, degrees.
dvec3 toward(double up, double around) {
    const dvec2 a = cos_sin_degrees(up), b = cos_sin_degrees(around);
    return {a.x * b.x, a.y, -a.x * b.y};
}

void pot(MeshBuilder& mesh, const Materials& m, double scale) {
    mesh.frame(grow(scale, scale, scale)).material(m.clay);
    const dvec2 profile[] = {{0.0, 0},     {0.20, 0},    {0.27, 0.30}, {0.30, 0.40}, {0.33, 0.40},
                             {0.34, 0.43}, {0.34, 0.48}, {0.32, 0.50}, {0.29, 0.50}, {0.285, 0.45}};
    lathe(mesh, profile, 18, 2, 0.5);
    mesh.material(m.soil);
    const dvec2 soil[] = {{0.29, 0.455}, {0, 0.475}};
    lathe(mesh, soil, 18);
    mesh.frame(dmat4(1));
}

}  // namespace

Mesh hanging(const Materials& m, int which, double width, double height) {
    MeshBuilder mesh("banner");
    mesh.material(m.banners[which]);
    const double phase = 1.7 * which;
    surface(mesh, 20, 10, [&](double u, double v) {
        const double s = 1 - v, x = 2 * u - 1;  // folds grow and wander on the way down; the sides draw in a little
        const double fold = (0.015 + 0.05 * s) * sine(2 * kPi * (2.6 * u + 0.12 * sine(3 * s + phase)) + phase);
        const double swell = 0.07 * s * sine(2.2 * s + phase) * (1 - 0.3 * x * x);
        return dvec3(0.5 * width * x * (1 - 0.05 * s), -0.03 - height * s - 0.03 * s * x * x, fold + swell);
    });
    mesh.material(m.brass);
    const double half = width / 2 + 0.12;
    const dvec3 rod[] = {{-half, 0, 0}, {half, 0, 0}};
    tube(mesh, rod, 0.025, 8);
    sphere(mesh, {-half, 0, 0}, 0.045, 8, 6);
    sphere(mesh, {half, 0, 0}, 0.045, 8, 6);
    for (const double x : {-0.35 * width, 0.35 * width}) {
        const dvec3 cord[] = {{x, 0, 0}, {x, 0.28, 0}};
        tube(mesh, cord, 0.008, 4);
    }
    return mesh.take();
}

Mesh fountain(const Materials& m) {
    MeshBuilder mesh("fountain");
    mesh.material(m.stone).texel_size(1.2);
    const dvec2 basin[] = {{1.62, 0},    {1.62, 0.12}, {1.50, 0.14}, {1.44, 0.18}, {1.44, 0.42},
                           {1.48, 0.45}, {1.55, 0.47}, {1.56, 0.53}, {1.53, 0.56}, {1.30, 0.56},
                           {1.27, 0.53}, {1.27, 0.20}, {0, 0.20}};
    lathe(mesh, basin, 40, 6, 1.2);
    const dvec2 foot[] = {{0.34, 0.20}, {0.34, 0.50}, {0.20, 0.56}, {0.13, 0.70},
                          {0.12, 0.90}, {0.16, 1.08}, {0.15, 1.12}};
    lathe(mesh, foot, 24, 2, 1.2);
    mesh.material(m.brass);
    const dvec2 bowl_points[] = {{0.10, 1.08}, {0.32, 1.13}, {0.56, 1.24}, {0.66, 1.36}};
    std::vector<dvec2> bowl = curve(bowl_points, 3);
    for (const dvec2& p : {dvec2(0.68, 1.375), dvec2(0.675, 1.39), dvec2(0.645, 1.385), dvec2(0.54, 1.27),
                           dvec2(0.30, 1.17), dvec2(0, 1.15)})
        bowl.push_back(p);
    lathe(mesh, bowl, 32);
    const dvec2 finial_points[] = {{0.08, 1.15}, {0.05, 1.30}, {0.09, 1.46}, {0.045, 1.58}, {0.03, 1.66}, {0.0, 1.74}};
    lathe(mesh, curve(finial_points, 2), 12);
    mesh.material(m.water);
    const dvec2 pool[] = {{1.28, 0.47}, {0.3, 0.47}}, cup[] = {{0.62, 1.34}, {0.06, 1.34}};
    lathe(mesh, pool, 40), lathe(mesh, cup, 32);
    return mesh.take();
}

Mesh potted_bush(const Materials& m, std::uint32_t seed) {
    MeshBuilder mesh("potted bush");
    pot(mesh, m, 1);
    mesh.material(m.leaf);
    Random random(seed);
    for (int i = 0; i < 80; ++i) {
        const double up = 80 - 62 * (i / 80.0), around = 137.5 * i + random.in(-20, 20);
        const dvec3 direction = toward(up + random.in(-8, 8), around);
        const dvec3 root = dvec3(0, 0.46, 0) + dvec3(0.10, 0.0, 0.10) * direction + dvec3(0, random.in(0, 0.30), 0);
        leaf_card(mesh, root, direction, random.in(0.38, 0.62), random.in(0.2, 0.9));
    }
    return mesh.take();
}

Mesh potted_tree(const Materials& m, std::uint32_t seed) {
    MeshBuilder mesh("potted tree");
    pot(mesh, m, 1.25);
    Random random(seed);
    mesh.material(m.wood);
    const dvec3 trunk[] = {{0, 0.5, 0}, {0.03, 0.9, 0.02}, {-0.02, 1.3, 0.03}, {0.02, 1.75, -0.01}, {0, 2.2, 0}};
    tube(mesh, trunk, 0.04, 10);
    struct Branch {
        dvec3 root, direction;
        double length;
    };
    std::vector<Branch> branches;
    for (int i = 0; i < 14; ++i) {
        const dvec3 root(0.01, 1.45 + 0.055 * i, 0), direction = toward(random.in(15, 50) + 2.2 * i, 137.5 * i);
        branches.push_back({root, direction, random.in(0.40, 0.60) - 0.012 * i});
        const dvec3 path[] = {root, root + 0.5 * branches.back().length * direction,
                              root + branches.back().length * (direction + dvec3(0, 0.12, 0))};
        tube(mesh, path, 0.012, 5);
    }
    mesh.material(m.leaf);
    for (int i = 0; i < 190; ++i) {
        const Branch& b = branches[static_cast<std::size_t>(i) % branches.size()];
        const dvec3 root = b.root + b.direction * (b.length * random.in(0.35, 1.1)) + dvec3(0, 0.03, 0);
        leaf_card(mesh, root, glm::normalize(b.direction + toward(random.in(-40, 70), random.in(0, 360))),
                  random.in(0.24, 0.40), random.in(0, 0.8));
    }
    return mesh.take();
}

Mesh bench(const Materials& m) {
    MeshBuilder mesh("bench");
    mesh.material(m.stone).texel_size(1.2);
    bevelled_box(mesh, {-0.75, 0.38, -0.21}, {0.75, 0.47, 0.21}, 0.015);
    for (const double x : {-0.5, 0.5}) {
        bevelled_box(mesh, {x - 0.09, 0.06, -0.16}, {x + 0.09, 0.39, 0.16}, 0.02);
        bevelled_box(mesh, {x - 0.13, 0, -0.19}, {x + 0.13, 0.07, 0.19}, 0.01);
    }
    mesh.material(m.cushion).texel_size(0.5);
    bevelled_box(mesh, {-0.66, 0.465, -0.19}, {0.66, 0.53, 0.19}, 0.03);
    return mesh.take();
}

Mesh table(const Materials& m) {
    MeshBuilder mesh("table");
    mesh.material(m.wood).texel_size(0.8);
    const dvec2 top[] = {{0, 0.72}, {0.50, 0.72}, {0.55, 0.735}, {0.56, 0.75}, {0.55, 0.765}, {0.54, 0.77}, {0, 0.77}};
    lathe(mesh, top, 32, 4, 0.8);
    mesh.material(m.brass);
    const dvec2 leg_points[] = {{0.30, 0.0},  {0.29, 0.03}, {0.08, 0.07}, {0.035, 0.2},
                                {0.05, 0.45}, {0.03, 0.60}, {0.10, 0.72}};
    lathe(mesh, curve(leg_points, 2), 14);
    return mesh.take();
}

Mesh chair(const Materials& m) {
    MeshBuilder mesh("chair");
    mesh.material(m.wood).texel_size(0.8);
    for (const double x : {-0.20, 0.20}) {
        bevelled_box(mesh, {x - 0.02, 0, 0.17}, {x + 0.02, 0.45, 0.21}, 0.006);
        mesh.frame(move(x, 0, -0.19) * turn_x(-6));
        bevelled_box(mesh, {-0.02, 0, -0.02}, {0.02, 0.98, 0.02}, 0.006);
        mesh.frame(dmat4(1));
    }
    bevelled_box(mesh, {-0.23, 0.43, -0.22}, {0.23, 0.47, 0.23}, 0.01);
    mesh.frame(move(0, 0, -0.19) * turn_x(-6));
    for (int slat = 0; slat < 3; ++slat)
        bevelled_box(mesh, {-0.19, 0.60 + 0.13 * slat, -0.01}, {0.19, 0.68 + 0.13 * slat, 0.012}, 0.005);
    mesh.frame(dmat4(1)).material(m.cushion).texel_size(0.5);
    bevelled_box(mesh, {-0.20, 0.468, -0.17}, {0.20, 0.51, 0.20}, 0.018);
    return mesh.take();
}

Mesh lantern(const Materials& m) {
    MeshBuilder mesh("lantern");
    mesh.material(m.brass);
    const dvec3 chain[] = {{0, 0, 0}, {0, -0.9, 0}};
    tube(mesh, chain, 0.008, 6);
    const dvec2 cap[] = {{0.17, -1.10},  {0.19, -1.09},  {0.18, -1.06}, {0.09, -0.98},
                         {0.035, -0.95}, {0.045, -0.92}, {0, -0.89}};
    lathe(mesh, cap, 12);
    const dvec2 base[] = {{0, -1.56},    {0.03, -1.55}, {0.04, -1.51}, {0.13, -1.47},
                          {0.15, -1.45}, {0.15, -1.43}, {0, -1.43}};
    lathe(mesh, base, 12);
    for (int i = 0; i < 6; ++i) {
        const dvec2 t = cos_sin_degrees(60.0 * i);
        const dvec3 bar[] = {{0.135 * t.x, -1.44, 0.135 * t.y}, {0.165 * t.x, -1.09, 0.165 * t.y}};
        tube(mesh, bar, 0.008, 4);
    }
    mesh.material(m.plaster);
    const dvec2 candle[] = {{0.035, -1.43}, {0.035, -1.27}, {0.02, -1.26}, {0, -1.26}};
    lathe(mesh, candle, 6);
    return mesh.take();
}

Mesh urn(const Materials& m) {
    MeshBuilder mesh("urn");
    mesh.material(m.brass);
    const dvec2 points[] = {{0.13, 0.0},  {0.125, 0.03}, {0.06, 0.07}, {0.055, 0.12}, {0.15, 0.24},
                            {0.20, 0.40}, {0.17, 0.55},  {0.09, 0.64}, {0.085, 0.70}, {0.14, 0.76}};
    std::vector<dvec2> profile = curve(points, 1);
    for (const dvec2& p :
         {dvec2(0.142, 0.77), dvec2(0.13, 0.765), dvec2(0.075, 0.69), dvec2(0.08, 0.63), dvec2(0.0, 0.5)})
        profile.push_back(p);
    lathe(mesh, profile, 14);
    return mesh.take();
}

}  // namespace halflight::scenes::atrium
