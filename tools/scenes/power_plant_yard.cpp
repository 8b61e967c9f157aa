// The surroundings of a power plant's boiler house: precipitator, stack, pipe racks, tanks, cooling tower, coal
// conveyor, turbine hall.
#include <cmath>

#include "tools/scenes/exact.h"
#include "tools/scenes/power_plants.h"
#include "tools/scenes/shapes.h"

namespace halflight::scenes {
namespace {

using enum PlantMaterial;

int index(PlantMaterial material) {
    return static_cast<int>(material);
}

void slab(MeshBuilder& mesh, double x0, double x1, double z0, double z1) {
    mesh.material(index(concrete)).quad({x0, 0.03, z1}, {x1, 0.03, z1}, {x1, 0.03, z0}, {x0, 0.03, z0});
}

void stack(MeshBuilder& mesh, const Detail& detail) {
    constexpr double kHigh = 118, kFoot = 4.6, kHead = 2.8;
    constexpr int kBands = 8;
    const int sides = detail(64, 10);
    const auto radius = [](double y) { return glm::mix(kFoot, kHead, std::sqrt(y / kHigh)); };
    for (int i = 0; i < kBands; ++i) {
        std::vector<dvec2> profile;
        const double y0 = i == 0 ? 0 : 50 + (kHigh - 50) * i / kBands, y1 = 50 + (kHigh - 50) * (i + 1) / kBands;
        for (int k = 0, steps = detail(i == 0 ? 8 : 3, 1); k <= steps; ++k) {
            const double y = glm::mix(y0, y1, double(k) / steps);
            profile.emplace_back(radius(y), y);
        }
        mesh.material(index(i == 0 ? concrete : i % 2 == 0 ? white : red));
        lathe(mesh, profile, sides);
    }
    const dvec2 inner[] = {{kHead, kHigh}, {kHead - 0.35, kHigh + 0.1}, {kHead - 0.35, kHigh - 25}};
    mesh.material(index(dark_steel));
    lathe(mesh, inner, sides);
    for (const double y : {40.0, 78.0, 112.0}) {  // platforms all around
        const double r = radius(y);
        const int bars = detail(70, 6, 400), pieces = detail(32, 10);
        mesh.material(index(galvanized));
        for (int i = 0; i < bars; ++i) {
            const Local bar(mesh, turn_y(360.0 * i / bars));
            mesh.box({r - 0.02, y - 0.04, -0.004}, {r + 1.3, y, 0.004}, MeshBuilder::kBottom);
        }
        std::vector<dvec3> ring;
        for (int i = 0; i <= pieces; ++i) {
            const dvec2 t = (r + 1.25) * ring_of(pieces)[static_cast<std::size_t>(i)];
            ring.emplace_back(t.x, y, t.y);
        }
        for (std::size_t i = 0; i + 1 < ring.size(); ++i) {
            mesh.material(index(dark_steel));
            beam(mesh, bar_section(0.02, 0.16), ring[i] - dvec3(0, 0.05, 0), ring[i + 1] - dvec3(0, 0.05, 0));
        }
        mesh.material(index(yellow));
        if (detail.above(0.14)) handrail(mesh, ring, 1.2, detail(6, 3, 24));
    }
    if (!detail.above(0.1)) return;
    mesh.material(index(galvanized));  // ladder
    const int rungs = detail(120, 20, 360);
    for (const double x : {-0.25, 0.25}) {
        const dvec3 rail[] = {{x, 2, radius(2) + 0.25}, {x, kHigh, radius(kHigh) + 0.25}};
        pipe(mesh, rail, 0.025, detail(6, 3, 16), 0, 1, 6);
    }
    for (int i = 0; i < rungs; ++i) {
        const double y = 2.2 + (kHigh - 2.4) * i / rungs,
                     z = glm::mix(radius(2), radius(kHigh), (y - 2) / (kHigh - 2)) + 0.25;
        rod(mesh, {-0.25, y, z}, {0.25, y, z}, 0.012, detail(6, 3, 16));
    }
}

void precipitator(MeshBuilder& mesh, const Detail& detail) {
    constexpr double kX = 8, kZ = 7, kLow = 9, kHigh = 22;
    mesh.material(index(cladding));
    mesh.box({-kX, kLow, -kZ}, {kX, kHigh, kZ}, MeshBuilder::kBottom);
    for (int i = 0; i < 4; ++i)  // hoppers
        for (int j = 0; j < 3; ++j) {
            const double x = kX * (i - 1.5) / 2, z = kZ * (j - 1) * 2 / 3, a = kX / 4, b = kZ / 3;
            const dvec3 corners[8] = {{x - 0.4, 4.5, z - 0.4}, {x + 0.4, 4.5, z - 0.4}, {x - a, kLow, z - b},
                                      {x + a, kLow, z - b},    {x - 0.4, 4.5, z + 0.4}, {x + 0.4, 4.5, z + 0.4},
                                      {x - a, kLow, z + b},    {x + a, kLow, z + b}};
            mesh.material(index(cladding));
            mesh.hexahedron(corners, MeshBuilder::kTop);
            mesh.material(index(dark_steel));
            if (detail.above(0.1)) rod(mesh, {x, 4.6, z}, {x, 3.2, z}, 0.25, detail(16, 4), true);
        }
    mesh.material(index(dark_steel));
    const int ribs = detail(14, 3, 20);
    for (int i = 0; i <= ribs; ++i) {
        const double x = kX * (2.0 * i / ribs - 1), z = kZ * (2.0 * i / ribs - 1);
        for (const double side : {-1.0, 1.0}) {
            beam(mesh, bar_section(0.12, 0.3), {x, kLow, side * (kZ + 0.13)}, {x, kHigh, side * (kZ + 0.13)},
                 {0, 0, 1});
            beam(mesh, bar_section(0.12, 0.3), {side * (kX + 0.13), kLow, z}, {side * (kX + 0.13), kHigh, z},
                 {1, 0, 0});
        }
    }
    for (const double x : {-kX, -kX / 2, 0.0, kX / 2, kX})
        for (const double z : {-kZ, 0.0, kZ})
            beam(mesh, i_section(0.4, 0.4, 0.025), {x, 0, z}, {x, kLow, z}, {0, 0, 1});
    for (int i = 0; i < detail(120, 2, 12); ++i) {  // insulators of the high voltage on the roof
        const double x = kX * (i % 4 - 1.5) / 2, z = kZ * (i / 4 - 1) * 2 / 3;
        const Local place(mesh, move(x, kHigh - 0.01, z));
        std::vector<dvec2> profile{{0.4, 0}, {0.4, 0.5}, {0.12, 0.55}};
        for (int k = 0, sheds = detail(6, 1, 12); k < sheds; ++k) {
            const double y = 0.6 + 1.2 * k / sheds;
            profile.emplace_back(0.1, y), profile.emplace_back(0.22, y + 0.3 / sheds);
            profile.emplace_back(0.1, y + 0.6 / sheds);
        }
        profile.emplace_back(0.0, 1.9);
        mesh.material(index(ceramic));
        lathe(mesh, profile, detail(20, 5));
    }
    const dvec3 out[] = {{0, 15, -kZ + 0.5}, {0, 15, -kZ - 5}, {0, 8, -kZ - 5}, {0, 8, -kZ - 14}};
    mesh.material(index(silver));
    rect_duct(mesh, out, {1, 0, 0}, 4, 4, detail.above(0.16) ? 1.5 : 0);
}

constexpr double kRackPipes[] = {0.30, 0.20, 0.12, 0.25, 0.10, 0.16};  // radii

void portal(MeshBuilder& mesh, const Detail& detail) {
    const std::vector<dvec2> section = detail.above(0.12) ? i_section(0.3, 0.3, 0.02) : bar_section(0.3, 0.3);
    mesh.material(index(primer));
    for (const double z : {-1.9, 1.9}) beam(mesh, section, {0, 0, z}, {0, 7.4, z}, {1, 0, 0});
    for (const double y : {4.2, 7.0}) beam(mesh, section, {0, y, -2.2}, {0, y, 2.2});
    if (!detail.above(0.25)) return;
    mesh.material(index(bolts));
    for (const double z : {-1.9, 1.9})
        for (const double y : {4.2, 7.0})
            for (const double dy : {-0.11, 0.11})
                for (const double dz : {-0.2, 0.2})
                    for (const double side : {-1.0, 1.0})
                        bolt(mesh, {side * 0.151, y + 0.8 * dy, z + 0.5 * dz}, {side, 0, 0}, 0.018, detail(6, 4, 24));
}

/// Adds the pipes of a rack of 10 bays of 6 m along x, in two layers, with loops for expansion.
void rack_pipes(MeshBuilder& mesh, const Detail& detail) {
    static constexpr PlantMaterial kPaints[] = {silver, green, red, silver, yellow, blue};
    for (int layer = 0; layer < 2; ++layer)
        for (int i = 0; i < 6; ++i) {
            const double r = kRackPipes[(i + 2 * layer) % 6], y = (layer == 0 ? 4.36 : 7.16) + r, z = 0.62 * (i - 2.5);
            std::vector<dvec3> path{{-30, y, z}};
            if ((i + layer) % 2 == 0) {
                const double up = y + 1.0 + 0.15 * i;
                for (const dvec2 p :
                     {dvec2(-2.2 - 0.2 * i, y), {-2.2 - 0.2 * i, up}, {2.2 + 0.2 * i, up}, {2.2 + 0.2 * i, y}})
                    path.emplace_back(p.x, p.y, z);
            }
            path.emplace_back(30, y, z);
            mesh.material(index(kPaints[(i + layer) % 6]));
            pipe(mesh, path, r, detail(20, 4), 2.5 * r, detail(6, 1), detail.above(1) ? 1.5 : 0);
            if (!detail.above(0.2)) continue;
            mesh.material(index(dark_steel));
            for (int k = 0; k <= 10; ++k)  // shoes
                mesh.box({-30 + 6.0 * k - 0.2, y - r - 0.015, z - 0.04}, {-30 + 6.0 * k + 0.2, y - 0.9 * r, z + 0.04});
        }
}

void valve(MeshBuilder& mesh, const Detail& detail) {
    const int sides = detail(20, 5);
    mesh.material(index(green));
    sphere(mesh, {0, 0, 0}, 0.42, sides, std::max(3, sides / 2));
    const dvec2 bonnet[] = {{0.22, 0.3}, {0.22, 0.6}, {0.3, 0.6}, {0.3, 0.72}, {0.1, 0.78}, {0.08, 1.1}, {0.0, 1.1}};
    lathe(mesh, bonnet, sides);
    std::vector<dvec3> rim;
    const int pieces = detail(20, 5);
    for (int i = 0; i <= pieces; ++i) {
        const dvec2 t = 0.35 * ring_of(pieces)[static_cast<std::size_t>(i)];
        rim.emplace_back(t.x, 1.02, t.y);
    }
    mesh.material(index(red));
    scenes::tube(mesh, rim, 0.022, detail(8, 3, 24));
    for (int i = 0; i < 4; ++i) {
        const dvec2 t = 0.35 * ring_of(4)[static_cast<std::size_t>(i)];
        rod(mesh, {0, 1.02, 0}, {t.x, 1.02, t.y}, 0.015, detail(6, 3, 16));
    }
    mesh.material(index(bolts));
    for (int i = 0, count = detail(8, 4, 16); i < count; ++i) {
        const dvec2 t = 0.26 * ring_of(count)[static_cast<std::size_t>(i)];
        bolt(mesh, {t.x, 0.72, t.y}, {0, 1, 0}, 0.02, detail(6, 4, 24));
    }
}

void tank(MeshBuilder& mesh, const Detail& detail) {
    constexpr double kRadius = 7, kHigh = 12;
    const int sides = detail(72, 10);
    mesh.material(index(white));
    for (int course = 0; course < 5; ++course) {  // plates, the lower ones a little thicker
        const double y0 = kHigh * course / 5, y1 = kHigh * (course + 1) / 5, r = kRadius - 0.006 * course;
        const dvec2 profile[] = {{r, y0}, {r, y1}, {r - 0.006, y1 + 0.001}};
        lathe(mesh, profile, sides);
    }
    const dvec2 roof[] = {
        {kRadius + 0.1, kHigh - 0.1}, {kRadius + 0.1, kHigh + 0.02}, {3.5, kHigh + 0.8}, {0, kHigh + 1.2}};
    lathe(mesh, roof, sides);
    const int treads = detail(50, 8, 60);
    std::vector<dvec3> line;
    if (!detail.above(0.1)) return;
    for (int i = 0; i <= treads; ++i) {
        const dvec2 t = cos_sin_degrees(170.0 * i / treads);
        const double y = kHigh * i / treads;
        if (i % 3 == 0 || i == treads) line.push_back((kRadius + 0.85) * dvec3(t.x, 0, -t.y) + dvec3(0, y, 0));
        const Local tread(mesh, turn_y(170.0 * i / treads) * move(kRadius + 0.45, y, 0));
        mesh.material(index(galvanized));
        if (detail.above(0.6))
            grating(mesh, {0.42, 0.14}, detail(8, 3, 24), detail(3, 1, 8));
        else
            mesh.box({-0.42, -0.03, -0.14}, {0.42, 0, 0.14});
    }
    if (!detail.above(0.14)) return;
    mesh.material(index(yellow));
    handrail(mesh, line, 1.0, detail(6, 3, 24));
    std::vector<dvec3> rim;
    const int pieces = detail(24, 8);
    for (int i = 0; i <= pieces; ++i) {
        const dvec2 t = (kRadius - 0.2) * ring_of(pieces)[static_cast<std::size_t>(i)];
        rim.emplace_back(t.x, kHigh + 0.05, t.y);
    }
    handrail(mesh, rim, 1.5, detail(6, 3, 24));
}

void cooling_tower(MeshBuilder& mesh, const Detail& detail) {
    constexpr double kLow = 6, kHigh = 62;
    const int sides = detail(120, 16), steps = detail(30, 6);
    const auto radius = [](double y) {
        const double up = (y - 46) / 30;
        return 11.5 * std::sqrt(1 + up * up);
    };
    std::vector<dvec2> outer, inner;
    for (int i = 0; i <= steps; ++i) {
        const double y = glm::mix(kLow, kHigh, double(i) / steps);
        outer.emplace_back(radius(y), y);
        inner.insert(inner.begin(), dvec2(radius(y) - 0.3, y));
    }
    outer.insert(outer.end(), inner.begin(), inner.end());
    outer.push_back(outer.front());
    mesh.material(index(concrete));
    lathe(mesh, outer, sides);
    const int legs = detail(20, 8, 40);
    for (int i = 0; i < legs; ++i)
        for (const double lean : {-0.5, 0.5}) {
            const dvec2 foot = cos_sin_degrees(360.0 * i / legs), head = cos_sin_degrees(360.0 * (i + lean) / legs);
            const double r = radius(0) + 0.4, top = radius(kLow) - 0.15;
            rod(mesh, {r * foot.x, 0, r * foot.y}, {top * head.x, kLow + 0.2, top * head.y}, 0.3, detail(10, 4, 40));
        }
    const dvec2 basin[] = {
        {radius(0) + 3, 0}, {radius(0) + 3, 1.2}, {radius(0) + 2.7, 1.2}, {radius(0) + 2.7, 0.6}, {0, 0.6}};
    lathe(mesh, basin, sides);
    if (!detail.above(0.3)) return;
    mesh.material(index(galvanized));  // pipes that spread the water
    for (int i = 0, pipes = detail(24, 8, 80); i < pipes; ++i) {
        const double x = (radius(9) - 1) * (2.0 * (i + 0.5) / pipes - 1);
        const double reach = std::sqrt((radius(9) - 0.6) * (radius(9) - 0.6) - x * x);
        rod(mesh, {x, 9, -reach}, {x, 9, reach}, 0.08, detail(8, 3, 24));
    }
}

/// Adds a section of a coal conveyor along +x, 6 m long: a truss around belt, rollers and walkway.
void conveyor(MeshBuilder& mesh, const Detail& detail) {
    constexpr double kLong = 6, kHigh = 2.6, kWide = 1.6;
    const std::vector<dvec2> chord = bar_section(0.14, 0.14), thin = bar_section(0.08, 0.08);
    mesh.material(index(primer));
    for (const double y : {0.0, kHigh})
        for (const double z : {-kWide, kWide}) beam(mesh, chord, {0, y, z}, {kLong, y, z});
    for (const double z : {-kWide, kWide})
        for (int i = 0; i < 2; ++i) {
            beam(mesh, thin, {3.0 * i, 0.06, z}, {3.0 * i, kHigh - 0.06, z}, {1, 0, 0});
            beam(mesh, thin, {3.0 * i + (i % 2 ? 3 : 0), 0.06, z}, {3.0 * i + (i % 2 ? 0 : 3), kHigh - 0.06, z},
                 {0, 0, 1});
        }
    for (int i = 0; i < 2; ++i)
        for (const double y : {0.0, kHigh})
            beam(mesh, thin, {3.0 * i + 0.1, y, -kWide + 0.06}, {3.0 * i + 0.1, y, kWide - 0.06});
    mesh.material(index(cladding));
    mesh.quad({0, kHigh + 0.08, kWide + 0.2}, {kLong, kHigh + 0.08, kWide + 0.2}, {kLong, kHigh + 0.08, -kWide - 0.2},
              {0, kHigh + 0.08, -kWide - 0.2});
    mesh.material(index(rubber));
    surface(mesh, detail(6, 2), 1, [](double u, double v) {  // the belt's trough
        const double z = 1.2 * u - 1.1, dip = 2 * u - 1;
        return dvec3(kLong * (1 - v), 0.75 + 0.22 * dip * dip, z);
    });
    for (int i = 0, idlers = detail(5, 0, 6); i < idlers; ++i) {
        const double x = kLong * (i + 0.5) / idlers;
        mesh.material(index(galvanized));
        rod(mesh, {x, 0.66, -0.7}, {x, 0.66, -0.3}, 0.07, detail(14, 3, 48), true);
        rod(mesh, {x, 0.72, -0.25}, {x, 0.92, 0.1}, 0.07, detail(14, 3, 48), true);
        rod(mesh, {x, 0.72, -0.75}, {x, 0.92, -1.1}, 0.07, detail(14, 3, 48), true);
    }
    const Local walk(mesh, move(kLong / 2, 0.12, 0.85));
    mesh.material(index(galvanized));
    if (detail.above(0.12))
        grating(mesh, {kLong / 2, 0.6}, detail(40, 8, 200), detail(4, 1, 12));
    else
        mesh.box({-kLong / 2, -0.03, -0.6}, {kLong / 2, 0, 0.6});
}

}  // namespace

void add_yard(Plant& plant) {
    plant.place(plant.add("ground", [](MeshBuilder& mesh, const Detail&) { slab(mesh, -66, 66, -66, 66); }));
    plant.place(plant.add("stack", stack), move(0, 0, -56));
    plant.place(plant.add("precipitator", precipitator), move(0, 0, -31));
    plant.place(plant.add("cooling tower", cooling_tower), move(42, 0, -38));
    const std::uint32_t frame = plant.add("portal", portal), run = plant.add("rack pipes", rack_pipes);
    const std::uint32_t stop = plant.add("valve", valve);
    std::vector<std::uint32_t> joints;
    for (const double r : kRackPipes)
        joints.push_back(
            plant.add("flange " + std::to_string(joints.size()), [r](MeshBuilder& mesh, const Detail& detail) {
                mesh.material(index(bolts));
                flange(mesh, r, detail(20, 5), detail(12, 4, 24));
            }));
    for (const dmat4& rack : {move(0, 0, 20.2), move(-24, 0, -20) * turn_y(90)}) {
        plant.place(run, rack);
        for (int i = 0; i <= 10; ++i) plant.place(frame, rack * move(-30 + 6 * i, 0, 0));
        for (int layer = 0; layer < 2; ++layer)
            for (int i = 0; i < 6; ++i) {
                const int size = (i + 2 * layer) % 6;
                const double r = kRackPipes[size], y = (layer == 0 ? 4.36 : 7.16) + r, z = 0.62 * (i - 2.5);
                for (int k = 0; k < 10; ++k) {
                    const double x = -27.8 + 6 * k + 0.3 * (i % 3);
                    if (std::abs(x) < 6 || !plant.detail.has(60 * layer + 10 * i + k, 0.12, 0.4)) continue;
                    plant.place(joints[static_cast<std::size_t>(size)], rack * move(x, y, z) * turn_z(90));
                    if ((k + i) % 5 == 0) plant.place(stop, rack * move(x + 0.8, y, z));
                }
            }
    }
    const std::uint32_t store = plant.add("tank", tank);
    for (int i = 0; i < 3; ++i) plant.place(store, move(-46, 0, -52 + 20 * i));
    // The conveyor climbs from the coal pile to the bunkers of the boiler house.
    const std::uint32_t belt = plant.add("conveyor", conveyor);
    constexpr double kClimb = 24;  // degrees
    for (int i = 0; i < 9; ++i) plant.place(belt, move(62, 2.5, 6) * turn_z(-kClimb) * move(-6.0 * (i + 1), 0, 0));
    plant.place(plant.add("coal", [](MeshBuilder& mesh, const Detail& detail) {
        mesh.material(index(coal));
        const int n = detail(40, 6, 400);
        surface(mesh, n, n, [](double u, double v) {
            const dvec2 p = 2.0 * dvec2(u, v) - 1.0;
            const double edge = (1 - p.x * p.x) * (1 - p.y * p.y);
            return dvec3(50 + 13 * p.y, 0.02 + 7 * edge + 0.25 * edge * sine(31 * p.x + 3 * p.y) * sine(23 * p.y),
                         34 + 18 * p.x);
        });
        mesh.material(index(dark_steel));
        for (int i = 1; i < 8; i += 3)  // trestles of the conveyor
            for (const double z : {-1.5, 1.5}) {
                const dvec3 head(move(62, 2.5, 6) * turn_z(-kClimb) * dvec4(-6.0 * i, -0.05, z, 1));
                beam(mesh, bar_section(0.3, 0.3), {head.x, 0, head.z + z}, head, {1, 0, 0});
            }
    }));
}

void add_turbine_hall(Plant& plant) {
    constexpr double kX = 30, kZ0 = 25, kZ1 = 51, kEave = 16, kRise = 3;
    const double middle = 0.5 * (kZ0 + kZ1);
    const std::uint32_t frame = plant.add("hall frame", [=](MeshBuilder& mesh, const Detail& detail) {
        const std::vector<dvec2> heavy = detail.above(0.12) ? i_section(0.4, 0.6, 0.03) : bar_section(0.4, 0.6);
        const std::vector<dvec2> thin = bar_section(0.12, 0.12);
        mesh.material(index(dark_steel));
        for (const double z : {kZ0, kZ1}) beam(mesh, heavy, {0, 0, z}, {0, kEave, z}, {0, 0, 1});
        const int panels = detail(8, 2, 12);
        const auto upper = [&](double t) {
            return dvec3(0, kEave + 1 + kRise * (1 - std::abs(2 * t - 1)), glm::mix(kZ0, kZ1, t));
        };
        const auto lower = [&](double t) { return dvec3(0, kEave - 0.8, glm::mix(kZ0, kZ1, t)); };
        beam(mesh, heavy, upper(0), upper(0.5)), beam(mesh, heavy, upper(0.5), upper(1));
        beam(mesh, bar_section(0.2, 0.2), lower(0), lower(1));
        for (int i = 0; i < panels; ++i) {
            beam(mesh, thin, lower((i + 0.0) / panels), upper((i + 0.5) / panels), {1, 0, 0});
            beam(mesh, thin, upper((i + 0.5) / panels), lower((i + 1.0) / panels), {1, 0, 0});
        }
    });
    for (int i = 0; i <= 10; ++i) plant.place(frame, move(-kX + 6 * i, 0, 0));
    const std::uint32_t roof = plant.add("roof", [=](MeshBuilder& mesh, const Detail& detail) {
        const int waves = detail(20, 2, 40);
        const double deep = 0.08;
        mesh.material(index(cladding));
        for (int i = 0; i < waves; ++i)
            for (const double side : {-1.0, 1.0}) {
                const auto x = [&](double k) { return -side * 6 * ((i + k) / waves - 0.5); };
                const double at[] = {0, 0.35, 0.5, 0.85, 1}, h[] = {0, 0, deep, deep, 0};
                const double ridge = kEave + kRise + 1.42, eave = kEave + 1.25, out = side * (0.5 * (kZ1 - kZ0) + 0.8);
                for (int k = 0; k < 4; ++k)
                    mesh.quad({x(at[k]), eave + h[k], middle + out}, {x(at[k]), ridge + h[k], middle},
                              {x(at[k + 1]), ridge + h[k + 1], middle}, {x(at[k + 1]), eave + h[k + 1], middle + out});
            }
    });
    for (int i = 0; i < 7; ++i) plant.place(roof, move(-kX + 3 + 6 * i, 0, 0));  // the rest is under construction
    const std::uint32_t set = plant.add("turbine", [](MeshBuilder& mesh, const Detail& detail) {
        const int sides = detail(72, 8);
        const auto turned = [&](PlantMaterial material, std::span<const dvec2> profile, double joint) {
            mesh.material(index(material));
            const Local axis(mesh, turn_z(-90));
            lathe(mesh, profile, sides);
            mesh.material(index(bolts));
            if (!detail.above(0.15)) return;
            // Bolts along the horizontal joint of the casing, on its rim.
            const double x0 = profile.front().y, x1 = profile.back().y;
            for (int i = 0, count = detail(24, 4, 72); i < count; ++i)
                for (const double side : {-1.0, 1.0})
                    bolt(mesh, {-0.05, glm::mix(x0 + 0.3, x1 - 0.3, (i + 0.5) / count), side * joint}, {-1, 0, 0}, 0.06,
                         detail(6, 4, 32));
            mesh.material(index(material));
            mesh.box({-0.05, x0 + 0.1, -joint - 0.15}, {0.05, x1 - 0.1, joint + 0.15});
        };
        const dvec2 high[] = {{0.5, -15}, {1.1, -14.8}, {1.5, -13.8}, {1.6, -12}, {1.3, -10.8}, {0.5, -10.5}};
        const dvec2 mid[] = {{0.5, -9.5}, {1.4, -9.3}, {2.0, -8}, {2.1, -6.5}, {1.5, -5.2}, {0.5, -5}};
        const dvec2 low[] = {{0.6, -4}, {2.2, -3.8}, {3.2, -2.2}, {3.3, 0}, {3.2, 2.2}, {2.2, 3.8}, {0.6, 4}};
        const dvec2 generator[] = {{0.6, 5.5}, {1.9, 5.6}, {2.0, 6}, {2.0, 13}, {1.9, 13.4}, {0.6, 13.5}};
        const dvec2 shaft[] = {{0.35, -15.5}, {0.35, 15}};
        mesh.frame(mesh.frame() * move(0, 5.2, 0));
        turned(silver, high, 1.75), turned(silver, mid, 2.25), turned(green, low, 3.45), turned(blue, generator, 2.2);
        {
            const Local axis(mesh, turn_z(-90));
            mesh.material(index(galvanized));
            lathe(mesh, shaft, detail(24, 5));
        }
        mesh.material(index(concrete));
        mesh.box({-16, -5.17, -3.2}, {15.5, -3.6, 3.2}, MeshBuilder::kBottom);
        for (const double x : {-15.6, -10.0, -4.6, 4.7, 14.2})
            mesh.box({x - 0.4, -3.61, -1.5}, {x + 0.4, -0.6, 1.5}, MeshBuilder::kBottom);
        for (int i = 0; i < detail(60, 2, 6); ++i) {  // steam pipes between the casings
            const double side = i % 2 == 0 ? 1 : -1, x = -12.5 + 0.9 * i;
            const dvec3 steam[] = {
                {x, 0.9, side * 0.9}, {x, 2.6, side * 1.6}, {x + 4.5, 2.6, side * 1.6}, {x + 4.5, 0.9, side * 0.9}};
            mesh.material(index(silver));
            pipe(mesh, steam, 0.28, detail(24, 4), 0.7, detail(6, 1));
        }
    });
    for (const double z : {31.5, 44.0}) plant.place(set, move(0, 0, z));
    plant.place(plant.add("crane",
                          [=](MeshBuilder& mesh, const Detail& detail) {
                              mesh.material(index(yellow));
                              for (const double x : {-1.2, 1.2})
                                  beam(mesh, bar_section(0.5, 1.1), {x, 13.4, kZ0 + 0.4}, {x, 13.4, kZ1 - 0.4});
                              mesh.box({-1.6, 14.0, middle - 1}, {1.6, 14.7, middle + 1});
                              for (const double z : {kZ0 + 0.5, kZ1 - 0.5})
                                  beam(mesh, bar_section(0.35, 0.7), {-kX - 12, 12.4, z}, {kX - 12, 12.4, z});
                              mesh.material(index(galvanized));
                              for (const double z : {-0.3, 0.3})
                                  rod(mesh, {0, 14.1, middle + z}, {0, 9, middle + z}, 0.03, detail(8, 3, 24));
                          }),
                move(12, 0, 0));
}

}  // namespace halflight::scenes
