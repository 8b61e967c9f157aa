// The Cornell box, from published measurements in millimetres (Cornell University Program of Computer Graphics,
// "Cornell Box Data"). +x points left in the picture, +y up, +z away from the camera.
#include "tools/scenes/scenes.h"

namespace halflight::scenes {
namespace {

/// Returns a block given by the corners of its top, counter-clockwise from above; it stands on the floor.
Mesh block(const char* name, int material, double height, const dvec2 (&top)[4]) {
    MeshBuilder mesh(name);
    mesh.material(material).frame(grow(1e-3, 1e-3, 1e-3));
    const auto at = [&](int corner, double y) { return dvec3(top[corner % 4].x, y, top[corner % 4].y); };
    mesh.quad(at(0, height), at(1, height), at(2, height), at(3, height));
    for (int i = 0; i < 4; ++i) mesh.quad(at(i, 0), at(i + 1, 0), at(i + 1, height), at(i, height));
    return mesh.take();
}

}  // namespace

Document cornell(bool metal_boxes) {
    Document document(metal_boxes ? "cornell-metal" : "cornell");
    // Colours are the measured spectra under the measured light, converted to linear Rec.709.
    const int white = document.material(matte("white", {0.725, 0.71, 0.68}));
    const int red = document.material(matte("red", {0.63, 0.065, 0.05}));
    const int green = document.material(matte("green", {0.14, 0.45, 0.091}));
    const int lamp = document.material(light("light", {24, 20, 14}));
    int tall = white, low = white;
    if (metal_boxes) {
        tall = document.material(metal("brass", {0.9, 0.8, 0.6}, 0.3));
        low = document.material(metal("silver", {0.95, 0.93, 0.9}, 0.15));
    }

    const auto wall = [&](const char* name, int material, const dvec3& a, const dvec3& b, const dvec3& c,
                          const dvec3& d) {
        MeshBuilder mesh(name);
        mesh.material(material).frame(grow(1e-3, 1e-3, 1e-3));
        mesh.quad(a, b, c, d);
        document.node(name, document.mesh(mesh.take()));
    };
    wall("floor", white, {552.8, 0, 0}, {0, 0, 0}, {0, 0, 559.2}, {549.6, 0, 559.2});
    wall("ceiling", white, {556, 548.8, 0}, {556, 548.8, 559.2}, {0, 548.8, 559.2}, {0, 548.8, 0});
    wall("back wall", white, {549.6, 0, 559.2}, {0, 0, 559.2}, {0, 548.8, 559.2}, {556, 548.8, 559.2});
    wall("right wall", green, {0, 0, 559.2}, {0, 0, 0}, {0, 548.8, 0}, {0, 548.8, 559.2});
    wall("left wall", red, {552.8, 0, 0}, {549.6, 0, 559.2}, {556, 548.8, 559.2}, {556, 548.8, 0});
    // The light is 2 mm below the ceiling. A surface emits on both sides here, so a frame closes the gap.
    const double y = 546.8, top = 548.8, x0 = 213, x1 = 343, z0 = 227, z1 = 332;
    wall("light", lamp, {x1, y, z0}, {x1, y, z1}, {x0, y, z1}, {x0, y, z0});
    MeshBuilder frame("light frame");
    frame.material(white)
        .frame(grow(1e-3, 1e-3, 1e-3))
        .box({x0, y, z0}, {x1, top, z1}, MeshBuilder::kBottom | MeshBuilder::kTop);
    document.node("light frame", document.mesh(frame.take()));

    document.node("short block",
                  document.mesh(block("short block", low, 165, {{130, 65}, {82, 225}, {240, 272}, {290, 114}})));
    document.node("tall block",
                  document.mesh(block("tall block", tall, 330, {{423, 247}, {265, 296}, {314, 456}, {472, 406}})));
    // A film of 25 mm behind a lens of 35 mm has a field of view of 2 atan(12.5 / 35).
    document.camera("camera", {0.278, 0.273, -0.8}, {0.278, 0.273, 0}, 39.30765, 1);
    return document;
}

}  // namespace halflight::scenes
