// The boiler house of a power plant: steel frame, floors and stairs, and the boiler within.
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

constexpr double kTop = kLevels * kLevel;
constexpr double kWall = 6.2, kRoof = 41, kHopper = 10;  // the furnace: half its side, its top, where its hopper begins

/// Returns the I of a column or girder, or a bar in its place if detail is low.
std::vector<dvec2> girder(const Detail& detail, double width, double height, double plate) {
    return detail.above(0.12) ? i_section(width, height, plate) : bar_section(width, height);
}

void column(MeshBuilder& mesh, const Detail& detail) {
    mesh.material(index(dark_steel));
    beam(mesh, girder(detail, 0.5, 0.5, 0.03), {0, 0.04, 0}, {0, kTop + 0.3, 0}, {0, 0, 1}, detail(3, 1, 12));
    mesh.material(index(concrete)).box({-0.6, 0, -0.6}, {0.6, 0.045, 0.6}, MeshBuilder::kBottom);
    for (int level = 0; level < kLevels; ++level) {  // splices with plates and bolts
        if (!detail.has(level, 0.2, 0.5)) continue;
        for (const double side : {-1.0, 1.0}) {
            const double y = kLevel * level + 1.3;
            mesh.material(index(dark_steel));
            mesh.box({-0.23, y - 0.35, side * 0.263 - 0.014}, {0.23, y + 0.35, side * 0.263 + 0.014});
            mesh.material(index(bolts));
            const int rows = detail(3, 1, 8);
            for (int i = 0; i < rows; ++i)
                for (const double x : {-0.17, -0.09, 0.09, 0.17})
                    bolt(mesh, {x, y + 0.6 * ((i + 0.5) / rows - 0.5), side * 0.277}, {0, 0, side}, 0.018,
                         detail(6, 4, 24));
        }
    }
}

/// Adds girders along x over `cells` cells, with the joints at the columns.
void girder_line(MeshBuilder& mesh, int cells, const Detail& detail) {
    mesh.material(index(dark_steel));
    beam(mesh, girder(detail, 0.3, 0.6, 0.022), {0.02, 0, 0}, {cells * kCell - 0.02, 0, 0}, {0, 1, 0},
         detail(cells, 1, 4 * cells));
    for (int i = 0; i < cells; ++i) {
        if (!detail.has(i, 0.2, 0.5)) continue;
        for (const double side : {-1.0, 1.0}) {
            const double x = kCell * (i + 0.5) + side * (kCell / 2 - 0.42);
            mesh.material(index(dark_steel)).box({x - 0.14, -0.22, -0.03}, {x + 0.14, 0.22, 0.03});
            mesh.material(index(bolts));
            const int rows = detail(3, 1, 6);
            for (int k = 0; k < rows; ++k)
                for (const double z : {-1.0, 1.0})
                    for (const double dx : {-0.08, 0.08})
                        bolt(mesh, {x + dx, 0.4 * ((k + 0.5) / rows - 0.5), 0.03 * z}, {0, 0, z}, 0.018,
                             detail(6, 4, 24));
        }
    }
}

void floor_cell(MeshBuilder& mesh, bool fine, const Detail& detail) {
    const dvec2 half(kCell / 2 - 0.06, kCell / 2 - 0.06);
    mesh.material(index(galvanized));
    if (fine)
        grating(mesh, half, detail(70, 8, 240), detail(18, 2, 75));
    else
        mesh.box({-half.x, -0.03, -half.y}, {half.x, 0, half.y});
    mesh.material(index(dark_steel));
    if (fine)
        for (const double x : {-2.2, 0.0, 2.2})
            beam(mesh, girder(detail, 0.14, 0.2, 0.01), {x, -0.135, -half.y}, {x, -0.135, half.y});
}

void railing(MeshBuilder& mesh, const Detail& detail) {
    const dvec3 path[] = {{0.06 - kCell / 2, 0, 0}, {kCell / 2 - 0.06, 0, 0}};
    mesh.material(index(yellow));
    handrail(mesh, path, detail.above(0.3) ? 1.25 : 2.5, detail(6, 3, 24));
}

/// Adds a flight of stairs up kLevel along +x, 1 m wide.
void stairs(MeshBuilder& mesh, const Detail& detail) {
    constexpr double kRun = 7, kWide = 0.5;
    const int treads = detail(30, 6, 30);
    mesh.material(index(dark_steel));
    for (const double z : {-kWide, kWide}) beam(mesh, channel_section(0.08, 0.26, 0.01), {0, 0, z}, {kRun, kLevel, z});
    for (int i = 0; i < treads; ++i) {
        const Local tread(mesh, move(kRun * (i + 0.5) / treads, kLevel * (i + 0.5) / treads, 0) * turn_y(90));
        mesh.material(index(galvanized));
        if (detail.above(0.4))
            grating(mesh, {kWide - 0.05, 0.13}, detail(12, 3, 34), detail(3, 1, 8));
        else
            mesh.box({-kWide + 0.05, -0.03, -0.13}, {kWide - 0.05, 0, 0.13});
    }
    mesh.material(index(yellow));
    if (!detail.above(0.1)) return;
    for (const double z : {-kWide, kWide}) {
        const dvec3 path[] = {{0, 0.1, z}, {kRun, kLevel + 0.1, z}};
        handrail(mesh, path, detail.above(0.3) ? 1.3 : 4, detail(6, 3, 24));
    }
}

