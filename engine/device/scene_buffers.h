// The scene tables on the device that the rasterizer and shading read. Hierarchies are in rays::TraceScene.
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "engine/gpu/buffer.h"
#include "engine/gpu/object.h"
#include "engine/gpu/program.h"
#include "engine/gpu/texture.h"
#include "engine/paging/tile_pool.h"
#include "engine/tables/shading_tables.h"
#include "engine/tables/tables.h"
#include "shaders/shared/texture_rows.h"

namespace halflight {

/// Owns the scene tables on the device. Tables that the scene does not need are empty.
class SceneBuffers {
  public:
    /// Throws Error if an array exceeds what the driver can address. bank_shift: largest logarithm of the texels of
    /// a bank of a texel pool (shaders/shared/texture_rows.h); banks are never larger than the driver's texture buffers.
    /// tile_bytes: bytes of device memory for tiles of textures, if these are in tiles.
    SceneBuffers(const TraceTables& trace, const ShadingTables& shading, unsigned bank_shift = shared::kMostBankShift,
                 std::size_t tile_bytes = std::size_t{256} << 20);

    /// Describes the tables of a scene with these needs, for graphs that are compiled and never run. Needs no context.
    explicit SceneBuffers(const SceneNeeds& needs);

    /// Tables that the buffers hold.
    struct Content {
        const TraceTables& trace;
        const ShadingTables& shading;
    };
    /// Updates the buffers to the tables of another pose. Texels that are left out are kept. `last` holds the tables in
    /// the buffers, or is null; if given, only differences are written. Throws Error like the constructor. After a
    /// failed update the object may only be destroyed.
    void update(const TraceTables& trace, const ShadingTables& shading, const Content* last);

    const SceneNeeds& needs() const { return needs_; }
    /// Returns the defines that select shader variants for this scene: shader_defines() and those of banks.
    const gpu::Defines& defines() const { return defines_; }
    std::size_t surface_record_bytes() const { return needs_.surface_record_bytes(); }
    std::size_t bytes() const;  ///< Returns the size in device memory, bytes.

    /// Returns the block instances as shaders/shared/instance_texels.h lays them out, for rays::TraceScene too.
    const gpu::Buffer& instance_rows() const { return instance_rows_; }

    /// Returns the pool of texture tiles, or null if all textures are in memory. Kernels that look up any texture
    /// run by TilePool::shade().
    paging::TilePool* tiles() const { return tiles_.get(); }

    /// Binds every table to its texture unit (shaders/shared/texture_units.h).
    void bind() const;
    /// Draws all block instances with the bound program (shaders/gbuffer.vert) and sets `first_triangle` for each
    /// block.
    void draw(const gpu::Program& program) const;

  private:
    struct View {
        GLuint unit;
        GLenum format;
        gpu::Buffer buffer;
    };
    void set_needs(const SceneNeeds& needs);
    void set_draws(const TraceTables& trace);
    gpu::Buffer& view(GLuint unit, GLenum format, const char* name);
    /// Uploads a texel pool: its first bank to `unit`, others from `more_units` on.
    template <class Channel>
    void bring_pool(const char* name, GLuint unit, GLuint more_units, GLenum format, const TexelPool<Channel>& texels);
    struct Draw {
        std::uint32_t first_triangle;
        std::uint32_t triangle_count;
        std::uint32_t first_instance;
        std::uint32_t instance_count;
    };
    SceneNeeds needs_;
    gpu::Defines defines_;
    unsigned bank_shift_;
    std::size_t tile_bytes_;
    std::unique_ptr<paging::TilePool> tiles_;
    std::vector<View> views_;
    std::vector<Draw> draws_;
    gpu::Buffer positions_;
    gpu::Buffer indices_;  // three indices per triangle, for the rasterizer
    gpu::Buffer instance_rows_;
    gpu::Buffer instances_;  // block instances, sorted by block
    gpu::Object<gpu::delete_vertex_array> vertex_array_;
};

}  // namespace halflight
