// A courtyard of two storeys with a stair, banners, a fountain and a window wall, under sun and sky.
#include "tools/scenes/atrium.h"

#include "tools/scenes/scenes.h"
#include "tools/scenes/textures.h"

namespace halflight::scenes {
namespace atrium {

Materials add_materials(Document& document) {
    const auto texture = [&](const char* name, std::string png) { return document.texture(name, std::move(png)); };
    const auto textured = [&](Material material, int color, int normal = kNothing) {
        material.color_texture = color, material.normal_texture = normal;
        return material;
    };
    const auto banner_cloth = [&](const char* name, const dvec3& cloth, const dvec3& motif) {
        Material material = textured(matte(name, dvec3(1)), texture(name, banner(cloth, motif).color));
        material.double_sided = true;
        return document.material(material);
    };
    const TextureSet tiles = marble_tiles(), ashlar = stone_blocks();
    Materials m{};
    Material floor = textured(glossy("marble floor", dvec3(1), 1), texture("tiles", tiles.color),
                              texture("tile normals", tiles.normal));
    floor.roughness_texture = texture("tile roughness", tiles.roughness);
    m.floor = document.material(floor);
    m.blocks = document.material(textured(glossy("ashlar", dvec3(0.95), 0.85), texture("ashlar", ashlar.color),
                                          texture("ashlar normals", ashlar.normal)));
    const int grain = texture("limestone", limestone().color);
    m.stone = document.material(textured(glossy("limestone", dvec3(1), 0.6), grain));
    m.plaster = document.material(textured(matte("plaster", {0.98, 0.86, 0.70}), grain));
    m.wood = document.material(textured(glossy("oak", dvec3(1), 0.5), texture("planks", planks().color)));
    m.brass = document.material(metal("brass", {0.91, 0.71, 0.36}, 0.25));
    m.iron = document.material(glossy("iron", dvec3(0.035), 0.45));
    Material water = glossy("water", {0.02, 0.06, 0.06}, 0.04);
    water.ior = 1.33;
    m.water = document.material(water);
    m.clay = document.material(glossy("terracotta", {0.58, 0.27, 0.16}, 0.8));
    m.soil = document.material(matte("soil", {0.06, 0.04, 0.03}));
    Material leaf = textured(glossy("leaves", dvec3(1), 0.6), texture("leaves", leaves().color));
    leaf.alpha_cutoff = 0.5, leaf.double_sided = true;
    m.leaf = document.material(leaf);
    m.lawn = document.material(matte("lawn", {0.10, 0.19, 0.05}));
    m.cushion = document.material(matte("red cloth", {0.45, 0.035, 0.03}));
    const dvec3 gold(0.88, 0.72, 0.34);
    m.banners[0] = banner_cloth("red banner", {0.66, 0.10, 0.09}, gold);
    m.banners[1] = banner_cloth("blue banner", {0.13, 0.24, 0.58}, gold);
    m.banners[2] = banner_cloth("green banner", {0.12, 0.40, 0.22}, gold);
    return m;
}

namespace {

void add_side(Document& document, const Materials& m) {
    const int low = document.mesh(column(m)), high = document.mesh(upper_column(m));
    const int low_arch = document.mesh(arcade(m, "arcade", kBay, kSpring, 1.15, 4.6, 0.6));
    const int high_arch = document.mesh(arcade(m, "upper arcade", kBay, kUpperSpring, 1.25, 8.98, 0.45));
    const int vaulting = document.mesh(vault(m)), rib = document.mesh(transverse_arch(m)),
              boards = document.mesh(ceiling(m));
    const int rail = document.mesh(balustrade(m, kBay - 0.48, 6)), edge = document.mesh(cornice(m, kBay));
    const int door = document.mesh(door_bay(m)), niche = document.mesh(niche_bay(m)),
              window = document.mesh(window_bay(m));
    const int vase = document.mesh(urn(m)), lamp = document.mesh(lantern(m));

    for (const double side : {1.0, -1.0}) {
        const dmat4 face = turn_y(side > 0 ? 180 : 0);  // +z points to the court
        const double axis = side * kHalfCourt, aisle = side * (kHalfCourt + kAisle / 2);
        for (int i = 0; i <= kBays; ++i) {
            const double x = kBay * i - kHalfLength;
            document.node("column", low, move(x, 0, axis));
            document.node("upper column", high, move(x, 0, axis));
            document.node("transverse arch", rib, move(x, 0, aisle));
        }
        for (int i = -1; i < kBays; ++i) {
            const double x = kBay * (i + 0.5) - kHalfLength;
            document.node("vault", vaulting, move(x, 0, aisle));
            document.node("gallery ceiling", boards, move(x, 0, aisle));
            const bool has_door = i % 3 == 1;
            const dmat4 wall = move(x, 0, side * kHalfWidth) * face;
            document.node("outer wall", has_door ? door : niche, wall);
            if (!has_door) document.node("urn", vase, wall * move(0, 0.9, -0.15));
            document.node("upper wall", window, wall);
            if (i < 0) continue;
            document.node("arcade", low_arch, move(x, 0, axis));
            document.node("upper arcade", high_arch, move(x, 0, axis));
            document.node("balustrade", rail, move(x, kGallery, axis));
            document.node("cornice", edge, move(x, 4.58, axis - side * 0.3) * face);
            document.node("cornice", edge, move(x, 8.98, axis - side * 0.225) * face);
            if (i % 3 == 0) document.node("lantern", lamp, move(x, 4.45, aisle));
        }
    }

    // The west end has three narrower bays across, instances of the same meshes.
    const double width = 2 * kHalfCourt / 3, narrow = width / kBay, middle = -kHalfLength - kBay / 2;
    const int low_end = document.mesh(arcade(m, "end arcade", width, kSpring, 1.05, 4.6, 0.6));
    const int high_end = document.mesh(arcade(m, "upper end arcade", width, kUpperSpring, 1.12, 8.98, 0.45));
    const dmat4 face = turn_y(90);
    for (int i = -1; i <= 1; ++i) {
        const double z = i * width;
        const dmat4 axis = move(-kHalfLength, 0, z) * face;
        document.node("end arcade", low_end, axis);
        document.node("upper end arcade", high_end, axis);
        document.node("cornice", edge, move(-kHalfLength + 0.3, 4.58, z) * face * grow(narrow, 1, 1));
        document.node("cornice", edge, move(-kHalfLength + 0.225, 8.98, z) * face * grow(narrow, 1, 1));
        document.node("vault", vaulting, move(middle, 0, z) * face * grow(narrow, 1, kBay / kAisle));
        document.node("gallery ceiling", boards, move(middle, 0, z) * face * grow(narrow, 1, kBay / kAisle));
        const dmat4 wall = move(-kHalfLength - kBay, 0, z) * face * grow(narrow, 1, 1);
        document.node("outer wall", i == 0 ? door : niche, wall);
        if (i != 0)
            document.node("balustrade", rail,
                          move(-kHalfLength, kGallery, z) * face * grow((width - 0.48) / (kBay - 0.48), 1, 1));
        if (i == 0)
            document.node("upper door", door,
                          wall * move(0, kGallery, 0) * grow(1, (kRoof - kGallery - 0.1) / kGallery, 1));
        else
            document.node("upper wall", window, wall);
    }
    for (const double z : {-width / 2, width / 2}) {
        document.node("column", low, move(-kHalfLength, 0, z));
        document.node("upper column", high, move(-kHalfLength, 0, z));
        document.node("transverse arch", rib, move(middle, 0, z) * face * grow(1, 1, kBay / kAisle));
    }
}

void add_furnishing(Document& document, const Materials& m) {
    int cloths[3];
    for (int i = 0; i < 3; ++i) cloths[i] = document.mesh(hanging(m, i, 1.5, 2.3));
    for (int i = 0; i < 3; ++i)
        for (const double side : {1.0, -1.0}) {
            const int cloth = cloths[(i + (side > 0 ? 1 : 0)) % 3];
            document.node("banner", cloth,
                          move(kBay * (2 * i + 1.5) - kHalfLength, 4.75, side * 3.56) * turn_y(side > 0 ? 180 : 0));
        }
    const int great = document.mesh(hanging(m, 0, 1.9, 3.4)), second = document.mesh(hanging(m, 1, 1.9, 3.4));
    document.node("great banner", great, move(-7.5, 8.44, 0) * turn_y(90));
    document.node("great banner", second, move(1.5, 8.44, 0) * turn_y(90));

    document.node("fountain", document.mesh(fountain(m)), move(1.5, 0, 0));
    const int bush = document.mesh(potted_bush(m, 7)), tree = document.mesh(potted_tree(m, 11)),
              seat = document.mesh(bench(m));
    for (const double side : {1.0, -1.0}) {
        document.node("potted tree", tree, move(-4.3, 0, side * 2.3) * turn_y(side > 0 ? 40 : 170));
        document.node("potted bush", bush, move(-7.5, 0, side * 3.25) * turn_y(80 * side));
        document.node("potted bush", bush, move(7.5, 0, side * 3.25) * turn_y(25 + 100 * side));
        document.node("potted bush", bush, move(12.6, 0, side * 3.2) * turn_y(200 + 60 * side));
        document.node("bench", seat, move(-1.5, 0, side * 3.1));
        document.node("bench", seat, move(4.5, 0, side * 3.1));
        document.node("bench", seat, move(6, 0, side * 7.5));
        document.node("bench", seat, move(-6, 0, side * 7.5));
    }
    const int top = document.mesh(table(m)), stool = document.mesh(chair(m)), vase = document.mesh(urn(m));
    document.node("table", top, move(8.2, 0, 1.2));
    document.node("table urn", vase, move(8.2, 0.77, 1.2) * grow(0.5, 0.5, 0.5));
    document.node("chair", stool, move(7.4, 0, 1.5) * turn_y(110));
    document.node("chair", stool, move(8.9, 0, 0.8) * turn_y(-65));
    document.node("chair", stool, move(8.4, 0, 2.1) * turn_y(190));
}

}  // namespace
}  // namespace atrium

Document atrium_scene() {
    using namespace atrium;
    Document document("atrium");
    const Materials m = add_materials(document);
    document.node("shell", document.mesh(shell(m)));
    document.node("stairs", document.mesh(stairs(m)));
    document.node("window wall", document.mesh(window_wall(m)));
    document.node("beams", document.mesh(beams(m)));
    document.node("garden", document.mesh(garden(m)));
    add_side(document, m);
    add_furnishing(document, m);
    document.sun("sun", {0.5, 1, 0.4}, {1, 0.93, 0.82}, 12);
    document.sky({1.4, 1.7, 2.2});
    document.camera("nave", {12.4, 2.3, 1.5}, {-6, 3.3, -0.4}, 52, 16.0 / 9);
    document.camera("balcony", {-9, 6.8, 3.85}, {4, 3.2, -3}, 55, 16.0 / 9);
    document.camera("detail", {4.9, 1.45, 1.7}, {0.6, 0.85, -0.9}, 40, 16.0 / 9);
    return document;
}

}  // namespace halflight::scenes
