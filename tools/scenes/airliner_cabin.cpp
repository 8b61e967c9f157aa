// The airliner's cabin: seats, bins, linings, floor, galleys; and the hold below.
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

constexpr double kLining = kHull - 0.14;  // radius of the cabin's wall
constexpr double kSeatPitch = 0.5, kTripleZ = 2.05;

dvec3 on_lining(double x, double degrees) {
    const dvec2 t = cos_sin_degrees(degrees);
    return {x, kLining * t.x, kLining * t.y};
}

/// Adds one seat that looks towards -x, with its floor at y = 0.
void seat(MeshBuilder& mesh, AirlinerMaterial cover, int number, const Detail& detail) {
    int part = 9 * number;  // cushions differ in detail, so that totals grow evenly
    const auto large = [&] { return detail.dithered(part++, 8, 1, 90); };
    const auto small = [&] { return detail.dithered(part++, 4, 1, 50); };
    mesh.material(index(cover));
    cushion(mesh, {-0.26, 0.40, -0.225}, {0.22, 0.52, 0.225}, 0.045, large(), 0.02);
    const Local back(mesh, move(0.20, 0.46, 0) * turn_z(-13));
    cushion(mesh, {-0.03, 0, -0.215}, {0.08, 0.60, 0.215}, 0.04, large(), 0.015);
    for (const double side : {-1.0, 1.0})  // wings that support the sides
        if (detail.above(0.12))
            cushion(mesh, {-0.055, 0.08, side * 0.185 - 0.028}, {0.0, 0.50, side * 0.185 + 0.028}, 0.025, small());
    mesh.material(index(leather));
    cushion(mesh, {-0.05, 0.605, -0.17}, {0.045, 0.79, 0.17}, 0.03, large(), 0.01);
    mesh.material(index(plastic));
    cushion(mesh, {0.082, 0.04, -0.21}, {0.105, 0.77, 0.21}, 0.01, small());
    if (detail.above(0.1)) cushion(mesh, {0.107, 0.14, -0.19}, {0.125, 0.40, 0.19}, 0.007, small());  // tray table
    mesh.material(index(screen));
    if (detail.above(0.12))
        cushion(mesh, {0.1, 0.45, -0.125}, {0.114, 0.62, 0.125}, 0.004, detail.above(0.5) ? small() : 1);
    if (!detail.above(0.3)) return;
    mesh.material(index(dark_cloth));
    mesh.box({0.107, -0.02, -0.17}, {0.122, 0.11, 0.17});  // pocket
    mesh.material(index(steel));
    rod(mesh, {0.11, 0.415, -0.03}, {0.128, 0.415, -0.03}, 0.012, detail(8, 4), true);  // latch of the table
    for (const double side : {-1.0, 1.0}) {
        mesh.material(index(belt));
        mesh.box({-0.16, 0.062, side * 0.1 - 0.025}, {-0.03, 0.066, side * 0.1 + 0.025});
        mesh.material(index(steel));
        bolt(mesh, {0.105, 0.70, side * 0.15}, {1, 0, 0}, 0.006, detail(5, 4, 16));
    }
    mesh.box({-0.19, 0.061, -0.03}, {-0.15, 0.075, 0.03});
}

