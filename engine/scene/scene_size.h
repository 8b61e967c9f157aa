// The size of a scene, from which memory is estimated (renderer/memory.h).
#pragma once

#include <cstddef>

namespace halflight {

struct Scene;

struct SceneSize {
    std::size_t geometry_bytes = 0;     // meshes
    std::size_t largest_mesh = 0;       // bytes of the largest mesh; 0 for a loaded scene
    std::size_t instance_bytes = 0;     // instances
    std::size_t texture_bytes = 0;      // images in memory
    std::size_t deep_bytes = 0;         // those that images of 16 bits take beyond 8 bits
    std::size_t tile_bytes = 0;         // indices of images in tiles (engine/scene/image_tiles.h)
    std::size_t pinned_bytes = 0;       // images that tests of alpha and light samples look up; 0 for a loaded scene
    std::size_t largest_image = 0;      // bytes of the largest image; 0 for a loaded scene
    std::size_t environment_bytes = 0;  // environment map and the table for its samples
    std::size_t decoding_bytes = 0;     // working memory of image decoders, which ends with loading
    std::size_t vertices = 0;           // number of vertices of all meshes
    std::size_t stored = 0;             // number of triangles of all meshes
    std::size_t vertex_texels = 0;      // texels of vertex attributes on the device; 0 for a loaded scene
    std::size_t drawn = 0;              // number of triangles of all instances
    bool moves = false;                 // contents are kept for other poses
    bool paged = false;                 // geometry is in pages, whose server traces all rays

    /// Returns the bytes of a Scene.
    std::size_t contents() const {
        return geometry_bytes + instance_bytes + texture_bytes + tile_bytes + environment_bytes;
    }
};

/// Returns the size of a scene, as headers tell it, whose images are put into tiles.
SceneSize with_tiles(SceneSize size);

/// Returns the size of a loaded scene; `moves` stays false.
SceneSize size_of(const Scene& scene);

}  // namespace halflight