/// Adds corrugated sheets over one cell of a facade, with their outside towards +z.
void sheets(MeshBuilder& mesh, const Detail& detail) {
    const int waves = detail(16, 2, 48);
    mesh.material(index(cladding));
    for (int i = 0; i < waves; ++i) {
        const auto x = [&](double k) { return kCell * ((i + k) / waves - 0.5); };
        const double y0 = 0.05, y1 = kLevel - 0.05, deep = 0.05;
        const double at[] = {0, 0.35, 0.5, 0.85, 1}, z[] = {0, 0, deep, deep, 0};
        for (int k = 0; k < 4; ++k)
            mesh.quad({x(at[k]), y0, z[k]}, {x(at[k + 1]), y0, z[k + 1]}, {x(at[k + 1]), y1, z[k + 1]},
                      {x(at[k]), y1, z[k]});
    }
}

/// Adds a wall of the furnace at z = kWall: tubes side by side, fins between them, buckstays outside.
void furnace_wall(MeshBuilder& mesh, bool hopper, const Detail& detail) {
    const int tubes = detail(44, 5, 140), sides = detail(8, 3, 24);
    const double pitch = 2 * kWall / tubes, radius = 0.36 * pitch;
    mesh.material(index(tube));
    for (int i = 0; i < tubes; ++i) {
        const double x = -kWall + pitch * (i + 0.5);
        std::vector<dvec3> path{{x, kRoof + 0.3, kWall}, {x, hopper ? kHopper : 4, kWall}};
        if (hopper) path.emplace_back(x, 4, 1.0);
        pipe(mesh, path, radius, sides, 1.0, detail(4, 1), detail.above(2) ? 4 : 0);
    }
    mesh.quad({-kWall, kHopper, kWall}, {kWall, kHopper, kWall}, {kWall, kRoof, kWall}, {-kWall, kRoof, kWall});
    for (const double y : {kRoof + 0.35, 3.95}) {  // headers
        const double z = y < kHopper && hopper ? 0.97 : kWall;
        rod(mesh, {-kWall - 0.4, y, z}, {kWall + 0.4, y, z}, 0.22, detail(16, 4), true);
    }
    mesh.material(index(primer));
    for (int i = 0, stays = detail(12, 4, 12); i < stays; ++i) {
        const double y = glm::mix(kHopper + 1.0, kRoof - 1.0, double(i) / (stays - 1)), z = kWall + radius + 0.3;
        beam(mesh, girder(detail, 0.25, 0.5, 0.02), {-kWall - 0.5, y, z}, {kWall + 0.5, y, z}, {0, 0, 1});
        if (detail.above(0.4))
            for (int k = 0; k < 9; ++k) {
                const double x = kWall * (k - 4) / 4.2;
                mesh.box({x - 0.05, y - 0.2, z - 0.35}, {x + 0.05, y + 0.2, z - 0.24}, MeshBuilder::kBack);
            }
    }
}

/// Adds the burner of one place in the front wall, with its throat at the origin and its pipes towards +z.
void burner(MeshBuilder& mesh, const Detail& detail) {
    const int sides = detail(24, 6);
    {
        const Local axis(mesh, turn_x(90));
        const dvec2 body[] = {{0.62, 0}, {0.62, 0.9}, {0.45, 1.2}, {0.28, 1.3}, {0.28, 2.2}, {0.0, 2.2}};
        mesh.material(index(silver));
        lathe(mesh, body, sides);
        mesh.material(index(bolts));
        const Local joint(mesh, move(0, 0.5, 0));
        if (detail.above(0.2)) flange(mesh, 0.62, sides, detail(12, 4, 24));
    }
    if (!detail.above(0.1)) return;
    const dvec3 fuel[] = {{0, 0, 1.9}, {0, 0.6, 2.1}, {0, 2.6, 2.1}};
    const dvec3 gas[] = {{0.2, 0, 1.7}, {0.6, 0, 1.7}, {0.6, -1.6, 1.7}};
    mesh.material(index(yellow));
    pipe(mesh, gas, 0.05, detail(10, 3), 0.2, detail(4, 1));
    mesh.material(index(dark_steel));
    pipe(mesh, fuel, 0.16, detail(16, 4), 0.4, detail(5, 1));
}

