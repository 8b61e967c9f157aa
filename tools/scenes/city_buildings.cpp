#include "tools/scenes/city_buildings.h"

#include <algorithm>

#include "tools/scenes/exact.h"
#include "tools/scenes/shapes.h"

namespace halflight::scenes {
namespace {

using enum CityMaterial;

constexpr double kGround = 0.14;  // height of the pavement, metres
constexpr unsigned kOnWall = MeshBuilder::kBack;

int index(CityMaterial material) {
    return static_cast<int>(material);
}

/// Shape of a facade's windows.
struct Windows {
    CityMaterial wall;
    double wide, high, sill;  // share of the cell's width; metres; metres above the floor
    double recess;            // depth of the windows behind the wall, metres
    bool balconies;
};

/// Adds a wall |x| <= width / 2 at z = 0, facing +z in `frame`: one storey from y0 to y1 with `bays` windows.
void storey(MeshBuilder& mesh, const dmat4& frame, double width, double y0, double y1, int bays, const Windows& w,
            Random& random) {
    const double cell = width / bays, half = cell * w.wide / 2;
    const double low = y0 + w.sill, high = std::min(low + w.high, y1 - 0.25);
    for (int i = 0; i < bays; ++i) {
        mesh.frame(frame * move(cell * (i + 0.5) - width / 2, 0, 0));
        mesh.material(index(w.wall));
        pierced_wall(mesh, cell / 2, y0, y1, {-half, low}, {half, high}, w.recess);
        mesh.material(index(random() < 0.2 ? curtain : glass));
        mesh.quad({-half, low, -w.recess}, {half, low, -w.recess}, {half, high, -w.recess}, {-half, high, -w.recess});
        mesh.material(index(trim));
        mesh.box({-0.03, low, -w.recess}, {0.03, high, -w.recess + 0.05},
                 kOnWall | MeshBuilder::kTop | MeshBuilder::kBottom);
        if (w.balconies && i % 2 == 1) {
            mesh.box({-half - 0.35, y0 - 0.06, 0}, {half + 0.35, y0 + 0.08, 1.0}, kOnWall);
            mesh.material(index(steel));
            const double rail = y0 + 1.0;
            mesh.box({-half - 0.33, rail, 0.93}, {half + 0.33, rail + 0.05, 0.98});
            for (const double x : {-half - 0.33, half + 0.28})
                mesh.box({x, rail, 0}, {x + 0.05, rail + 0.05, 0.93}, kOnWall | MeshBuilder::kFront);
            for (int bar = 0; bar <= 8; ++bar) {
                const double x = -half - 0.31 + (2 * half + 0.60) * bar / 8;
                mesh.box({x, y0 + 0.08, 0.945}, {x + 0.02, rail, 0.965}, MeshBuilder::kTop | MeshBuilder::kBottom);
            }
        } else {
            mesh.box({-half - 0.1, low - 0.1, 0}, {half + 0.1, low, 0.12}, kOnWall);
        }
    }
    mesh.frame(dmat4(1));
}

/// Adds shop windows and a door, then a band above them.
void shop_floor(MeshBuilder& mesh, const dmat4& frame, double width, double top, int bays, CityMaterial wall) {
    const double cell = width / bays, half = cell * 0.41;
    for (int i = 0; i < bays; ++i) {
        const bool entrance = i == bays / 2;
        mesh.frame(frame * move(cell * (i + 0.5) - width / 2, 0, 0)).material(index(wall));
        const double low = entrance ? 0.0 : 0.55, wide = entrance ? 0.75 : half, high = top - 0.7;
        pierced_wall(mesh, cell / 2, 0, top, {-wide, low}, {wide, high}, 0.3);
        mesh.material(index(entrance ? door : glass));
        mesh.quad({-wide, low, -0.3}, {wide, low, -0.3}, {wide, high, -0.3}, {-wide, high, -0.3});
        if (entrance) mesh.material(index(trim)).box({-1.1, high + 0.1, 0}, {1.1, high + 0.25, 0.9}, kOnWall);
    }
    mesh.frame(frame)
        .material(index(trim))
        .box({-width / 2, top - 0.18, 0}, {width / 2, top, 0.16}, kOnWall | MeshBuilder::kLeft | MeshBuilder::kRight);
    mesh.frame(dmat4(1));
}

void flat_roof(MeshBuilder& mesh, double width, double depth, double y, CityMaterial wall, Random& random) {
    const double x = width / 2, z = depth / 2;
    mesh.material(index(gravel)).quad({-x, y, z}, {x, y, z}, {x, y, -z}, {-x, y, -z});
    mesh.material(index(wall));
    mesh.box({-x, y, z - 0.25}, {x, y + 0.9, z}, MeshBuilder::kBottom),
        mesh.box({-x, y, -z}, {x, y + 0.9, -z + 0.25}, MeshBuilder::kBottom);
    mesh.box({-x, y, -z + 0.25}, {-x + 0.25, y + 0.9, z - 0.25},
             MeshBuilder::kBottom | MeshBuilder::kBack | MeshBuilder::kFront);
    mesh.box({x - 0.25, y, -z + 0.25}, {x, y + 0.9, z - 0.25},
             MeshBuilder::kBottom | MeshBuilder::kBack | MeshBuilder::kFront);
    mesh.material(index(concrete));
    const double hut = random.in(-0.5, 0.3) * x;
    mesh.box({hut, y, -2}, {hut + 3.5, y + 2.6, 1.5}, MeshBuilder::kBottom);
    mesh.material(index(steel));
    for (int i = 0; i < 4; ++i) {  // machinery, in a row that keeps clear of the hut
        const double at = -x + 1 + i * (2 * x - 2) / 4, high = random.in(0.6, 1.4);
        mesh.box({at, y, z - 3.2}, {at + random.in(0.9, 1.6), y + high, z - random.in(1.2, 2.0)}, MeshBuilder::kBottom);
    }
}

/// Adds a roof with its ridge along x, `eave` beyond the gables of width x depth; dormers face the front.
void pitched_roof(MeshBuilder& mesh, double width, double depth, double y, double rise, double eave,
                  const BuildingSpec& spec, int dormers) {
    const double x = width / 2, end = x + eave, z = depth / 2 + 0.35, low = y - 0.35 * rise / (depth / 2),
                 top = y + rise;
    mesh.material(index(spec.seed % 2 == 0 ? tiles : slate));
    mesh.quad({-end, low, z}, {end, low, z}, {end, top, 0}, {-end, top, 0});
    mesh.quad({end, low, -z}, {-end, low, -z}, {-end, top, 0}, {end, top, 0});
    mesh.material(index(spec.wall));
    for (const double side : {1.0, -1.0}) {  // gables
        const std::uint32_t first = mesh.vertex({{side * x, y, side * depth / 2}, {side, 0, 0}, {}});
        mesh.vertex({{side * x, y, -side * depth / 2}, {side, 0, 0}, {}}),
            mesh.vertex({{side * x, y + rise, 0}, {side, 0, 0}, {}});
        mesh.triangle(first, first + 1, first + 2);
    }
    for (int i = 0; i < dormers; ++i) {
        const double at = width * (i + 0.5) / dormers - x, foot = depth / 2 - 0.9;
        mesh.material(index(trim));
        mesh.box({at - 0.65, y + 0.2, 0.3}, {at + 0.65, y + 1.9, foot},
                 MeshBuilder::kBottom | MeshBuilder::kBack | MeshBuilder::kTop);
        mesh.material(index(glass));
        mesh.quad({at - 0.45, y + 0.75, foot + 0.01}, {at + 0.45, y + 0.75, foot + 0.01},
                  {at + 0.45, y + 1.75, foot + 0.01}, {at - 0.45, y + 1.75, foot + 0.01});
        mesh.material(index(slate)).box({at - 0.75, y + 1.9, 0.2}, {at + 0.75, y + 2.0, foot + 0.15});
    }
    mesh.material(index(brick));
    for (const double side : {-0.7, 0.62})
        mesh.box({side * x - 0.3, y + rise * 0.4, -1.9}, {side * x + 0.3, y + rise + 0.9, -1.2}, MeshBuilder::kBottom);
}

}  // namespace

Mesh row_building(const BuildingSpec& spec) {
    MeshBuilder mesh("building " + std::to_string(spec.seed));
    Random random(spec.seed);
    constexpr double kShop = 4.2;
    const double storey_height = random.in(3.0, 3.5), z = spec.depth / 2;
    const int bays = static_cast<int>(spec.width / random.in(2.5, 3.3));
    const Windows windows{spec.wall, random.in(0.36, 0.5),  random.in(1.5, 2.0),
                          0.85,      random.in(0.18, 0.32), spec.seed % 3 == 0};
    const dmat4 front = move(0, 0, z), back = turn_y(180) * move(0, 0, z);
    double y = kShop;
    shop_floor(mesh, front, spec.width, kShop, bays, spec.seed % 2 == 0 ? grey_stone : trim);
    Windows plain = windows;
    plain.balconies = false;
    storey(mesh, back, spec.width, 0, kShop, bays, plain, random);
    for (int i = 1; i < spec.floors; ++i, y += storey_height) {
        storey(mesh, front, spec.width, y, y + storey_height, bays, windows, random);
        storey(mesh, back, spec.width, y, y + storey_height, bays, plain, random);
        if (spec.seed % 4 == 1 && i > 1)
            mesh.material(index(trim))
                .box({-spec.width / 2, y - 0.08, z}, {spec.width / 2, y + 0.08, z + 0.09},
                     kOnWall | MeshBuilder::kLeft | MeshBuilder::kRight);
    }
    for (const int side : {-1, 1}) {
        const dmat4 frame = turn_y(90 * side) * move(0, 0, spec.width / 2);
        if (side != spec.open_side) {
            mesh.frame(frame).material(index(spec.wall)).quad({-z, 0, 0}, {z, 0, 0}, {z, y, 0}, {-z, y, 0});
            mesh.frame(dmat4(1));
            continue;
        }
        shop_floor(mesh, frame, spec.depth, kShop, bays, spec.seed % 2 == 0 ? grey_stone : trim);
        for (double low = kShop; low < y - 1; low += storey_height)
            storey(mesh, frame, spec.depth, low, low + storey_height, bays, plain, random);
    }
    mesh.material(index(trim));  // cornice
    mesh.box({-spec.width / 2, y - 0.35, z}, {spec.width / 2, y, z + 0.32}, kOnWall);
    if (spec.seed % 5 < 3)
        pitched_roof(mesh, spec.width, spec.depth, y, 3.4, 0, spec, bays / 2);
    else
        flat_roof(mesh, spec.width, spec.depth, y, spec.wall, random);
    return mesh.take();
}

Mesh tower_building(const BuildingSpec& spec) {
    MeshBuilder mesh("tower " + std::to_string(spec.seed));
    Random random(spec.seed);
    constexpr double kLobby = 6, kStorey = 3.6;
    const int setback = spec.floors * 2 / 3;
    const bool curtain_wall = spec.seed % 3 != 0;
    const Windows windows{spec.wall, 0.62, 1.9, 0.8, 0.25, false};
    double width = spec.width, depth = spec.depth, y = kLobby;
    for (int side = 0; side < 4; ++side) {
        const double along = side % 2 == 0 ? width : depth, out = side % 2 == 0 ? depth : width;
        shop_floor(mesh, turn_y(90.0 * side) * move(0, 0, out / 2), along, kLobby, static_cast<int>(along / 4.5),
                   grey_stone);
    }
    for (int floor = 1; floor < spec.floors; ++floor, y += kStorey) {
        if (floor == setback) {
            mesh.material(index(gravel))
                .quad({-width / 2, y, depth / 2}, {width / 2, y, depth / 2}, {width / 2, y, -depth / 2},
                      {-width / 2, y, -depth / 2});
            width -= 5, depth -= 4;
        }
        for (int side = 0; side < 4; ++side) {
            const double along = side % 2 == 0 ? width : depth, out = side % 2 == 0 ? depth : width;
            const dmat4 frame = turn_y(90.0 * side) * move(0, 0, out / 2);
            const int bays = static_cast<int>(along / 2.6);
            if (!curtain_wall) {
                storey(mesh, frame, along, y, y + kStorey, bays, windows, random);
                continue;
            }
            mesh.frame(frame);
            for (int i = 0; i < bays; ++i) {
                const double x0 = along * i / bays - along / 2, x1 = x0 + along / bays;
                mesh.material(index(random() < 0.05 ? curtain : glass));
                mesh.quad({x0, y + 0.9, 0}, {x1, y + 0.9, 0}, {x1, y + kStorey, 0}, {x0, y + kStorey, 0});
                mesh.material(index(spec.wall))
                    .quad({x0, y, 0.06}, {x1, y, 0.06}, {x1, y + 0.9, 0.06}, {x0, y + 0.9, 0.06});
                mesh.quad({x0, y + 0.9, 0.06}, {x1, y + 0.9, 0.06}, {x1, y + 0.9, 0}, {x0, y + 0.9, 0});
                mesh.material(index(steel))
                    .box({x0 - 0.05, y, 0}, {x0 + 0.05, y + kStorey, 0.3},
                         kOnWall | MeshBuilder::kTop | MeshBuilder::kBottom);
            }
            mesh.frame(dmat4(1));
        }
    }
    flat_roof(mesh, width, depth, y, spec.wall, random);
    mesh.material(index(steel));
    const dvec3 mast[] = {{0, y + 2.5, 0}, {0, y + 9, 0}};
    tube(mesh, mast, 0.12, 6);
    return mesh.take();
}

Mesh house(const BuildingSpec& spec) {
    MeshBuilder mesh("house " + std::to_string(spec.seed));
    Random random(spec.seed);
    constexpr double kStorey = 2.9;
    const double z = spec.depth / 2, x = spec.width / 2;
    const Windows windows{spec.wall, 0.45, 1.3, 0.9, 0.18, false};
    double y = 0;
    for (int floor = 0; floor < spec.floors; ++floor, y += kStorey)
        for (int side = 0; side < 4; ++side) {
            const double along = side % 2 == 0 ? spec.width : spec.depth, out = side % 2 == 0 ? z : x;
            storey(mesh, turn_y(90.0 * side) * move(0, 0, out), along, y, y + kStorey, 3 - side % 2, windows, random);
        }
    mesh.material(index(door))
        .quad({-0.5, kGround, z + 0.17}, {0.5, kGround, z + 0.17}, {0.5, 2.2, z + 0.17}, {-0.5, 2.2, z + 0.17});
    mesh.material(index(trim));  // porch
    mesh.box({-0.6, kGround, z}, {0.6, 2.3, z + 0.16}, kOnWall | MeshBuilder::kBottom);
    mesh.box({-1.2, 2.4, z}, {1.2, 2.55, z + 1.5}, kOnWall);
    for (const double side : {-1.1, 1.0})
        mesh.box({side, kGround, z + 1.3}, {side + 0.1, 2.4, z + 1.4}, MeshBuilder::kTop | MeshBuilder::kBottom);
    mesh.material(index(concrete))
        .box({-1.2, kGround, z}, {1.2, kGround + 0.15, z + 1.5}, kOnWall | MeshBuilder::kBottom);
    pitched_roof(mesh, spec.width, spec.depth, y, 2.8, 0.25, spec, 0);
    return mesh.take();
}

}  // namespace halflight::scenes
