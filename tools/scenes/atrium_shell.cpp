// The single parts of the atrium: floors, roofs, stairs, the window wall, the beams, and the garden beyond.
#include <algorithm>
#include <cmath>

#include "tools/scenes/atrium.h"
#include "tools/scenes/exact.h"
#include "tools/scenes/shapes.h"

namespace halflight::scenes::atrium {
namespace {

constexpr double kWest = -kHalfLength - kBay;  // inner face of the west wall
constexpr double kEast = kHalfLength;          // inner face of the window wall

/// Adds a horizontal rectangle facing up.
void floor_piece(MeshBuilder& mesh, double x0, double x1, double z0, double z1, double y) {
    mesh.quad({x0, y, z1}, {x1, y, z1}, {x1, y, z0}, {x0, y, z0});
}

}  // namespace

Mesh shell(const Materials& m) {
    MeshBuilder mesh("shell");
    constexpr double kFace = kHalfCourt - 0.3, kUpperFace = kHalfCourt - 0.225;
    mesh.material(m.floor).texel_size(1.5);
    const double out = kHalfWidth + kWall;  // floors go on under walls and doors
    floor_piece(mesh, kWest - kWall, kEast + kWall, -out, out, 0);
    for (const double side : {1.0, -1.0})
        floor_piece(mesh, kWest - kWall, kEast, std::min(side * kFace, side * out), std::max(side * kFace, side * out),
                    kGallery);
    floor_piece(mesh, kWest - kWall, -kHalfLength + 0.3, -kFace, kFace, kGallery);

    mesh.material(m.clay).texel_size(1);  // roofs, and the tops and outsides of the outer walls

    for (const double side : {1.0, -1.0})
        floor_piece(mesh, kWest - kWall, kEast + kWall, std::min(side * kUpperFace, side * out),
                    std::max(side * kUpperFace, side * out), kRoof);
    floor_piece(mesh, kWest - kWall, -kHalfLength + 0.225, -kUpperFace, kUpperFace, kRoof);
    mesh.material(m.plaster).texel_size(2);
    mesh.quad({kWest - kWall, 0, out}, {kEast + kWall, 0, out}, {kEast + kWall, kRoof, out},
              {kWest - kWall, kRoof, out});
    mesh.quad({kEast + kWall, 0, -out}, {kWest - kWall, 0, -out}, {kWest - kWall, kRoof, -out},
              {kEast + kWall, kRoof, -out});
    mesh.quad({kWest - kWall, 0, -out}, {kWest - kWall, 0, out}, {kWest - kWall, kRoof, out},
              {kWest - kWall, kRoof, -out});

    // The aisles have end walls with an inside and an outside.
    for (const double side : {1.0, -1.0}) {
        const double z0 = std::min(side * kHalfCourt, side * kHalfWidth),
                     z1 = std::max(side * kHalfCourt, side * kHalfWidth);
        mesh.material(m.blocks).texel_size(1.8);
        mesh.quad({kEast, 0, z0}, {kEast, 0, z1}, {kEast, kGallery, z1}, {kEast, kGallery, z0});
        mesh.quad({kWest, 0, z1}, {kWest, 0, z0}, {kWest, kGallery, z0}, {kWest, kGallery, z1});
        mesh.material(m.plaster).texel_size(2);
        mesh.quad({kEast, kGallery, z0}, {kEast, kGallery, z1}, {kEast, kRoof, z1}, {kEast, kRoof, z0});
        mesh.quad({kWest, kGallery, z1}, {kWest, kGallery, z0}, {kWest, kRoof, z0}, {kWest, kRoof, z1});
        const double o0 = std::min(side * kHalfCourt, side * out), o1 = std::max(side * kHalfCourt, side * out);
        mesh.quad({kEast + kWall, 0, o1}, {kEast + kWall, 0, o0}, {kEast + kWall, kRoof, o0},
                  {kEast + kWall, kRoof, o1});
    }
    return mesh.take();
}

Mesh cornice(const Materials& m, double length) {
    MeshBuilder mesh("cornice");
    mesh.material(m.stone).texel_size(1.2);
    static constexpr dvec2 kProfile[] = {{0, 0},       {0.05, 0},    {0.05, 0.09}, {0.09, 0.12}, {0.09, 0.21},
                                         {0.22, 0.21}, {0.22, 0.27}, {0.26, 0.33}, {0.26, 0.38}, {0, 0.42}};  // (z, y)
    const double half = length / 2;
    for (std::size_t i = 0; i + 1 < std::size(kProfile); ++i) {
        const dvec2 a = kProfile[i], b = kProfile[i + 1];
        mesh.quad({-half, a.y, a.x}, {half, a.y, a.x}, {half, b.y, b.x}, {-half, b.y, b.x});
    }
    const int dentils = static_cast<int>(length / 0.3);
    for (int i = 0; i < dentils; ++i) {
        const double x = length * (i + 0.5) / dentils - half;
        mesh.box({x - 0.06, 0.13, 0.09}, {x + 0.06, 0.21, 0.18}, MeshBuilder::kBack | MeshBuilder::kTop);
    }
    return mesh.take();
}

Mesh stairs(const Materials& m) {
    MeshBuilder mesh("stairs");
    constexpr int kSteps = 28;
    constexpr double kRun = 0.28, kRise = kGallery / kSteps, kHalf = 1.25, kTop = -kHalfLength + 0.3, kRunner = 0.65;
    constexpr double kFoot = kTop + kSteps * kRun;
    for (int i = 0; i < kSteps; ++i) {
        const double x = kFoot - kRun * i, y = kRise * i, next = x - kRun, tread = y + kRise;
        mesh.material(m.stone).texel_size(1.2);
        mesh.quad({x, y, kHalf}, {x, y, -kHalf}, {x, tread, -kHalf}, {x, tread, kHalf});
        floor_piece(mesh, next, x + 0.02, -kHalf, kHalf, tread);
        mesh.quad({x, tread - 0.03, kHalf}, {x + 0.02, tread - 0.03, kHalf}, {x + 0.02, tread, kHalf},
                  {x, tread, kHalf});
        mesh.material(m.blocks).texel_size(1.8);
        mesh.quad({next, 0, kHalf}, {x, 0, kHalf}, {x, tread, kHalf}, {next, tread, kHalf});
        mesh.quad({x, 0, -kHalf}, {next, 0, -kHalf}, {next, tread, -kHalf}, {x, tread, -kHalf});
        mesh.material(m.cushion).texel_size(0.5);  // a runner, 1 cm thick
        mesh.quad({x + 0.03, y + 0.01, kRunner}, {x + 0.03, y + 0.01, -kRunner}, {x + 0.03, tread + 0.01, -kRunner},
                  {x + 0.03, tread + 0.01, kRunner});
        floor_piece(mesh, next + 0.03, x + 0.03, -kRunner, kRunner, tread + 0.01);
    }
    mesh.material(m.stone).texel_size(1.2);
    constexpr double kRail = kHalf - 0.15;
    for (const double z : {kRail, -kRail}) {
        for (int i = 1; i < kSteps; ++i) baluster(mesh, kFoot - kRun * (i + 0.5), kRise * (i + 1), z, 0.80);
        const double x0 = kFoot - 0.1, x1 = kTop - 0.02, y0 = kRise * 0.6 + 0.86, y1 = y0 + (x0 - x1) * kRise / kRun;
        const dvec3 rail[8] = {{x1, y1, z - 0.11},        {x0, y0, z - 0.11},       {x1, y1 + 0.13, z - 0.11},
                               {x0, y0 + 0.13, z - 0.11}, {x1, y1, z + 0.11},       {x0, y0, z + 0.11},
                               {x1, y1 + 0.13, z + 0.11}, {x0, y0 + 0.13, z + 0.11}};
        mesh.hexahedron(rail);
        bevelled_box(mesh, {kFoot - 0.26, 0, z - 0.16}, {kFoot + 0.06, 1.25, z + 0.16}, 0.02);
        bevelled_box(mesh, {kFoot - 0.30, 1.25, z - 0.20}, {kFoot + 0.10, 1.33, z + 0.20}, 0.02);
        mesh.material(m.brass);
        sphere(mesh, {kFoot - 0.10, 1.33 + 0.17, z}, 0.18, 20, 12);
        mesh.material(m.stone);
    }
    return mesh.take();
}

Mesh window_wall(const Materials& m) {
    MeshBuilder mesh("window wall");
    constexpr double kLight = 2 * kHalfCourt / 3, kRadius = 1.1, kSill = 0.8, kUp = 6.9;
    // The wall is built facing +z along x, then turned to face into the court at the east end.
    const dmat4 place = move(kEast + kWall / 2, 0, 0) * turn_y(-90);
    for (int light = -1; light <= 1; ++light) {
        const double x = light * kLight;
        mesh.frame(place * move(x, kUp, 0)).texel_size(1.8);
        arch_wall(mesh, {kLight / 2, kRoof - kUp, kRadius, kRadius + 0.2, kWall, 0.05, true}, m.stone, m.blocks);
        mesh.frame(place * move(x, 0, 0)).material(m.iron);
        const auto bar = [&](double x0, double y0, double x1, double y1, double depth) {
            mesh.box({x0, y0, -depth}, {x1, y1, depth});
        };
        for (int k = -1; k <= 1; ++k) {
            const double at = 0.55 * k, up = kUp + std::sqrt(kRadius * kRadius - at * at);
            bar(at - 0.03, kSill, at + 0.03, up, 0.04);
        }
        for (int k = 1; k <= 7; ++k) {
            const double y = kSill + (kUp - kSill) * k / 7, thick = k == 4 || k == 7 ? 0.05 : 0.025;
            bar(-kRadius, y - thick, kRadius, y + thick, 0.03);
        }
        std::vector<dvec3> ring;
        for (int k = 0; k <= 20; ++k) {
            const dvec2 t = cos_sin_degrees(180.0 * k / 20);
            ring.push_back({0.55 * t.x, kUp + 0.55 * t.y, 0});
        }
        tube(mesh, ring, 0.03, 6);
    }
    mesh.frame(place);
    mesh.material(m.blocks).texel_size(1.8);
    for (int pier = 0; pier <= 3; ++pier) {
        const double x = (pier - 1.5) * kLight, half = kLight / 2 - kRadius;
        const double x0 = pier == 0 ? x : x - half, x1 = pier == 3 ? x : x + half;
        mesh.box({x0, kSill, -kWall / 2}, {x1, kUp, kWall / 2}, MeshBuilder::kTop | MeshBuilder::kBottom);
    }
    mesh.box({-kHalfCourt, 0, -kWall / 2}, {kHalfCourt, kSill - 0.1, kWall / 2},
             MeshBuilder::kTop | MeshBuilder::kBottom);
    mesh.material(m.stone).texel_size(1.2);
    bevelled_box(mesh, {-kHalfCourt, kSill - 0.1, -kWall / 2 - 0.1}, {kHalfCourt, kSill, kWall / 2 + 0.12}, 0.02);
    return mesh.take();
}

Mesh beams(const Materials& m) {
    MeshBuilder mesh("beams");
    mesh.material(m.wood).texel_size(1.2);
    for (int i = 1; i < kBays; ++i) {
        const double x = kBay * i - kHalfLength;
        bevelled_box(mesh, {x - 0.12, 8.72, -kHalfCourt}, {x + 0.12, 9.04, kHalfCourt}, 0.015);
    }
    for (int i = 0; i < 5; ++i) {
        const double z = 1.4 * (i - 2);
        bevelled_box(mesh, {-kHalfLength, 9.04, z - 0.07}, {kHalfLength, 9.2, z + 0.07}, 0.01);
    }
    return mesh.take();
}

Mesh garden(const Materials& m) {
    MeshBuilder mesh("garden");
    mesh.material(m.lawn);
    floor_piece(mesh, kEast + kWall, 90, -70, 70, -0.05);
    const auto hedge = [&](double x, double z, double length, double height) {
        surface(mesh, 24, 8, [&](double u, double v) {  // an arch from foot to foot
            const dvec2 t = cos_sin_degrees(180 * v);
            const double bump = 1 + 0.06 * sine(23 * u * length + 9 * v) * sine(17 * v + 5 * u * length);
            return dvec3(x - 0.6 * t.x * bump, height * t.y * bump - 0.05, z + length * (u - 0.5));
        });
    };
    hedge(21, -5, 8, 1.3), hedge(21, 5, 8, 1.3), hedge(40, 0, 60, 3.5);
    for (int i = 0; i < 7; ++i) {  // cypresses
        const double height = 5.5 + 1.3 * (hash(static_cast<std::uint32_t>(i)) * 0x1p-32), girth = 0.7 + 0.06 * i;
        mesh.frame(move(25 + 2.5 * (i % 3), -0.1, -12 + 4.0 * i));
        surface(mesh, 14, 10, [&](double u, double v) {
            const double r =
                girth * 1.9 * std::sqrt(v) * (1 - v) * (1 + 0.10 * sine(2 * kPi * 5 * u + 20 * v) * sine(40 * v));
            return dvec3(r * cosine(2 * kPi * u), height * v, -r * sine(2 * kPi * u));
        });
        mesh.frame(dmat4(1));
    }
    return mesh.take();
}

}  // namespace halflight::scenes::atrium