/// Adds three seats side by side on one frame, |z| < 0.78.
void triple(MeshBuilder& mesh, AirlinerMaterial cover, const Detail& detail) {
    for (int i = 0; i < 3; ++i) {
        const Local place(mesh, move(0, 0, kSeatPitch * (i - 1)));
        seat(mesh, cover, i, detail);
    }
    const int sides = detail(10, 3, 40), n = detail(4, 1, 50);
    for (int i = 0; i < 4; ++i) {
        const double z = kSeatPitch * (i - 1.5);
        mesh.material(index(plastic));
        cushion(mesh, {-0.18, 0.61, z - 0.022}, {0.20, 0.645, z + 0.022}, 0.012, detail.dithered(i, 4, 1, 50));
        if (detail.above(0.12))
            mesh.box({0.10, 0.40, z - 0.012}, {0.17, 0.615, z + 0.012}, MeshBuilder::kTop | MeshBuilder::kBottom);
    }
    mesh.material(index(aluminium));
    for (const double x : {-0.14, 0.12}) rod(mesh, {x, 0.37, -0.74}, {x, 0.37, 0.74}, 0.02, sides, detail.above(0.3));
    for (const double z : {-0.4, 0.4}) {
        const dvec3 front[] = {{-0.14, 0.36, z}, {-0.17, 0.04, z}};
        const dvec3 rear[] = {{0.12, 0.36, z}, {0.30, 0.04, z}};
        const dvec3 brace[] = {{-0.16, 0.09, z}, {0.12, 0.34, z}};
        tube(mesh, front, 0.016, sides), tube(mesh, rear, 0.016, sides);
        if (detail.above(0.15)) tube(mesh, brace, 0.012, sides);
        mesh.material(index(steel));
        mesh.box({-0.24, 0.006, z - 0.02}, {-0.10, 0.05, z + 0.02}, MeshBuilder::kBottom);
        mesh.box({0.23, 0.006, z - 0.02}, {0.37, 0.05, z + 0.02}, MeshBuilder::kBottom);
        if (detail.above(0.3))
            for (const double x : {-0.215, -0.125, 0.255, 0.345})
                bolt(mesh, {x, 0.05, z}, {0, 1, 0}, 0.008, detail(5, 4, 20));
        mesh.material(index(aluminium));
    }
    if (!detail.above(0.5)) return;
    mesh.material(index(plastic));
    cushion(mesh, {-0.05, 0.20, 0.08}, {0.16, 0.33, 0.36}, 0.01, n);  // box of the screens' electronics
    const dvec3 harness[] = {{0.1, 0.26, 0.1}, {0.16, 0.24, -0.1}, {0.24, 0.07, -0.36}, {0.26, 0.02, -0.39}};
    mesh.material(index(cable_black));
    pipe(mesh, harness, 0.008, sides, 0.08, detail(4, 1));
}

/// Adds the lining of a bay's walls, around the window, and the panel at its foot.
void wall(MeshBuilder& mesh, bool windows, const Detail& detail) {
    constexpr double kFrom = 62, kTo = 98.6;
    for (const double side : {-1.0, 1.0}) {
        const auto at = [&](double u, double v) {  // the front looks into the cabin
            return on_lining(0.002 + (kBay - 0.004) * (side > 0 ? v : 1 - v), side * glm::mix(kTo, kFrom, u));
        };
        const dvec2 centre((kTo - kWindowAngle) / (kTo - kFrom), 0.5), radii(0.21 / 1.886, 0.15 / kBay);
        mesh.material(index(lining));
        const int sides = 4 * detail(5, 2), steps = detail(2, 1);
        if (!windows) {
            surface(mesh, detail(8, 2), steps, at);
            continue;
        }
        pierced_surface(mesh, at, centre, radii, sides, detail(3, 1));
        surface(mesh, sides, steps, [&](double u, double v) {  // the reveal narrows towards the outer skin
            const dvec2 t = cos_sin_degrees(45 + 360 * u);
            const dvec2 round(std::copysign(std::sqrt(std::abs(t.x)), t.x),
                              std::copysign(std::sqrt(std::abs(t.y)), t.y));
            const dvec2 hole = centre + glm::mix(1.0, 0.94, v) * radii * round;
            dvec3 p = at(hole.x, hole.y);
            const double reach = glm::mix(kLining, kHull - 0.004, v) / kLining;
            return dvec3(p.x, p.y * reach, p.z * reach);
        });
    }
}

/// Adds the floor of a row with its tracks.
void floor_row(MeshBuilder& mesh, const Detail& detail) {
    constexpr double kTracks[] = {-2.45, -1.65, -0.4, 0.4, 1.65, 2.45}, kSide = 2.88, kTrack = 0.02;
    const auto cover = [&](AirlinerMaterial material, double z0, double z1, double y) {
        mesh.material(index(material)).quad({0, y, z1}, {kRow, y, z1}, {kRow, y, z0}, {0, y, z0});
    };
    cover(floor, -kSide, kTracks[0] - kTrack, kFloor), cover(floor, kTracks[5] + kTrack, kSide, kFloor);
    for (int i = 0; i < 5; ++i)
        cover(i % 2 == 0 ? floor : carpet, kTracks[i] + kTrack, kTracks[i + 1] - kTrack, kFloor);
    for (const double z : kTracks) {
        mesh.material(index(aluminium));
        if (!detail.above(0.8)) {
            cover(aluminium, z - kTrack, z + kTrack, kFloor);
            continue;
        }
        constexpr int kHoles = 32;  // one inch apart
        for (int i = 0; i < kHoles; ++i) {
            const Local hole(mesh, move(kRow * (i + 0.5) / kHoles, kFloor, z) * turn_x(-90));
            pierced_plate(mesh, {kRow / kHoles / 2, kTrack}, 0.009, 4 * detail(1.5, 1, 8), 0.004);
        }
        beam(mesh, channel_section(0.02, 0.038, 0.003), {0, kFloor - 0.022, z}, {kRow, kFloor - 0.022, z}, {0, 0, 1});
    }
    mesh.material(index(aluminium));
    if (detail.above(0.4))
        for (int i = 0; i < 12; ++i)
            for (const double z : {-2.52, -1.58, -0.47, 0.47, 1.58, 2.52})
                bolt(mesh, {kRow * (i + 0.5) / 12, kFloor, z}, {0, 1, 0}, 0.005, detail(4, 4, 12));
}

