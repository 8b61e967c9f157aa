// A scene on the GPU: what the rasterizer draws and what shading reads. Rays have their own (rays::TraceScene).
#pragma once

#include <cstddef>
#include <vector>

#include "engine/gpu/buffer.h"
#include "engine/gpu/object.h"
#include "engine/gpu/program.h"
#include "engine/gpu/texture.h"
#include "engine/tables/shading_tables.h"
#include "engine/tables/tables.h"

namespace halflight {

/// Arrays that the scene does not need are not there.
class SceneBuffers {
  public:
    /// Throws Error where an array exceeds what the driver can address.
    SceneBuffers(const TraceTables& trace, const ShadingTables& shading);

    /// What buffers hold.
    struct Content {
        const TraceTables& trace;
        const ShadingTables& shading;
    };
    /// Brings them to other tables, those of another pose. Texels that are left out stay. last: so that no more is
    /// written than what differs, where it is known. Throws Error as the constructor; they are of no use then.
    void update(const TraceTables& trace, const ShadingTables& shading, const Content* last);

    const SceneNeeds& needs() const { return needs_; }
    /// Selects the shader variants for this scene: those of shader_defines, and HALFLIGHT_SURFACE_ROWS.
    const gpu::Defines& defines() const { return defines_; }
    std::size_t surface_record_bytes() const;  ///< of one G-buffer record (shaders/shared/surface.h)
    std::size_t widest_record_bytes() const;   ///< of what a frame keeps by path, one buffer each
    std::size_t bytes() const;                 ///< in device memory

    /// Binds every array to its texture unit (shaders/shared/bindings.h).
    void bind() const;
    /// Draws all block instances with the program that is bound (shaders/gbuffer.vert), setting `first_triangle` of
    /// each block.
    void draw(const gpu::Program& program) const;

  private:
    struct View {
        GLuint unit;
        GLenum format;
        gpu::Buffer buffer;
    };
    void update_tables(const TraceTables& trace, const ShadingTables& shading, const Content* last);
    void set_draws(const TraceTables& trace);
    struct Draw {
        std::uint32_t first_triangle;
        std::uint32_t triangle_count;
        std::uint32_t first_instance;
        std::uint32_t instance_count;
    };
    SceneNeeds needs_;
    gpu::Defines defines_;
    std::vector<View> views_;
    std::vector<Draw> draws_;
    gpu::Buffer positions_;
    gpu::Buffer indices_;    // three per triangle, for the rasterizer
    gpu::Buffer instances_;  // block instances, those of a block together
    gpu::Texture environment_;
    gpu::Texture albedo_;
    gpu::Object<gpu::delete_vertex_array> vertex_array_;
};

}  // namespace halflight
