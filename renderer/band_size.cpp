#include "renderer/band_size.h"

#include <algorithm>
#include <bit>

#include "engine/core/error.h"
#include "passes/surface/raster_window.h"
#include "shaders/shared/rays.h"

namespace halflight {

std::size_t most_paths_of_batch(const rays::Tracer& tracer, rays::RayKind kind, std::uint32_t rays, std::size_t bytes,
                                const gpu::Limits& limits) {
    constexpr std::uint32_t kPaths = 256;  // paths of a block: whole tiles of every size
    rays::RayBatch batch;
    batch.kind = kind;
    batch.capacity = kPaths * rays;
    if (kind == rays::RayKind::connection) batch.rays_of_path = rays;
    const std::size_t lists = rays::tile_list_bytes(tracer.scene(), batch, tracer.tile_settings());
    const std::size_t widest = std::max({lists, batch.capacity * sizeof(shared::Ray), kPaths * bytes});
    return std::min(limits.storage_block_bytes / widest * kPaths,
                    static_cast<std::size_t>(limits.workgroup_count) * 64 / rays);
}

Band first_band(const RenderSettings& s, const SceneBuffers& scene, std::size_t most_paths, const gpu::Limits& limits) {
    return first_band(s,
                      std::min({s.band_pixels, most_paths, limits.storage_block_bytes / scene.widest_record_bytes()}),
                      limits.texture_size);
}

Band first_band(const RenderSettings& s, std::size_t paths, int texture_size) {
    const std::size_t row_paths = (static_cast<std::size_t>(s.width) + 15) / 16 * 256;  // paths in a row of blocks
    if (s.width > texture_size)
        throw Error("render settings", "{} pixels wide: the driver allows {}", s.width, texture_size);
    const int most =
        std::min(static_cast<int>(std::max<std::size_t>(paths / row_paths, 1)) * 16, texture_size / 16 * 16);
    const ivec2 image(s.width, s.height);
    const int stride = window_stride(image);
    if (stride < s.height)
        return {image, 0, std::min(static_cast<int>(std::bit_floor(static_cast<unsigned>(most))), stride)};
    const int bands = (s.height + most - 1) / most;
    const int rows = ((s.height + bands - 1) / bands + 15) / 16 * 16;
    return {image, 0, std::min(rows, s.height)};
}

}  // namespace halflight