/// Adds overhead bins with their service panels over both sides and the middle, one row long.
void bins(MeshBuilder& mesh, const Detail& detail) {
    constexpr double kGap = 0.004;
    const int across = detail(4, 1), along = detail(3, 1);
    // Points are (z, y) on the right-hand side; `inner` lines have the bin on their left, seen from the tail.
    const auto shell = [&](AirlinerMaterial material, std::span<const dvec2> points, double side, double gap,
                           bool inner = false) {
        const std::vector<dvec2> line = curve(points, across);
        mesh.material(index(material));
        surface(mesh, along, static_cast<int>(line.size()) - 1, [&](double u, double v) {
            const double k = v * static_cast<double>(line.size() - 1);
            const auto i = std::min(static_cast<std::size_t>(k), line.size() - 2);
            const dvec2 p = glm::mix(line[i], line[i + 1], k - static_cast<double>(i));
            const double x = glm::mix(gap, kRow - gap, (side > 0) == inner ? u : 1 - u);
            return dvec3(x, p.y, side * p.x);
        });
    };
    for (const double side : {-1.0, 1.0}) {
        const dvec2 bottom[] = {{2.62, 1.33}, {2.45, 1.21}, {2.15, 1.19}, {1.90, 1.22}};
        const dvec2 lid[] = {{1.895, 1.225}, {1.68, 1.36}, {1.56, 1.60}, {1.57, 1.86}};
        const dvec2 crown[] = {{1.575, 1.865}, {1.64, 1.97}, {1.85, 2.08}};
        shell(lining, bottom, side, 0), shell(lining, lid, side, kGap), shell(lining, crown, side, 0);
        const dvec2 middle_bottom[] = {{0.0, 1.43}, {0.30, 1.42}, {0.55, 1.37}, {0.66, 1.38}};
        const dvec2 middle_lid[] = {{0.665, 1.385}, {0.82, 1.48}, {0.88, 1.66}, {0.84, 1.88}};
        const dvec2 middle_crown[] = {{0.835, 1.885}, {0.76, 1.99}, {0.55, 2.09}};
        shell(lining, middle_bottom, side, 0, true), shell(lining, middle_lid, side, kGap, true);
        shell(lining, middle_crown, side, 0, true);
        mesh.material(index(strip));  // cove lights on the bins, which shine at the ceiling
        mesh.box({0.03, 1.99, side * 1.60 - 0.02}, {kRow - 0.03, 2.015, side * 1.60 + 0.02});
        mesh.box({0.03, 2.01, side * 0.80 - 0.02}, {kRow - 0.03, 2.035, side * 0.80 + 0.02});
        mesh.material(index(plastic));
        if (detail.above(0.15)) {
            cushion(mesh, {0.32, 1.30, side * 1.73 - 0.02}, {0.49, 1.335, side * 1.73 + 0.02}, 0.008, detail(3, 1));
            cushion(mesh, {0.10, 1.165, side * 2.12 - 0.10}, {0.52, 1.185, side * 2.12 + 0.10}, 0.008, detail(3, 1));
        }
        if (!detail.above(0.4)) continue;
        for (int i = 0; i < 3; ++i) {  // air nozzles and reading lamps
            const double z = side * 2.12 + 0.07 * (i - 1);
            const Local nozzle(mesh, move(0.18, 1.166, z) * turn_x(180));
            const dvec2 profile[] = {{0.022, 0}, {0.020, 0.008}, {0.012, 0.012}, {0.010, 0.004}, {0.0, 0.004}};
            lathe(mesh, profile, detail(12, 6));
            const Local lamp(mesh, move(0.2, 0, 0));
            lathe(mesh, profile, detail(12, 6));
        }
    }
}

