// A furnished room lit through one small window; nearly all light is indirect.
#include "tools/scenes/exact.h"
#include "tools/scenes/scenes.h"
#include "tools/scenes/shapes.h"

namespace halflight::scenes {
namespace {

constexpr double kX = 2, kY = 2.6, kZ = 2.5;  // half width, height, half depth; metres

Mesh shell(int walls, int accent, int floor, int skirting) {
    MeshBuilder mesh("room");
    mesh.material(floor).quad({-kX, 0, kZ}, {kX, 0, kZ}, {kX, 0, -kZ}, {-kX, 0, -kZ});
    mesh.material(walls).quad({-kX, kY, -kZ}, {kX, kY, -kZ}, {kX, kY, kZ}, {-kX, kY, kZ});
    mesh.quad({kX, 0, kZ}, {-kX, 0, kZ}, {-kX, kY, kZ}, {kX, kY, kZ});
    mesh.material(accent).quad({-kX, 0, -kZ}, {kX, 0, -kZ}, {kX, kY, -kZ}, {-kX, kY, -kZ});
    mesh.material(walls).quad({kX, 0, -kZ}, {kX, 0, kZ}, {kX, kY, kZ}, {kX, kY, -kZ});
    mesh.frame(move(-kX, 0, 0) * turn_y(90));  // the wall with the window: its x is the room's -z
    pierced_wall(mesh, kZ, 0, kY, {0.1, 1.1}, {0.9, 1.95}, 0.3);
    mesh.material(skirting);
    mesh.box({0.04, 1.04, 0}, {0.96, 1.1, 0.05}, MeshBuilder::kBack);  // sill
    mesh.box({-kZ, 0, 0}, {kZ, 0.09, 0.015}, MeshBuilder::kBack | MeshBuilder::kBottom);
    mesh.frame(move(0, 0, -kZ));
    mesh.box({-kX + 0.015, 0, 0}, {kX - 0.015, 0.09, 0.015}, MeshBuilder::kBack | MeshBuilder::kBottom);
    mesh.frame(move(kX, 0, 0) * turn_y(-90));
    mesh.box({-kZ, 0, 0}, {kZ, 0.09, 0.015}, MeshBuilder::kBack | MeshBuilder::kBottom);
    return mesh.take();
}

Mesh table(int wood) {
    MeshBuilder mesh("table");
    mesh.material(wood);
    bevelled_box(mesh, {-0.7, 0.71, -0.4}, {0.7, 0.75, 0.4}, 0.006);
    for (const double x : {-0.62, 0.62})
        for (const double z : {-0.33, 0.33})
            mesh.box({x - 0.03, 0, z - 0.03}, {x + 0.03, 0.71, z + 0.03}, MeshBuilder::kBottom | MeshBuilder::kTop);
    return mesh.take();
}

Mesh chair(int wood) {
    MeshBuilder mesh("chair");
    mesh.material(wood);
    bevelled_box(mesh, {-0.22, 0.43, -0.22}, {0.22, 0.47, 0.22}, 0.01);
    for (const double x : {-0.19, 0.19}) {
        mesh.box({x - 0.02, 0, 0.16}, {x + 0.02, 0.44, 0.20}, MeshBuilder::kBottom);
        mesh.box({x - 0.02, 0, -0.215}, {x + 0.02, 0.95, -0.18}, MeshBuilder::kBottom);
    }
    for (int slat = 0; slat < 3; ++slat)
        mesh.box({-0.18, 0.58 + 0.13 * slat, -0.205}, {0.18, 0.66 + 0.13 * slat, -0.19});
    return mesh.take();
}

Mesh shelf(int wood, const std::vector<int>& covers) {
    MeshBuilder mesh("shelf");
    mesh.material(wood);
    constexpr double kWide = 1.2, kHigh = 1.5, kDeep = 0.3, kBoard = 0.025;
    for (const double x : {0.0, kWide - kBoard}) mesh.box({x, 0, 0}, {x + kBoard, kHigh, kDeep}, MeshBuilder::kBottom);
    mesh.box({0, 0.09, -0.001}, {kWide, kHigh, 0.004});
    Random random(3);
    for (int row = 0; row <= 4; ++row) {
        const double y = 0.09 + row * (kHigh - 0.09 - kBoard) / 4;
        mesh.material(wood).box({kBoard, y, 0.004}, {kWide - kBoard, y + kBoard, kDeep - 0.01},
                                MeshBuilder::kLeft | MeshBuilder::kRight);
        if (row == 4) break;
        const double stop = random.in(0.6, 1.1);
        for (double x = kBoard + 0.01; x < stop;) {  // books, side by side
            const double thick = random.in(0.02, 0.05), high = random.in(0.19, 0.27), deep = random.in(0.16, 0.22);
            mesh.material(covers[static_cast<std::size_t>(random.below(static_cast<int>(covers.size())))]);
            mesh.box({x, y + kBoard + 0.001, 0.05}, {x + thick - 0.002, y + kBoard + high, 0.05 + deep});
            x += thick;
        }
    }
    return mesh.take();
}

}  // namespace

Document room() {
    Document document("room");
    const auto add = [&](const char* name, const dvec3& color) { return document.material(matte(name, color)); };
    const int walls = add("whitewash", {0.80, 0.78, 0.74}), accent = add("ochre wall", {0.62, 0.40, 0.16});
    const int floor = add("floor", {0.50, 0.35, 0.22}), white = add("white paint", {0.78, 0.78, 0.76});
    const int wood = add("walnut", {0.30, 0.17, 0.09}), cloth = add("blue cloth", {0.10, 0.22, 0.42});
    const std::vector<int> covers{add("red cover", {0.48, 0.08, 0.07}), add("green cover", {0.10, 0.28, 0.15}), cloth,
                                  add("cream cover", {0.68, 0.60, 0.45}), add("black cover", {0.05, 0.05, 0.06})};
    const auto place = [&](const Mesh& mesh, const dmat4& matrix = dmat4(1)) {
        document.node(mesh.name, document.mesh(mesh), matrix);
    };
    place(shell(walls, accent, floor, white));
    place(table(wood), move(0.55, 0, -0.35));
    const int seat = document.mesh(chair(wood));
    document.node("chair", seat, move(0.25, 0, 0.25) * turn_y(165));
    document.node("chair", seat, move(0.75, 0, -1.0) * turn_y(12));
    place(shelf(wood, covers), move(0.3, 0, -kZ + 0.02));

    MeshBuilder rug("rug");
    rug.material(cloth);
    rug.box({-0.9, 0, -1.25}, {1.5, 0.012, 0.7}, MeshBuilder::kBottom);
    rug.material(covers[3]);
    rug.box({-0.8, 0.012, -1.15}, {1.4, 0.014, 0.6}, MeshBuilder::kBottom);
    place(rug.take());
    MeshBuilder things("bowl and jug");
    things.material(white);
    const dvec2 bowl[] = {{0.0, 0.0},    {0.05, 0.0},    {0.055, 0.012}, {0.12, 0.05},
                          {0.15, 0.095}, {0.145, 0.098}, {0.112, 0.055}, {0.0, 0.018}};
    things.frame(move(0.75, 0.75, -0.25));
    lathe(things, bowl, 48);
    const dvec2 jug[] = {{0.0, 0.0},   {0.055, 0.0},  {0.075, 0.06}, {0.07, 0.13}, {0.042, 0.19},
                         {0.05, 0.24}, {0.045, 0.24}, {0.037, 0.19}, {0.0, 0.12}};
    things.frame(move(0.35, 0.75, -0.45));
    lathe(things, curve(jug, 3), 40);
    things.material(covers[0]).frame(move(0.75, 0.75, -0.25));
    sphere(things, {-0.03, 0.065, 0.02}, 0.04, 24, 14);
    things.material(covers[1]);
    sphere(things, {0.045, 0.065, -0.01}, 0.04, 24, 14);
    place(things.take());
    MeshBuilder frame("picture");
    frame.frame(move(kX, 1.5, -0.4) * turn_y(-90)).material(wood);
    frame.box({-0.45, -0.33, 0}, {0.45, 0.33, 0.03}, MeshBuilder::kBack);
    frame.material(covers[3]).quad({-0.39, -0.27, 0.031}, {0.39, -0.27, 0.031}, {0.39, 0.27, 0.031},
                                   {-0.39, 0.27, 0.031});
    place(frame.take());

    // The panel outside is as bright as a sky, and high up, so that its light falls on floor and table.
    MeshBuilder panel("panel outside");
    panel.material(document.material(light("panel", {420, 435, 460})))
        .frame(move(-3.2, 2.65, -0.5) * turn_y(90) * turn_x(40));
    panel.quad({-0.6, -0.4, 0}, {0.6, -0.4, 0}, {0.6, 0.4, 0}, {-0.6, 0.4, 0});
    place(panel.take());
    document.camera("camera", {-1.25, 1.45, 2.3}, {0.35, 0.95, -1.2}, 52, 16.0 / 9);
    return document;
}

}  // namespace halflight::scenes
