// The city's models that are not buildings: the ground of a block, trees, lamps, cars; and the list of them all.
#include <algorithm>

#include "tools/scenes/city_buildings.h"
#include "tools/scenes/exact.h"
#include "tools/scenes/shapes.h"

namespace halflight::scenes {
namespace {

using enum CityMaterial;

constexpr double kKerb = 0.14;

int index(CityMaterial material) {
    return static_cast<int>(material);
}

void flat(MeshBuilder& mesh, double x0, double x1, double z0, double z1, double y) {
    mesh.quad({x0, y, z1}, {x1, y, z1}, {x1, y, z0}, {x0, y, z0});
}

/// Adds asphalt with markings, a raised pavement, and the cover of the lots.
void ground(MeshBuilder& mesh, CityMaterial cover) {
    constexpr double kCell = kPitchX / 2, kDepth = kPitchZ / 2, kX = kBlockX / 2, kZ = kBlockZ / 2, kPaint = 0.01;
    mesh.material(index(asphalt));
    flat(mesh, -kCell, kCell, -kDepth, kDepth, 0);
    mesh.material(index(pavement)).box({-kX, 0, -kZ}, {kX, kKerb, kZ}, MeshBuilder::kBottom | MeshBuilder::kTop);
    const double lx = kLotsX / 2, lz = kLotsZ / 2;
    flat(mesh, -kX, kX, lz, kZ, kKerb), flat(mesh, -kX, kX, -kZ, -lz, kKerb);
    flat(mesh, -kX, -lx, -lz, lz, kKerb), flat(mesh, lx, kX, -lz, lz, kKerb);
    mesh.material(index(cover));
    flat(mesh, -lx, lx, -lz, lz, kKerb);
    mesh.material(index(marking));  // half of each street belongs to this block
    for (double x = -kX + 9; x < kX - 9; x += 6)
        for (const double z : {-kDepth, kDepth - 0.08}) flat(mesh, x, x + 3, z, z + 0.08, kPaint);
    for (double z = -kZ + 9; z < kZ - 9; z += 6)
        for (const double x : {-kCell, kCell - 0.08}) flat(mesh, x, x + 0.08, z, z + 3, kPaint);
    for (int stripe = 0; stripe < 5; ++stripe) {  // crossings at the corners
        const double at = 0.5 + 1.1 * stripe;
        for (const double sx : {-1.0, 1.0})
            for (const double sz : {-1.0, 1.0}) {
                const double x0 = sx * (kX - 3), x1 = sx * (kX - 6), z0 = sz * (kZ + at), z1 = sz * (kZ + at + 0.55);
                flat(mesh, std::min(x0, x1), std::max(x0, x1), std::min(z0, z1), std::max(z0, z1), kPaint);
            }
    }
}

Mesh block(const char* name, CityMaterial cover) {
    MeshBuilder mesh(name);
    ground(mesh, cover);
    return mesh.take();
}

/// Makes grass, two paths that cross, and a pond with a stone rim in the middle.
Mesh park() {
    MeshBuilder mesh("park");
    ground(mesh, grass);
    constexpr double kPath = 1.5, kY = kKerb + 0.01;
    mesh.material(index(gravel));
    flat(mesh, -kLotsX / 2, kLotsX / 2, -kPath, kPath, kY);
    for (const double side : {1.0, -1.0}) {
        const double z0 = side * kPath, z1 = side * kLotsZ / 2;
        flat(mesh, -kPath, kPath, std::min(z0, z1), std::max(z0, z1), kY);
    }
    mesh.material(index(trim));
    const dvec2 rim[] = {{7.4, kKerb}, {7.4, 0.55}, {6.9, 0.55}, {6.9, kKerb}};
    lathe(mesh, rim, 32);
    mesh.material(index(water));
    const dvec2 pond[] = {{6.95, 0.42}, {0, 0.42}};
    lathe(mesh, pond, 32);
    return mesh.take();
}

/// Makes a trunk and a few lumpy crowns.
Mesh tree(std::uint32_t seed) {
    MeshBuilder mesh("tree");
    Random random(seed);
    const double height = random.in(2.2, 3.2), girth = random.in(1.3, 1.9);
    mesh.material(index(bark));
    const dvec3 trunk[] = {{0, 0.1, 0}, {0.05, height * 0.6, 0.04}, {0, height + 0.8, 0}};
    tube(mesh, trunk, 0.16, 6);
    mesh.material(index(seed % 2 == 0 ? leaf : dark_leaf));
    const int crowns = 2 + static_cast<int>(seed % 3);
    for (int i = 0; i < crowns; ++i) {
        const double r = girth * (i == 0 ? 1 : random.in(0.55, 0.75)), phase = random.in(0, 6);
        const dvec2 direction = cos_sin_degrees(random.in(0, 360));
        const dvec3 centre(i == 0 ? 0 : direction.x * girth * 0.7,
                           height + girth * (i == 0 ? 0.75 : random.in(0.4, 1.4)),
                           i == 0 ? 0 : direction.y * girth * 0.7);
        surface(mesh, 9, 6, [&](double u, double v) {
            const dvec2 around = cos_sin_degrees(360 * u), up = cos_sin_degrees(180 * v - 90);
            const double lump = r * (1 + 0.13 * sine(3 * around.x + phase) * sine(4 * around.y + 5 * v + phase));
            // A row that shrinks to a point must do so exactly.
            return v == 0 || v == 1 ? centre + dvec3(0, (2 * v - 1) * r, 0)
                                    : centre + lump * dvec3(up.x * around.x, up.y, -up.x * around.y);
        });
    }
    return mesh.take();
}

Mesh lamp_post() {
    MeshBuilder mesh("lamp");
    mesh.material(index(steel));
    const dvec3 pole[] = {{0, 0.1, 0}, {0, 6.6, 0}, {0, 7, 0.5}, {0, 7.05, 1.6}};
    tube(mesh, pole, 0.06, 6);
    mesh.box({-0.14, 6.98, 1.4}, {0.14, 7.1, 2.1});
    return mesh.take();
}

Mesh car(CityMaterial paint) {
    MeshBuilder mesh("car");
    mesh.material(index(paint));
    bevelled_box(mesh, {-0.86, 0.3, -2.1}, {0.86, 0.86, 2.1}, 0.09);
    const auto cabin = [&](double low, double high, double inset, double front, double back, unsigned without) {
        const dvec3 corners[8] = {{-0.80, low, -1.7},
                                  {0.80, low, -1.7},
                                  {-0.80 + inset, high, -1.7 + back},
                                  {0.80 - inset, high, -1.7 + back},
                                  {-0.80, low, 0.9},
                                  {0.80, low, 0.9},
                                  {-0.80 + inset, high, 0.9 - front},
                                  {0.80 - inset, high, 0.9 - front}};
        mesh.hexahedron(corners, without);
    };
    mesh.material(index(glass));
    cabin(0.85, 1.38, 0.14, 0.65, 0.35, MeshBuilder::kBottom | MeshBuilder::kTop);
    mesh.material(index(paint));
    mesh.box({-0.67, 1.37, -1.36}, {0.67, 1.42, 0.26});
    mesh.material(index(tyre));
    for (const double x : {-0.78, 0.78})
        for (const double z : {-1.3, 1.35}) {
            mesh.frame(move(x, 0.33, z) * turn_z(90));
            const dvec2 wheel[] = {{0, -0.11}, {0.28, -0.11}, {0.33, -0.07}, {0.33, 0.07}, {0.28, 0.11}, {0, 0.11}};
            lathe(mesh, wheel, 10);
        }
    return mesh.take();
}

Mesh bollard() {
    MeshBuilder mesh("bollard");
    mesh.material(index(steel)).box({-0.09, 0.13, -0.09}, {0.09, 0.95, 0.09}, MeshBuilder::kBottom);
    return mesh.take();
}

}  // namespace

std::vector<Material> city_materials() {
    const auto paint_coat = [](const char* name, const dvec3& color) {
        Material material = glossy(name, color, 0.4);
        material.clearcoat = 1, material.clearcoat_roughness = 0.1;
        return material;
    };
    return {glossy("asphalt", dvec3(0.08), 0.8),
            matte("pavement", {0.36, 0.35, 0.33}),
            matte("marking", dvec3(0.72)),
            matte("grass", {0.12, 0.22, 0.06}),
            matte("gravel", {0.42, 0.38, 0.32}),
            matte("brick", {0.42, 0.16, 0.10}),
            matte("dark brick", {0.22, 0.11, 0.08}),
            matte("sandstone", {0.62, 0.50, 0.34}),
            matte("white render", {0.76, 0.74, 0.70}),
            matte("ochre render", {0.66, 0.46, 0.22}),
            matte("rose render", {0.64, 0.42, 0.36}),
            matte("grey stone", {0.45, 0.45, 0.44}),
            matte("concrete", {0.52, 0.51, 0.49}),
            matte("trim", {0.74, 0.72, 0.68}),
            glossy("glass", {0.02, 0.03, 0.035}, 0.1),
            matte("curtain", {0.50, 0.46, 0.40}),
            glossy("door", {0.09, 0.07, 0.05}, 0.4),
            matte("tiles", {0.44, 0.19, 0.11}),
            matte("slate", {0.13, 0.14, 0.16}),
            metal("steel", {0.46, 0.46, 0.47}, 0.45),
            matte("bark", {0.14, 0.10, 0.07}),
            matte("leaf", {0.13, 0.25, 0.06}),
            matte("dark leaf", {0.07, 0.16, 0.05}),
            glossy("water", {0.03, 0.08, 0.09}, 0.05),
            paint_coat("red paint", {0.45, 0.03, 0.03}),
            paint_coat("white paint", {0.75, 0.75, 0.74}),
            paint_coat("blue paint", {0.04, 0.10, 0.32}),
            paint_coat("grey paint", {0.18, 0.19, 0.20}),
            matte("tyre", dvec3(0.02))};
}

std::vector<CityModel> city_models() {
    std::vector<CityModel> models;
    const auto add = [&](ModelKind kind, Mesh mesh) { models.push_back({kind, std::move(mesh)}); };
    add(ModelKind::ground_urban, block("urban block", gravel));
    add(ModelKind::ground_tower, block("tower block", concrete));
    add(ModelKind::ground_houses, block("garden block", grass));
    add(ModelKind::ground_park, park());
    static constexpr CityMaterial kWalls[] = {brick,       sandstone,  white_render, ochre_render,
                                              rose_render, grey_stone, dark_brick};
    Random random(2015);
    const auto wall = [&] { return kWalls[random.below(static_cast<int>(std::size(kWalls)))]; };
    for (std::uint32_t i = 0; i < 28; ++i)
        add(ModelKind::row, row_building({kRowLot - 0.04, kLotDepth - 1.5, 3 + static_cast<int>(i % 6), wall(), i}));
    for (std::uint32_t i = 0; i < 16; ++i)
        add(i < 8 ? ModelKind::row_left : ModelKind::row_right,
            row_building(
                {kRowLot - 0.04, kLotDepth - 1.5, 3 + static_cast<int>(i % 5), wall(), 50 + i, i < 8 ? -1 : 1}));
    for (std::uint32_t i = 0; i < 10; ++i)
        add(ModelKind::corner,
            row_building({kLotsZ - 2 * kLotDepth, 12.5, 3 + static_cast<int>(i % 5), wall(), 100 + i}));
    for (std::uint32_t i = 0; i < 10; ++i)
        add(ModelKind::tower, tower_building({27.0 + random.below(3), 19.0 + random.below(3),
                                              9 + static_cast<int>(3 * i), i % 3 == 0 ? concrete : wall(), 200 + i}));
    for (std::uint32_t i = 0; i < 12; ++i)
        add(ModelKind::house,
            house({8.4 + 0.4 * random.below(4), 8.0, 1 + static_cast<int>(i % 3 != 0), wall(), 300 + i}));
    for (std::uint32_t i = 0; i < 6; ++i) add(ModelKind::tree, tree(i));
    add(ModelKind::lamp, lamp_post());
    for (const CityMaterial paint : {red_paint, white_paint, blue_paint, grey_paint}) add(ModelKind::car, car(paint));
    add(ModelKind::bollard, bollard());
    return models;
}

}  // namespace halflight::scenes