void ceiling(MeshBuilder& mesh, const Detail& detail) {
    mesh.material(index(lining));
    for (const double side : {-1.0, 1.0})
        surface(mesh, detail(6, 1), 1, [&](double u, double v) {
            const double z = glm::mix(0.78, 1.68, u), rise = 0.03 * 4 * u * (1 - u);
            return dvec3(glm::mix(0.003, kRow - 0.003, side > 0 ? v : 1 - v), 2.06 + rise, side * z);
        });
}

/// Adds a galley or lavatory over three bays: cabinets with doors, handles and trolleys.
void monument(MeshBuilder& mesh, double z0, double z1, double top, const Detail& detail) {
    constexpr double kDeep = 0.9;
    mesh.material(index(lining));
    bevelled_box(mesh, {0.1, kFloor + 0.004, z0}, {0.1 + kDeep, top, z1}, 0.015);
    const int columns = 4, rows = 5;
    const double x = 0.1 + kDeep, low = kFloor + 0.1;
    for (int i = 0; i < columns; ++i)
        for (int j = 0; j < rows; ++j) {
            const double a = glm::mix(z0, z1, (i + 0.06) / columns), b = glm::mix(z0, z1, (i + 0.94) / columns);
            const double c = glm::mix(low, top - 0.03, (j + 0.04) / rows),
                         d = glm::mix(low, top - 0.03, (j + 0.96) / rows);
            mesh.material(index(j < 2 ? aluminium : plastic));
            cushion(mesh, {x - 0.01, c, a}, {x + 0.02, d, b}, 0.008, detail(4, 1, 20));
            if (!detail.above(0.12)) continue;
            mesh.material(index(steel));
            const double middle = 0.5 * (c + d);
            const dvec3 handle[] = {{x + 0.015, middle, a + 0.03},
                                    {x + 0.05, middle, a + 0.035},
                                    {x + 0.05, middle, a + 0.115},
                                    {x + 0.015, middle, a + 0.12}};
            pipe(mesh, handle, 0.006, detail(8, 3, 30), 0.015, detail(2, 1, 8));
        }
}

/// Adds a cargo container over three bays, and the roller trays below it.
void cargo(MeshBuilder& mesh, bool loaded, const Detail& detail) {
    constexpr double kDeck = -2.15, kLong = 3 * kBay;
    mesh.material(index(floor))
        .quad({0, kDeck - 0.05, 1.95}, {kLong, kDeck - 0.05, 1.95}, {kLong, kDeck - 0.05, -1.95},
              {0, kDeck - 0.05, -1.95});
    for (const double z : {-1.25, -0.45, 0.45, 1.25}) {
        mesh.material(index(aluminium));
        beam(mesh, channel_section(0.06, 0.16, 0.004), {0, kDeck - 0.02, z}, {kLong, kDeck - 0.02, z}, {0, 0, 1});
        mesh.material(index(steel));
        for (int i = 0, rollers = detail(6, 1, 12); i < rollers; ++i) {
            const double x = kLong * (i + 0.5) / rollers;
            rod(mesh, {x, kDeck - 0.018, z - 0.07}, {x, kDeck - 0.018, z + 0.07}, 0.018, detail(10, 3, 40), true);
        }
    }
    if (!loaded) return;
    for (const double side : {-1.0, 1.0}) {
        // The outline of a container: its outer side leans with the hull. Posts stiffen it.
        const std::vector<dvec2> outline{
            {0.06, kDeck + 0.015}, {1.52, kDeck + 0.015}, {1.98, -1.68}, {1.98, -0.86}, {0.06, -0.86}};
        const double front = 0.06, rear = kLong - 0.06;
        const dmat4 turn({0, 0, side, 0}, {0, 1, 0, 0}, {-side, 0, 0, 0}, {0, 0, 0, 1});
        const dmat4 frames[] = {move(side > 0 ? rear : front, 0, 0) * turn, move(side > 0 ? front : rear, 0, 0) * turn};
        mesh.material(index(aluminium));
        sweep(mesh, outline, frames);
        for (const double x : {0.06, kLong - 0.06}) {  // end walls
            const std::size_t n = outline.size();
            const bool out = x > 0.5;
            std::uint32_t first = 0;
            for (std::size_t k = 0; k < n; ++k) {
                const std::uint32_t at = mesh.vertex({{x, outline[k].y, side * outline[k].x}, {out ? 1 : -1, 0, 0}});
                if (k == 0) first = at;
            }
            for (std::uint32_t k = 2; k < n; ++k)
                (side > 0) == out ? mesh.triangle(first, first + k, first + k - 1)
                                  : mesh.triangle(first, first + k - 1, first + k);
        }
        for (int i = 0, waves = detail(6, 0, 14); i < waves; ++i)
            for (const double z : {0.0585, 1.9815}) {
                const double x = 0.06 + (kLong - 0.12) * (i + 0.5) / waves;
                beam(mesh, bar_section(0.02, 0.05), {x, -1.64, side * z}, {x, -0.9, side * z}, {1, 0, 0});
            }
        if (detail.above(0.5))
            for (int i = 0, heads = detail(20, 4, 40); i < heads; ++i) {
                const double x = 0.09 + (kLong - 0.18) * i / (heads - 1);
                for (const double y : {-1.66, -0.88})
                    rivet(mesh, {x, y, side * 1.98}, {0, 0, side}, 0.006, detail(5, 4, 12));
            }
    }
}

}  // namespace

