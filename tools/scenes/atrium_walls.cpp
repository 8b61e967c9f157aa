// The atrium's walls with openings: arcades, doors, niches and windows.
#include <algorithm>
#include <array>
#include <cmath>

#include "tools/scenes/atrium.h"
#include "tools/scenes/exact.h"
#include "tools/scenes/shapes.h"

namespace halflight::scenes::atrium {
namespace {

/// Returns the angles of points on a half circle of `radius` from 0 (right) to 180 (left). They include the points
/// where rays through its centre meet the corners of the rectangle |x| <= half, y <= rise.
std::vector<double> arch_angles(int pieces, double corner) {
    std::vector<double> angles;
    for (int i = 0; i <= pieces; ++i) angles.push_back(180.0 * i / pieces);
    for (const double extra : {corner, 180 - corner}) angles.push_back(extra);
    std::sort(angles.begin(), angles.end());
    angles.erase(std::unique(angles.begin(), angles.end()), angles.end());
    return angles;
}

/// Returns the angle in degrees of the corner (x, y) from the arch's centre, by bisection on exact sines.
double corner_angle(double x, double y) {
    double low = 0, high = 90;
    for (int i = 0; i < 60; ++i) {
        const double middle = (low + high) / 2;
        const dvec2 t = cos_sin_degrees(middle);
        (t.y * x < t.x * y ? low : high) = middle;
    }
    return low;
}

}  // namespace

void arch_wall(MeshBuilder& mesh, const ArchWall& w, int ring_material, int wall_material) {
    const std::vector<double> angles = arch_angles(14, corner_angle(w.half, w.rise));
    const auto on_circle = [](double r, const dvec2& t, double z) { return dvec3(r * t.x, r * t.y, z); };
    const auto on_frame = [&](const dvec2& t, double z) {
        const double reach =
            std::min(std::abs(t.x) > 1e-9 ? w.half / std::abs(t.x) : 1e9, t.y > 1e-9 ? w.rise / t.y : 1e9);
        return dvec3(reach * t.x, reach * t.y, z);
    };
    const double face = w.depth / 2, ring = face + w.proud;
    for (std::size_t i = 0; i + 1 < angles.size(); ++i) {
        const dvec2 a = cos_sin_degrees(angles[i]), b = cos_sin_degrees(angles[i + 1]);
        for (const double side : {1.0, -1.0}) {
            if (side < 0 && !w.back) continue;
            const dvec2 p = side > 0 ? a : b, q = side > 0 ? b : a;  // counter-clockwise from that side
            mesh.material(wall_material);
            mesh.quad(on_circle(w.outer, p, side * face), on_frame(p, side * face), on_frame(q, side * face),
                      on_circle(w.outer, q, side * face));
            mesh.material(ring_material);
            mesh.quad(on_circle(w.radius, p, side * ring), on_circle(w.outer, p, side * ring),
                      on_circle(w.outer, q, side * ring), on_circle(w.radius, q, side * ring));
            mesh.quad(on_circle(w.outer, p, side * ring), on_circle(w.outer, p, side * face),
                      on_circle(w.outer, q, side * face), on_circle(w.outer, q, side * ring));
        }
        const double rear = w.back ? -ring : -face;
        mesh.material(ring_material);
        mesh.quad(on_circle(w.radius, a, rear), on_circle(w.radius, a, ring), on_circle(w.radius, b, ring),
                  on_circle(w.radius, b, rear));
    }
}

Mesh door_bay(const Materials& m) {
    MeshBuilder mesh("door bay");
    constexpr double kHalf = kBay / 2;
    mesh.material(m.blocks).texel_size(1.8);
    pierced_wall(mesh, kHalf, 0, kGallery, {-0.62, 0}, {0.62, 2.4}, 0.3);
    mesh.material(m.stone).texel_size(1.2);  // surround and cornice
    mesh.box({-0.82, 0, 0}, {-0.62, 2.4, 0.07}, MeshBuilder::kBottom | MeshBuilder::kBack | MeshBuilder::kTop);
    mesh.box({0.62, 0, 0}, {0.82, 2.4, 0.07}, MeshBuilder::kBottom | MeshBuilder::kBack | MeshBuilder::kTop);
    mesh.box({-0.82, 2.4, 0}, {0.82, 2.62, 0.07}, MeshBuilder::kBack);
    bevelled_box(mesh, {-0.95, 2.62, -0.1}, {0.95, 2.76, 0.18}, 0.02);
    mesh.material(m.wood).texel_size(1.2);
    mesh.quad({-0.62, 0, -0.25}, {0.62, 0, -0.25}, {0.62, 2.4, -0.25}, {-0.62, 2.4, -0.25});
    for (const double x : {-0.58, 0.02})
        for (int row = 0; row < 3; ++row)
            bevelled_box(mesh, {x + 0.06, 0.14 + 0.76 * row, -0.28}, {x + 0.50, 0.76 + 0.76 * row, -0.22}, 0.025);
    mesh.material(m.brass);
    sphere(mesh, {-0.05, 1.07, -0.20}, 0.035, 8, 6);
    sphere(mesh, {0.05, 1.07, -0.20}, 0.035, 8, 6);
    return mesh.take();
}

Mesh niche_bay(const Materials& m) {
    MeshBuilder mesh("niche bay");
    constexpr double kHalf = kBay / 2, kRadius = 0.55, kSill = 0.9, kUp = 2.3, kDepth = 0.4;
    mesh.texel_size(1.8).material(m.blocks);
    pierced_wall(mesh, kHalf, 0, kUp, {-kRadius, kSill}, {kRadius, kUp}, kDepth);
    mesh.frame(move(0, kUp, -kDepth / 2));
    arch_wall(mesh, {kHalf, kGallery - kUp, kRadius, kRadius + 0.16, kDepth, 0.03, false}, m.stone, m.blocks);
    mesh.frame(dmat4(1)).material(m.plaster);
    mesh.quad({-kRadius, kSill, -kDepth}, {kRadius, kSill, -kDepth}, {kRadius, kUp + kRadius, -kDepth},
              {-kRadius, kUp + kRadius, -kDepth});
    mesh.material(m.stone).texel_size(1.2);
    bevelled_box(mesh, {-0.75, kSill - 0.12, -0.3}, {0.75, kSill, 0.12}, 0.02);
    return mesh.take();
}

Mesh window_bay(const Materials& m) {
    MeshBuilder mesh("window bay");
    mesh.material(m.plaster).texel_size(2);
    pierced_wall(mesh, kBay / 2, kGallery, kRoof - 0.1, {-0.5, 6.0}, {0.5, 7.7}, 0.22);
    mesh.material(m.stone).texel_size(1.2);
    bevelled_box(mesh, {-0.68, 5.88, -0.2}, {0.68, 6.0, 0.14}, 0.02);
    bevelled_box(mesh, {-0.66, 7.7, -0.2}, {0.66, 7.86, 0.1}, 0.02);
    mesh.material(m.wood);
    mesh.quad({-0.5, 6, -0.2}, {0.5, 6, -0.2}, {0.5, 7.7, -0.2}, {-0.5, 7.7, -0.2});
    for (const double x : {-0.48, 0.02})
        for (int slat = 0; slat < 9; ++slat) {  // louvres
            const double y = 6.08 + 0.17 * slat;
            mesh.quad({x, y, -0.12}, {x + 0.46, y, -0.12}, {x + 0.46, y + 0.14, -0.19}, {x, y + 0.14, -0.19});
        }
    return mesh.take();
}

}  // namespace halflight::scenes::atrium
