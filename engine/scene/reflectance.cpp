#include "engine/scene/reflectance.h"

#include <cmath>
#include <vector>

namespace halflight {
namespace {

/// Of a channel of a texture; 1 where there is none.
double mean_of(const Scene& scene, const TextureRef& texture, std::size_t channel) {
    if (texture.image == kNone) return 1;
    const std::vector<std::uint8_t>& texels = scene.images[static_cast<std::size_t>(texture.image)].rgba;
    double sum = 0;
    for (std::size_t i = channel; i < texels.size(); i += 4) sum += texels[i];
    return texels.empty() ? 0 : sum / (255 * static_cast<double>(texels.size() / 4));
}

double glossiness(const Scene& scene, const Material& m) {
    if (m.unlit) return 0;
    const double metal = m.metallic > 0 ? m.metallic * mean_of(scene, m.metallic_roughness_texture, 2) : 0;
    const double clear = m.transmission > 0 ? m.transmission * mean_of(scene, m.transmission_texture, 0) : 0;
    return metal + (1 - metal) * clear;
}

}  // namespace

double glossy_share(const Scene& scene) {
    std::vector<double> of_material;
    for (const Material& m : scene.materials) of_material.push_back(glossiness(scene, m));
    std::vector<dvec2> of_mesh;  // area in object space: all of it, glossy
    for (const Mesh& mesh : scene.meshes) {
        dvec2& area = of_mesh.emplace_back(0);
        for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
            const uvec3 corner = mesh.triangles[t];
            const dvec3 a(mesh.positions[corner.x]), b(mesh.positions[corner.y]), c(mesh.positions[corner.z]);
            area += glm::length(glm::cross(b - a, c - a)) * dvec2(1, of_material[mesh.triangle_material[t]]);
        }
    }
    dvec2 area(0);
    for (const Instance& instance : scene.instances) {
        const double volume = std::abs(glm::determinant(dmat3(instance.object_to_world)));
        area += std::pow(volume, 2.0 / 3) * of_mesh[static_cast<std::size_t>(instance.mesh)];
    }
    return area.x > 0 ? area.y / area.x : 0;
}

}  // namespace halflight
