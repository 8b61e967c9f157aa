#include "engine/scene/scene_size.h"

#include <algorithm>
#include <vector>

#include "engine/scene/image_tiles.h"
#include "engine/scene/scene.h"

namespace halflight {
namespace {

template <class T>
std::size_t bytes_of(const std::vector<T>& values) {
    return values.size() * sizeof(T);
}

}  // namespace

SceneSize with_tiles(SceneSize size) {
    // Bytes per tile, with a margin: 4 for its place in the file, 16 for slots and requests.
    size.tile_bytes = size.texture_bytes / ImageTiles::kBytes * 24;
    size.texture_bytes = size.deep_bytes = 0;
    // An image is decoded as a whole before it is cut. Its luminance is summed if it lights the scene.
    size.decoding_bytes += std::max(size.largest_image, 3 * std::min(size.largest_image, size.pinned_bytes));
    return size;
}

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
    const auto add_image = [&](const TextureImage& image) {
        size.texture_bytes += image.rgba.size();
        if (image.deep) size.deep_bytes += image.rgba.size() / 2;
        if (image.tiles) size.tile_bytes += image.tiles->bytes();
    };
    for (const TextureImage& image : scene.images) {
        add_image(image);
        for (const auto* levels : {&image.color_levels, &image.data_levels}) std::ranges::for_each(*levels, add_image);
    }
    size.instance_bytes = bytes_of(scene.instances);
    for (const Instance& instance : scene.instances) size.instance_bytes += instance.name.size();
    size.paged = scene.paged_bounds.has_value();
    size.environment_bytes = 2 * bytes_of(scene.environment.map.pixels);
    return size;
}

}  // namespace halflight