/// Adds a platen of the superheater: nested U tubes that hang from y = 0.
void platen(MeshBuilder& mesh, const Detail& detail) {
    const int loops = detail(8, 1, 18), sides = detail(8, 3, 20);
    mesh.material(index(tube));
    for (int i = 0; i < loops; ++i) {
        const double z = 1.3 * (i + 1) / loops, low = -9 + 1.3 * (1 - (i + 1.0) / loops);
        const dvec3 path[] = {{0, 0, -z}, {0, low, -z}, {0, low, z}, {0, 0, z}};
        pipe(mesh, path, std::min(0.03, 0.4 / loops), sides, 0.3 * z, detail(5, 1), detail.above(2) ? 2 : 0);
    }
}

/// Adds a coil of the economizer: a tube to and fro along x.
void coil(MeshBuilder& mesh, const Detail& detail) {
    const int passes = detail(12, 2, 24);
    std::vector<dvec3> path;
    for (int i = 0; i < passes; ++i) {
        const double y = -2.4 * i / passes, end = i % 2 == 0 ? 4.5 : -4.5;
        path.emplace_back(-end, y, 0), path.emplace_back(end, y, 0);
    }
    mesh.material(index(tube));
    pipe(mesh, path, 0.03, detail(8, 3, 20), 0.1, detail(4, 1));
}

void drum(MeshBuilder& mesh, const Detail& detail) {
    const int sides = detail(48, 8);
    {
        const Local axis(mesh, turn_z(90));
        const dvec2 shell[] = {{0.0, -7.6}, {0.5, -7.5}, {0.9, -7.1}, {1.0, -6.6},
                               {1.0, 6.6},  {0.9, 7.1},  {0.5, 7.5},  {0.0, 7.6}};
        mesh.material(index(silver));
        lathe(mesh, shell, sides);
        for (const double x : {-5.5, -2.0, 2.0, 5.5}) {
            if (!detail.above(0.1)) break;
            const dvec2 strap[] = {{0.999, x - 0.1}, {1.02, x - 0.1}, {1.02, x + 0.1}, {0.999, x + 0.1}};
            mesh.material(index(dark_steel));
            lathe(mesh, strap, sides);
        }
    }
    for (int i = 0, risers = detail(14, 4, 40); i < risers; ++i) {
        const double x = 6.2 * (2.0 * i / (risers - 1) - 1);
        for (const double side : {-1.0, 1.0}) {
            const dvec3 path[] = {
                {x, 0.3, side * 0.9}, {x, 0.5, side * 2.2}, {x, -1.2, side * kWall}, {x, -3.5, side * kWall}};
            mesh.material(index(tube));
            pipe(mesh, path, 0.09, detail(10, 3, 32), 0.6, detail(4, 1));
        }
    }
    for (const double x : {-7.2, 7.2})
        for (const double z : {-1.2, 1.2}) {  // downcomers beside the furnace
            const dvec3 path[] = {{x * 0.85, -0.8, 0.3 * z}, {x * 0.85, -1.8, z}, {x, -2.6, z}, {x, -39, z}};
            mesh.material(index(silver));
            pipe(mesh, path, 0.3, detail(24, 4), 0.8, detail(5, 1), detail.above(1) ? 3 : 0);
        }
}

}  // namespace

