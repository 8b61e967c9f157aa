// Three lamps before a wall, which shows how they spread their light.
#include "tools/scenes/scenes.h"

namespace halflight::scenes {

Document lamps() {
    Document document("lamps");
    const int plaster = document.material(matte("plaster", {0.7, 0.68, 0.64}));
    const int boards = document.material(matte("boards", {0.4, 0.27, 0.17}));
    const auto quad = [&](const char* name, int material, const dvec3& a, const dvec3& b, const dvec3& c,
                          const dvec3& d) {
        MeshBuilder mesh(name);
        mesh.material(material).quad(a, b, c, d);
        document.node(name, document.mesh(mesh.take()));
    };
    quad("wall", plaster, {-2.25, 0, 0}, {2.25, 0, 0}, {2.25, 2.7, 0}, {-2.25, 2.7, 0});
    quad("floor", boards, {-2.25, 0, 2.5}, {2.25, 0, 2.5}, {2.25, 0, 0}, {-2.25, 0, 0});
    const char* const names[] = {"left", "middle", "right"};
    for (int i = 0; i < 3; ++i) document.lamp(names[i], {1.5 * (i - 1), 2.2, 0.3}, dvec3(1), 10, 180);
    document.camera("camera", {0, 1.4, 5.5}, {0, 1.3, 0}, 32, 0);
    return document;
}

}  // namespace halflight::scenes
