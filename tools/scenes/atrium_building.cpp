// The atrium's stone and timber. Faces are never coplanar: pieces overlap or meet along edges.
#include <algorithm>
#include <array>
#include <cmath>

#include "tools/scenes/atrium.h"
#include "tools/scenes/exact.h"
#include "tools/scenes/shapes.h"

namespace halflight::scenes::atrium {
Mesh column(const Materials& m) {
    MeshBuilder mesh("column");
    mesh.material(m.stone).texel_size(1.2);
    mesh.box({-0.36, 0, -0.36}, {0.36, 0.16, 0.36}, MeshBuilder::kBottom);
    const dvec2 base[] = {{0.345, 0.16}, {0.36, 0.20}, {0.345, 0.24}, {0.30, 0.27},
                          {0.32, 0.33},  {0.31, 0.37}, {0.27, 0.42}};
    lathe(mesh, base, 16, 2, 1.2);
    const dvec2 shaft[] = {{0.27, 0.42}, {0.268, 1.3}, {0.23, 2.40}, {0.25, 2.42}, {0.25, 2.46}, {0.225, 2.48}};
    lathe(mesh, shaft, 16, 2, 1.2);
    surface(mesh, 32, 4,
            [](double u, double v) {  // a bell with four leaves under the corners
                const dvec2 t(cosine(2 * kPi * u), sine(2 * kPi * u));
                const double bell = 0.225 + 0.11 * v * v * v + 0.03 * sine(kPi * v);
                const double leaf =
                    1 + 0.06 * sine(kPi * v) * cosine(2 * kPi * 8 * u) - 0.12 * v * v * cosine(2 * kPi * 4 * u);
                return dvec3(bell * leaf * t.x, 2.48 + 0.37 * v, -bell * leaf * t.y);
            },
            {2, 0.3});
    bevelled_box(mesh, {-0.37, 2.84, -0.37}, {0.37, 3.0, 0.37}, 0.02);
    return mesh.take();
}

Mesh upper_column(const Materials& m) {
    MeshBuilder mesh("upper column");
    mesh.material(m.stone).texel_size(1.2);
    bevelled_box(mesh, {-0.24, kGallery, -0.24}, {0.24, kGallery + 0.95, 0.24},
                 0.02);  // a pedestal as high as the rail
    const double y = kGallery + 0.95;
    const dvec2 profile[] = {{0.22, y},         {0.22, y + 0.05}, {0.18, y + 0.09},  {0.165, y + 0.13},
                             {0.16, y + 0.6},   {0.14, y + 0.98}, {0.16, y + 0.99},  {0.16, y + 1.02},
                             {0.145, y + 1.03}, {0.15, y + 1.07}, {0.175, y + 1.12}, {0.21, y + 1.15}};
    lathe(mesh, profile, 12, 1, 1.2);
    bevelled_box(mesh, {-0.25, y + 1.15, -0.25}, {0.25, kUpperSpring, 0.25}, 0.015);
    return mesh.take();
}

Mesh arcade(const Materials& m, const char* name, double span, double spring, double radius, double top,
            double thickness) {
    MeshBuilder mesh(name);
    mesh.frame(move(0, spring, 0)).texel_size(1.8);
    const double outer = radius + 0.22;
    arch_wall(mesh, {span / 2, top - spring, radius, outer, thickness, 0.05, true}, m.stone, m.blocks);
    mesh.material(m.stone);  // keystone
    const dvec3 key[8] = {{-0.09, radius - 0.03, -thickness / 2 - 0.09}, {0.09, radius - 0.03, -thickness / 2 - 0.09},
                          {-0.15, outer + 0.06, -thickness / 2 - 0.09},  {0.15, outer + 0.06, -thickness / 2 - 0.09},
                          {-0.09, radius - 0.03, thickness / 2 + 0.09},  {0.09, radius - 0.03, thickness / 2 + 0.09},
                          {-0.15, outer + 0.06, thickness / 2 + 0.09},   {0.15, outer + 0.06, thickness / 2 + 0.09}};
    mesh.hexahedron(key);
    return mesh.take();
}

Mesh vault(const Materials& m) {
    MeshBuilder mesh("vault");
    mesh.material(m.plaster).texel_size(2);
    constexpr double kRise = 1.45, kX = kBay / 2, kZ = kAisle / 2;
    // The vault has four webs, each part of a barrel: the height depends on one coordinate; creases are diagonal.
    for (int side = 0; side < 4; ++side)
        surface(mesh, 8, 4,
                [side](double u, double v) {
                    const double across = (1 - 2 * u) * (1 - v), out = 1 - v;
                    const double sign = side % 2 == 0 ? 1 : -1;
                    const double y = kSpring + kRise * std::sqrt(std::max(1 - across * across, 0.0));
                    return side < 2 ? dvec3(sign * across * kX, y, sign * out * kZ)
                                    : dvec3(sign * out * kX, y, -sign * across * kZ);
                },
                {1.5, 1});
    return mesh.take();
}

Mesh transverse_arch(const Materials& m) {
    MeshBuilder mesh("transverse arch");
    mesh.material(m.stone).texel_size(1.2);
    constexpr double kHalf = kAisle / 2, kRise = 1.33, kThick = 0.18, kAbove = 0.2;
    constexpr int kPieces = 12;
    for (int i = 0; i < kPieces; ++i) {
        const auto at = [&](int k, double x, double lift) {
            const dvec2 t = cos_sin_degrees(180.0 * k / kPieces);
            return dvec3(x, kSpring + (kRise + lift) * t.y, (kHalf + lift) * t.x);
        };
        mesh.quad(at(i, kThick, 0), at(i, -kThick, 0), at(i + 1, -kThick, 0), at(i + 1, kThick, 0));
        mesh.quad(at(i, kThick, kAbove), at(i, kThick, 0), at(i + 1, kThick, 0), at(i + 1, kThick, kAbove));
        mesh.quad(at(i, -kThick, 0), at(i, -kThick, kAbove), at(i + 1, -kThick, kAbove), at(i + 1, -kThick, 0));
    }
    return mesh.take();
}

Mesh ceiling(const Materials& m) {
    MeshBuilder mesh("gallery ceiling");
    mesh.material(m.wood).texel_size(1.2);
    constexpr double kTop = 8.98, kZ = kAisle / 2;
    mesh.quad({-kBay / 2, kTop, kZ}, {-kBay / 2, kTop, -kZ}, {kBay / 2, kTop, -kZ}, {kBay / 2, kTop, kZ});
    for (int i = 0; i < 4; ++i) {
        const double x = kBay * (i + 0.5) / 4 - kBay / 2;
        mesh.box({x - 0.07, kTop - 0.2, -kZ}, {x + 0.07, kTop, kZ},
                 MeshBuilder::kTop | MeshBuilder::kBack | MeshBuilder::kFront);
    }
    return mesh.take();
}

void baluster(MeshBuilder& mesh, double x, double y, double z, double height) {
    static constexpr dvec2 kProfile[] = {{0.06, 0},     {0.035, 0.12}, {0.075, 0.34},
                                         {0.033, 0.72}, {0.056, 0.9},  {0.056, 1}};
    std::array<dvec2, std::size(kProfile)> profile;
    std::transform(std::begin(kProfile), std::end(kProfile), profile.begin(),
                   [&](const dvec2& p) { return dvec2(p.x, p.y * height); });
    mesh.frame(move(x, y, z));
    lathe(mesh, profile, 6);
    mesh.frame(dmat4(1));
}

Mesh balustrade(const Materials& m, double length, int balusters) {
    MeshBuilder mesh("balustrade");
    mesh.material(m.stone).texel_size(1.2);
    const double half = length / 2;
    mesh.box({-half, 0, -0.13}, {half, 0.12, 0.13}, MeshBuilder::kBottom | MeshBuilder::kLeft | MeshBuilder::kRight);
    bevelled_box(mesh, {-half, 0.84, -0.14}, {half, 0.96, 0.14}, 0.02);
    for (int i = 0; i < balusters; ++i) baluster(mesh, length * (i + 0.5) / balusters - half, 0.12, 0, 0.72);
    return mesh.take();
}

}  // namespace halflight::scenes::atrium