void add_boiler_house(Plant& plant) {
    const std::uint32_t columns = plant.add("column", column);
    const auto line = [](int cells) {
        return [cells](MeshBuilder& mesh, const Detail& detail) { girder_line(mesh, cells, detail); };
    };
    const std::uint32_t whole = plant.add("girders", line(4)), part = plant.add("girder", line(1));
    const auto cell = [](bool fine) {
        return [fine](MeshBuilder& mesh, const Detail& detail) { floor_cell(mesh, fine, detail); };
    };
    const std::uint32_t cells[] = {plant.add("plate", cell(false)), plant.add("grating", cell(true))};
    const std::uint32_t rail = plant.add("railing", railing);
    const std::uint32_t flight = plant.add("stairs", stairs), facade = plant.add("sheets", sheets);
    for (int i = -2; i <= 2; ++i)
        for (int j = -2; j <= 2; ++j)
            if (i != 0 || j != 0) plant.place(columns, move(kCell * i, 0, kCell * j));
    const std::uint32_t brace = plant.add("brace", [](MeshBuilder& mesh, const Detail& detail) {
        mesh.material(index(dark_steel));
        beam(mesh, girder(detail, 0.2, 0.2, 0.014), {-kCell / 2, 0.3, 0}, {kCell / 2, kLevel - 0.3, 0});
    });
    for (int level = 1; level <= kLevels; ++level) {
        const double y = kLevel * level, floor = y + 0.34;
        for (int turns = 0; turns < 2; ++turns)  // lines along z lie a little lower
            for (int row = -2; row <= 2; ++row) {
                const dmat4 turn = turn_y(90.0 * turns) * move(0, turns * -0.03, kCell * row);
                if (row != 0) plant.place(whole, move(0, y, 0) * turn * move(-kHouse, 0, 0));
                if (row == 0)
                    for (const double x : {-kHouse, kCell}) plant.place(part, move(0, y, 0) * turn * move(x, 0, 0));
            }
        for (int i = 0; i < 4; ++i)
            for (int j = 0; j < 4; ++j) {
                const bool furnace = i % 3 != 0 && j % 3 != 0;
                const bool duct = j == 0 && i % 3 != 0 && level > 2;  // the rear pass needs the room
                if (!furnace && !duct)
                    plant.place(cells[plant.detail.has(16 * level + 4 * i + j, 0.07, 0.2) ? 1 : 0],
                                move(kCell * (i - 1.5), floor, kCell * (j - 1.5)));
            }
        for (int side = 0; side < 4; ++side)
            for (int i = 0; i < 4; ++i)
                if ((side != 0 || i > 0) &&
                    plant.detail.has(16 * level + 4 * side + i, 0.08, 0.25))  // the stairs arrive in front
                    plant.place(rail, turn_y(90.0 * side) * move(kCell * (i - 1.5), floor, kHouse - 0.05));
        if (level < kLevels)
            for (int side = 0; side < 4; ++side) {
                const dmat4 outside = turn_y(90.0 * side) * move(0, y, kHouse + 0.3);
                plant.place(brace, outside * move((side + level) % 2 == 0 ? -1.5 * kCell : 1.5 * kCell, 0, -0.3));
                if (side == 0 || level < 5) continue;
                for (int i = 0; i < 4; ++i) plant.place(facade, outside * move(kCell * (i - 1.5), 0, 0));
            }
    }
    for (int level = 0; level < kLevels; ++level) {
        const bool even = level % 2 == 0;
        plant.place(flight, move(even ? -kHouse : -kHouse + 7, kLevel * level + 0.34, kHouse + (even ? 0.8 : 2.1)) *
                                turn_y(even ? 0 : 180));
    }
}

void add_boiler(Plant& plant) {
    const std::uint32_t front =
        plant.add("front wall", [](MeshBuilder& mesh, const Detail& detail) { furnace_wall(mesh, true, detail); });
    const std::uint32_t side =
        plant.add("side wall", [](MeshBuilder& mesh, const Detail& detail) { furnace_wall(mesh, false, detail); });
    plant.place(front), plant.place(front, turn_y(180));
    plant.place(side, turn_y(90) * move(0, -0.55, 0.03)), plant.place(side, turn_y(-90) * move(0, -0.55, 0.03));
    const std::uint32_t platens = plant.add("platen", platen), coils = plant.add("coil", coil);
    const int banks = plant.detail(10, 2, 20);
    for (int i = 0; i < banks; ++i)
        for (const double z : {-3.0, 0.0, 3.0}) plant.place(platens, move(5.6 * (2.0 * i / (banks - 1) - 1), 40, z));
    const int rows = plant.detail(10, 2, 24);
    for (int i = 0; i < rows; ++i)
        for (const double y : {38.0, 34.5, 31.0}) plant.place(coils, move(0, y, -12.2 + 4.0 * i / rows));
    const std::uint32_t top = plant.add("drum", drum), one_burner = plant.add("burner", burner);
    plant.place(top, move(0, 44.5, 0));
    for (int i = 0; i < 4; ++i)
        for (int j = 0; j < 3; ++j)
            plant.place(one_burner, move(-4.2 + 2.8 * i, 14.5 + 4.5 * j, kWall + 0.05) * turn_z(0));
    plant.place(plant.add("rear pass", [](MeshBuilder& mesh, const Detail& detail) {
        mesh.material(index(cladding));
        const dvec3 pass[] = {{0, 40.2, -7.0}, {0, 40.2, -10.2}, {0, 20, -10.2}, {0, 20, -24}};
        rect_duct(mesh, pass, {1, 0, 0}, 4.8, 10.4, detail.above(0.16) ? 1.5 : 0);
    }));
    plant.place(plant.add("air ducts", [](MeshBuilder& mesh, const Detail& detail) {
        mesh.material(index(silver));
        for (const double x : {-8.4, 8.4}) {
            const dvec3 air[] = {{x, 1.8, -22}, {x, 1.8, 9.6}, {x * 0.45, 1.8, 9.6}};
            rect_duct(mesh, air, {0, 1, 0}, 1.6, 2.0, detail.above(0.18) ? 1.2 : 0);
        }
    }));
}

}  // namespace halflight::scenes
