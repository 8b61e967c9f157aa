// The airliner's wings and tail: skins, spars, ribs, stringers, flaps.
#include <cmath>

#include "tools/scenes/airliner.h"
#include "tools/scenes/exact.h"
#include "tools/scenes/shapes.h"

namespace halflight::scenes {
namespace {

using enum AirlinerMaterial;

int index(AirlinerMaterial material) {
    return static_cast<int>(material);
}

constexpr double kFrontSpar = 0.15, kRearSpar = 0.66, kHinge = 0.70;  // shares of the chord

/// A wing from its root, s = 0, to its tip, s = 1, along +z.
struct Wing {
    std::string name;
    dvec3 root, tip;  // leading edge
    double root_chord, kink, kink_chord, tip_chord;
    double root_thickness, tip_thickness;  // shares of the chord
    int ribs;                              // at level 1
    AirlinerMaterial paint;

    double chord(double s) const {
        return s < kink ? glm::mix(root_chord, kink_chord, s / kink)
                        : glm::mix(kink_chord, tip_chord, (s - kink) / (1 - kink));
    }
    /// Returns the point on the upper (side = 1) or lower (-1) surface at a share c of the chord, `inside` below it.
    dvec3 at(double s, double c, double side, double inside = 0) const {
        const double half = 5 * glm::mix(root_thickness, tip_thickness, s) * chord(s) *
                            (0.2969 * std::sqrt(c) - 0.126 * c - 0.3516 * c * c + 0.2843 * c * c * c -
                             0.1036 * c * c * c * c);  // the NACA four-digit profile with a closed end
        return glm::mix(root, tip, s) + dvec3(chord(s) * c, side * std::max(half - inside, 0.0), 0);
    }
};

void wing_skin(MeshBuilder& mesh, const Wing& wing, double s0, double s1, const Detail& detail) {
    mesh.material(index(wing.paint));
    surface(mesh, 2 * detail(16, 4), detail(2, 1), [&](double u, double v) {
        const double w = 2 * u - 1;  // from the upper hinge line around the leading edge to the lower one
        return wing.at(glm::mix(s0, s1, v), kHinge * w * w, w < 0 ? 1 : -1);
    });
    // Flaps and ailerons: a slot separates them from the wing and from each other.
    const double gap = 0.03 * (s1 - s0);
    surface(mesh, 2 * detail(8, 3), detail(1, 1), [&](double u, double v) {
        const double w = std::abs(2 * u - 1), side = u < 0.5 ? 1 : -1, c = kHinge + 0.008 + (0.992 - kHinge) * w * w;
        const double s = glm::mix(s0 + gap, s1 - gap, v), nose = std::min(1.0, 4 * w);
        const dvec3 p = wing.at(s, c, side), middle = 0.5 * (wing.at(s, c, 1) + wing.at(s, c, -1));
        return middle + std::sqrt(1 - (1 - nose) * (1 - nose)) * (p - middle);
    });
}

void wing_rivets(MeshBuilder& mesh, const Wing& wing, double s0, double s1, const Detail& detail) {
    const int lines = detail(10, 2, 22);
    int number = 0;
    mesh.material(index(aluminium));
    const auto head = [&](double s, double c, double side) {
        const dvec3 p = wing.at(s, c, side), dx = wing.at(s, c + 0.001, side) - p, ds = wing.at(s + 0.001, c, side) - p;
        rivet(mesh, p, glm::normalize(side * glm::cross(ds, dx)), 0.005, detail.dithered(number++, 5, 4, 20));
    };
    for (const double side : {1.0, -1.0}) {
        for (int i = 0; i < lines; ++i)
            for (int k = 0, along = detail.dithered(i, 9, 1, 28); k < along; ++k)
                head(glm::mix(s0, s1, (k + 0.5) / along), glm::mix(0.05, 0.68, (i + 0.5) / lines), side);
        for (int k = 0, heads = detail(40, 4, 160); k < heads; ++k)
            head(s0 + 0.01 * (s1 - s0), glm::mix(0.03, 0.69, (k + 0.5) / heads), side);
    }
}

/// Adds the rib at s0, and up to s1 spars, stringers and pipes.
void wing_box(MeshBuilder& mesh, const Wing& wing, double s0, double s1, const Detail& detail) {
    constexpr double kSkin = 0.004;
    constexpr int kCells = 6;
    mesh.material(index(primer));
    for (int i = 0; i < kCells; ++i) {  // a rib with lightening holes
        const double c0 = glm::mix(kFrontSpar, kRearSpar, double(i) / kCells),
                     c1 = glm::mix(kFrontSpar, kRearSpar, double(i + 1) / kCells);
        const auto at = [&](double u, double v) {
            const double c = glm::mix(c0, c1, u);
            return glm::mix(wing.at(s0, c, -1, kSkin), wing.at(s0, c, 1, kSkin), v);
        };
        if (detail.above(0.2))
            pierced_surface(mesh, at, {0.5, 0.5}, {0.3, 0.3}, 4 * detail(4, 1), 1);
        else
            surface(mesh, 1, 1, at);
    }
    const int pieces = detail(3, 1);
    for (const double c : {kFrontSpar, kRearSpar}) {
        surface(mesh, 1, pieces, [&](double u, double v) {
            const double s = glm::mix(s0, s1, v);
            return glm::mix(wing.at(s, c, -1, kSkin), wing.at(s, c, 1, kSkin), u);
        });
        for (int i = 1; i <= detail(2, 0, 8); ++i) {  // stiffeners
            const double s = glm::mix(s0, s1, double(i) / (detail(2, 0, 8) + 1));
            beam(mesh, angle_section(0.03, 0.03, 0.003), wing.at(s, c, -1, 0.02) + dvec3(0.002, 0, 0),
                 wing.at(s, c, 1, 0.02) + dvec3(0.002, 0, 0), {1, 0, 0});
        }
    }
    const int stringers = detail(10, 2, 22);
    for (const double side : {1.0, -1.0})
        for (int i = 0; i < stringers; ++i) {
            const double c = glm::mix(kFrontSpar, kRearSpar, (i + 0.5) / stringers);
            if (wing.at(s1, c, 1).y - wing.at(s1, c, -1).y < 0.16) continue;
            const std::vector<dvec2> section =
                detail.above(0.4) ? zee_section(0.02, 0.04, 0.003) : bar_section(0.005, 0.04);
            beam(mesh, section, wing.at(s0, c, side, 0.026), wing.at(s1, c, side, 0.026), {0, side, 0});
        }
    if (wing.ribs < 30) return;
    for (int i = 0; i < 4; ++i) {  // fuel, hydraulic and anti-ice pipes
        static constexpr double kPlaces[] = {0.11, 0.22, 0.60, 0.675};
        const double c = kPlaces[i];
        mesh.material(index(i == 1 ? copper : titanium));
        rod(mesh, 0.5 * (wing.at(s0, c, 1) + wing.at(s0, c, -1)), 0.5 * (wing.at(s1, c, 1) + wing.at(s1, c, -1)),
            0.012 + 0.01 * (i % 2), detail(12, 3));
    }
    mesh.material(index(cable_white));
    for (int i = 0, wires = detail(8, 1, 40); i < wires; ++i) {
        const dvec3 offset(0.008 * (i % 6), 0.008 * (i / 6), 0);
        rod(mesh, wing.at(s0, 0.69, -1, 0.03) + offset, wing.at(s1, 0.69, -1, 0.03) + offset, 0.0035, detail(4, 3, 12));
    }
}

void wing_tip(MeshBuilder& mesh, const Wing& wing, const Detail& detail) {
    mesh.material(index(wing.paint));
    const double high = wing.at(1, 0.3, 1).y - wing.at(1, 0.3, -1).y;
    // The cap bulges outwards by half the wing's thickness.
    surface(mesh, detail(16, 4), detail(6, 2), [&](double u, double v) {
        const double c = (0.02 + 0.96 * u) * (0.02 + 0.96 * u), t = 2 * v - 1;  // the ends would be points
        const dvec3 p = glm::mix(wing.at(1, c, -1), wing.at(1, c, 1), v);
        return p + dvec3(0, 0, 0.6 * high * (1 - t * t) * 4 * u * (1 - u));
    });
}

}  // namespace

void add_wings(Assembly& airliner, const Detail& detail) {
    const Wing main{"wing", {22.0, -1.75, 1.6}, {43.0, 1.3, 30.4}, 12.6, 0.34, 7.3, 2.1, 0.13, 0.095, 40, grey};
    const Wing stabilizer{"stabilizer", {53.2, 1.0, 0.5}, {59.4, 1.9, 10.7}, 6.6, 0.5, 4.4, 2.2, 0.10, 0.09, 16, grey};
    const Wing fin{"fin", {49.6, 0, 2.2}, {58.6, 0, 11.8}, 8.8, 0.5, 6.0, 3.2, 0.11, 0.09, 16, blue};
    const auto build = [&](const Wing& wing, const std::string& name, const dmat4& frame) {
        const auto add = [&](const std::string& part, auto make) {
            const std::string full = name + " " + part;
            airliner.place(airliner.add(full, maker(full,
                                                    [=](MeshBuilder& mesh) {
                                                        mesh.frame(frame);
                                                        make(mesh);
                                                    })),
                           move(0, kAxisHeight, 0));
        };
        const int ribs = detail(2.5 * wing.ribs, 5, wing.ribs);
        for (int i = 0; i < ribs; ++i) {
            const double s0 = double(i) / ribs, s1 = double(i + 1) / ribs;
            const std::string number = std::to_string(i);
            add("skin " + number, [=](MeshBuilder& mesh) { wing_skin(mesh, wing, s0, s1, detail); });
            add("box " + number, [=](MeshBuilder& mesh) { wing_box(mesh, wing, s0, s1, detail); });
            if (detail.above(0.3))
                add("rivets " + number, [=](MeshBuilder& mesh) { wing_rivets(mesh, wing, s0, s1, detail); });
        }
        add("tip", [=](MeshBuilder& mesh) { wing_tip(mesh, wing, detail); });
    };
    build(main, "right wing", dmat4(1)), build(main, "left wing", grow(1, 1, -1));
    build(stabilizer, "right stabilizer", dmat4(1)), build(stabilizer, "left stabilizer", grow(1, 1, -1));
    build(fin, "fin", turn_x(-90));
}

}  // namespace halflight::scenes
