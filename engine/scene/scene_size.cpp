#include "engine/scene/scene_size.h"

#include <vector>

#include "engine/scene/scene.h"

namespace halflight {
namespace {

template <class T>
std::size_t bytes_of(const std::vector<T>& values) {
    return values.size() * sizeof(T);
}

}  // namespace

SceneSize size_of(const Scene& scene) {
    SceneSize size;
    for (const Mesh& mesh : scene.meshes) {
        size.geometry_bytes += bytes_of(mesh.positions) + bytes_of(mesh.normals) + bytes_of(mesh.tangents) +
                               bytes_of(mesh.uvs[0]) + bytes_of(mesh.uvs[1]) + bytes_of(mesh.colors) +
                               bytes_of(mesh.triangles) + bytes_of(mesh.triangle_material);
        size.vertices += mesh.positions.size();
        size.stored += mesh.triangles.size();
    }
    for (const Instance& instance : scene.instances)
        size.drawn += scene.meshes[static_cast<std::size_t>(instance.mesh)].triangles.size();
    for (const TextureImage& image : scene.images) size.texture_bytes += bytes_of(image.rgba);
    size.instance_bytes = bytes_of(scene.instances);
    size.environment_bytes = 2 * bytes_of(scene.environment.map.pixels);
    return size;
}

}  // namespace halflight
