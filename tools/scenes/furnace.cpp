// The white furnace: an enclosure of emission 1 - a and albedo a, in which bodies without losses are invisible.
#include "tools/scenes/scenes.h"
#include "tools/scenes/shapes.h"

namespace halflight::scenes {

Document furnace(double albedo) {
    Document document("furnace");
    Material walls = matte("enclosure", dvec3(albedo));
    walls.emission = dvec3(1 - albedo);
    MeshBuilder enclosure("enclosure");
    enclosure.material(document.material(walls));
    dvec3 corners[8];  // mirrored in x, so that front faces point inwards
    for (int i = 0; i < 8; ++i) corners[i] = {i & 1 ? -4 : 4, i & 2 ? 3 : -3, i & 4 ? 4 : -4};
    enclosure.hexahedron(corners);
    document.node("enclosure", document.mesh(enclosure.take()));

    Material coated = matte("coated diffuse", dvec3(1));
    coated.clearcoat = 1, coated.clearcoat_roughness = 0.2;
    const Material materials[] = {matte("diffuse", dvec3(1)),
                                  glossy("dielectric 0.1", dvec3(1), 0.1),
                                  glossy("dielectric 0.5", dvec3(1), 0.5),
                                  coated,
                                  metal("mirror", dvec3(1), 0),
                                  metal("metal 0.2", dvec3(1), 0.2),
                                  metal("metal 0.5", dvec3(1), 0.5),
                                  metal("metal 1", dvec3(1), 1)};
    int i = 0;
    for (const Material& material : materials) {
        // Facets are flat: with interpolated normals some light would be sampled into the surface and be lost.
        MeshBuilder ball(material.name);
        ball.material(document.material(material));
        faceted_sphere(ball, dvec3(0), 0.45, 2);
        document.node(material.name, document.mesh(ball.take()), move(-1.8 + 1.2 * (i % 4), i < 4 ? 0.6 : -0.6, -1));
        ++i;
    }
    document.camera("camera", {0, 0, 3.5}, {0, 0, -1}, 38, 16.0 / 9);
    return document;
}

}  // namespace halflight::scenes
