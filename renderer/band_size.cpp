#include "renderer/band_size.h"

#include <algorithm>
#include <bit>

#include "engine/core/error.h"
#include "engine/settings/denoiser_windows.h"
#include "passes/surface/raster_window.h"
#include "shaders/shared/ray_structs.h"

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
    const std::size_t in_groups = static_cast<std::size_t>(limits.workgroup_count) * 64;
    const std::size_t in_blocks = limits.storage_block_bytes / scene.widest_record_bytes();
    if (s.denoise)
        for (const DenoiserWindow& w :
             denoiser_windows(s.camera.optics, {s.width, s.height}, rendered_window(s, s.camera.optics)))
            if (const int wide = w.size.x + 2 * w.margin; w.margin > 0 && wide > limits.texture_size)
                throw Error("render settings",
                            "{} pixels wide, as a panorama is denoised with its margins: the driver allows {} (--crop "
                            "renders parts)",
                            wide, limits.texture_size);
    return first_band(s, std::min({s.band_pixels, most_paths, in_groups, in_blocks}), limits.texture_size);
}

Band first_band(const RenderSettings& s, std::size_t paths, int texture_size) {
    const PixelWindow window = rendered_window(s, s.camera.optics);
    const ivec2 image = window.size(), whole(s.width, s.height);
    const std::size_t row_paths = (static_cast<std::size_t>(image.x) + 15) / 16 * 256;  // paths in a row of blocks
    const int widest = std::max(image.x, s.width);  // rasterizers draw the whole width
    if (widest > texture_size)
        throw Error("render settings", "{} pixels wide: the driver allows {}", widest, texture_size);
    const int most =
        std::min(static_cast<int>(std::max<std::size_t>(paths / row_paths, 1)) * 16, texture_size / 16 * 16);
    Band band{.image = image, .origin = window.first, .display = whole};
    const int stride = window_stride(whole);
    if (stride < s.height) {
        band.rows = std::min(static_cast<int>(std::bit_floor(static_cast<unsigned>(most))), stride);
        while (window.first.y % band.rows != 0) band.rows /= 2;  // no band reaches across raster windows
        return band;
    }
    const int bands = (image.y + most - 1) / most;
    const int rows = ((image.y + bands - 1) / bands + 15) / 16 * 16;
    band.rows = std::min(rows, image.y);
    return band;
}

}  // namespace halflight