void add_cabin(Assembly& airliner, const Detail& detail) {
    const auto add = [&](const std::string& name, auto build) { return airliner.add(name, maker(name, build)); };
    const std::uint32_t seats[] = {add("seats", [=](MeshBuilder& mesh) { triple(mesh, cloth, detail); }),
                                   add("violet seats", [=](MeshBuilder& mesh) { triple(mesh, dark_cloth, detail); })};
    const std::uint32_t walls[] = {add("door wall", [=](MeshBuilder& mesh) { wall(mesh, false, detail); }),
                                   add("wall", [=](MeshBuilder& mesh) { wall(mesh, true, detail); })};
    const std::uint32_t ground = add("floor", [=](MeshBuilder& mesh) { floor_row(mesh, detail); });
    const std::uint32_t bin = add("bins", [=](MeshBuilder& mesh) { bins(mesh, detail); });
    const std::uint32_t panels = add("ceiling", [=](MeshBuilder& mesh) { ceiling(mesh, detail); });
    const std::uint32_t side_galley =
        add("side galley", [=](MeshBuilder& mesh) { monument(mesh, 1.35, 2.55, 1.1, detail); });
    const std::uint32_t galley = add("galley", [=](MeshBuilder& mesh) { monument(mesh, -0.75, 0.75, 1.34, detail); });
    const std::uint32_t holds[] = {add("empty hold", [=](MeshBuilder& mesh) { cargo(mesh, false, detail); }),
                                   add("hold", [=](MeshBuilder& mesh) { cargo(mesh, true, detail); })};
    for (int row = 0; row < kRows; ++row) {
        const double x = kNose + kRow * row;
        const dmat4 at = move(x, kAxisHeight, 0);
        airliner.place(ground, at), airliner.place(bin, at);
        // Some ceiling panels are down for maintenance, so that ducts and cables can be seen.
        if (row % 9 != 7 && row % 9 != 8) airliner.place(panels, at);
        const bool by_door = has_door(row * 3 / 2) || has_door((row * 3 + 2) / 2);
        if (by_door) {
            if (row % 2 == 0) airliner.place(galley, at);
            continue;
        }
        const std::uint32_t cover = seats[row < 8 ? 1 : 0];
        for (const double z : {-kTripleZ, 0.0, kTripleZ})
            airliner.place(cover, move(x + 0.40, kAxisHeight + kFloor, z));
        if (row % 15 == 0) airliner.place(side_galley, move(x, kAxisHeight, 0));
    }
    for (int bay = 0; bay < kBodyBays; ++bay)
        airliner.place(walls[has_door(bay) ? 0 : 1], move(kNose + kBay * bay, kAxisHeight, 0));
    for (int i = 0; i < kBodyBays / 3; ++i) {
        const bool wing_box = i >= 8 && i < 15;
        if (!wing_box) airliner.place(holds[i % 4 == 3 ? 0 : 1], move(kNose + 3 * kBay * i, kAxisHeight, 0));
    }
}

}  // namespace halflight::scenes
