#include "engine/device/scene_buffers.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <numeric>

#include "engine/core/error.h"
#include "engine/tables/instance_rows.h"
#include "shaders/shared/texture_units.h"

namespace halflight {
namespace {

/// Returns the logarithm of the texels that a texture buffer can have, rounded down.
unsigned texture_buffer_shift() {
    GLint texels = 0;
    glGetIntegerv(GL_MAX_TEXTURE_BUFFER_SIZE, &texels);
    return static_cast<unsigned>(std::bit_width(static_cast<unsigned>(texels))) - 1;
}

std::vector<uvec3> corner_indices(const TraceTables& trace) {
    std::vector<uvec3> indices(trace.triangles.size());
    std::transform(trace.triangles.begin(), trace.triangles.end(), indices.begin(),
                   [](const uvec4& t) { return uvec3(t); });
    return indices;
}

std::vector<std::uint32_t> instances_by_block(const TraceTables& trace) {
    std::vector<std::uint32_t> order(trace.instances.size());
    std::iota(order.begin(), order.end(), 0u);
    std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
        return trace.instances[a].block < trace.instances[b].block;
    });
    return order;
}

}  // namespace

SceneBuffers::SceneBuffers(const TraceTables& trace, const ShadingTables& shading, unsigned bank_shift,
                           std::size_t tile_bytes)
    : bank_shift_(std::min(bank_shift, texture_buffer_shift())),
      tile_bytes_(tile_bytes),
      positions_("positions", 0),
      indices_("triangle indices", 0),
      instance_rows_("block instances", 0),
      instances_("instances by block", 0) {
    const auto add = [&](GLuint unit, GLenum format, const char* name) { view(unit, format, name); };
    add(shared::kUnitTriangles, GL_RGBA32UI, "triangles");
    add(shared::kUnitVertices, GL_RGBA32F, "vertex attributes");
    add(shared::kUnitMaterials, GL_RGBA32F, "materials");
    add(shared::kUnitTextures, GL_RGBA32UI, "texture descriptors");
    add(shared::kUnitColorTexels, GL_RGBA16F, "colour texels");
    add(shared::kUnitDataTexels, GL_RGBA8, "data texels");
    add(shared::kUnitLights, GL_RGBA32F, "lights");
    add(shared::kUnitLightAlias, GL_RG32F, "light alias table");
    add(shared::kUnitLightTree, GL_RGBA32UI, "light tree");
    add(shared::kUnitLightOfTriangle, GL_R32UI, "light of triangle");
    add(shared::kUnitEnvironment, GL_RGB32F, "environment");
    add(shared::kUnitEnvironmentWarp, GL_RGBA32F, "environment warp");
    add(shared::kUnitAlbedo, GL_RG32F, "directional albedo");
    add(shared::kUnitLightGroups, GL_R32UI, "light groups");
    add(shared::kUnitLightLinks, GL_RGBA32UI, "light links");
    update(trace, shading, nullptr);
}

SceneBuffers::SceneBuffers(const SceneNeeds& needs)
    : bank_shift_(0),
      tile_bytes_(0),
      positions_("", 0, gpu::Buffer::Unmade{}),
      indices_("", 0, gpu::Buffer::Unmade{}),
      instance_rows_("", 0, gpu::Buffer::Unmade{}),
      instances_("", 0, gpu::Buffer::Unmade{}) {
    set_needs(needs);
}

gpu::Buffer& SceneBuffers::view(GLuint unit, GLenum format, const char* name) {
    const auto known = std::ranges::find(views_, unit, &View::unit);
    return known != views_.end() ? known->buffer : views_.emplace_back(View{unit, format, gpu::Buffer(name, 0)}).buffer;
}

template <class Channel>
void SceneBuffers::bring_pool(const char* name, GLuint unit, GLuint more_units, GLenum format,
                              const TexelPool<Channel>& texels) {
    const std::size_t bank = std::size_t{1} << bank_shift_, banks = (texels.size() + bank - 1) / bank;
    if (banks > shared::kMostBanks)
        throw Error(name, "{} texels; {} texture buffers of the driver end at {}", texels.size(), shared::kMostBanks,
                    shared::kMostBanks * bank);
    const GLuint end = more_units + shared::kMostBanks - 1;
    std::erase_if(views_, [&](const View& v) { return v.unit >= more_units && v.unit < end; });
    using Texel = typename TexelPool<Channel>::Texel;
    std::vector<Texel> piece(std::min(texels.size(), std::size_t{1} << 18));
    for (std::size_t b = 0; b < std::max<std::size_t>(banks, 1); ++b) {
        gpu::Buffer& buffer = view(b == 0 ? unit : more_units + static_cast<GLuint>(b) - 1, format, name);
        const std::size_t count = std::min(bank, texels.size() - b * bank);
        if (buffer.bytes() != count * sizeof(Texel)) buffer = gpu::Buffer(name, count * sizeof(Texel));
        for (std::size_t i = 0; i < count; i += piece.size()) {
            const std::span part = std::span(piece).first(std::min(piece.size(), count - i));
            texels.read(b * bank + i, part);
            buffer.write(std::span<const Texel>(part), i);
        }
    }
}

void SceneBuffers::set_needs(const SceneNeeds& needs) {
    needs_ = needs;
    defines_ = {};
    for (const auto& [name, value] : shader_defines(needs_)) defines_.set(name, value);
}

void SceneBuffers::update(const TraceTables& trace, const ShadingTables& shading, const Content* last) {
    set_needs(shading.needs);
    const auto bring = [&](GLuint unit, const auto& values, const auto& known) {
        gpu::replace(std::ranges::find(views_, unit, &View::unit)->buffer, values, known);
    };
    const TraceTables* const traced = last ? &last->trace : nullptr;
    const ShadingTables* const shaded = last ? &last->shading : nullptr;
    const bool topology = !traced || traced->triangles != trace.triangles;
    gpu::replace(positions_, trace.positions, traced ? &traced->positions : nullptr);
    if (topology) gpu::replace(indices_, corner_indices(trace));
    gpu::replace(instance_rows_, halflight::instance_rows(trace));
    gpu::replace(instances_, instances_by_block(trace));
    bring(shared::kUnitTriangles, trace.triangles, traced ? &traced->triangles : nullptr);
    bring(shared::kUnitVertices, shading.vertices, shaded ? &shaded->vertices : nullptr);
    bring(shared::kUnitMaterials, shading.materials, shaded ? &shaded->materials : nullptr);
    bring(shared::kUnitTextures, shading.textures, shaded ? &shaded->textures : nullptr);
    if (!shading.texels_left_out) {
        tiles_.reset();  // frees its memory first
        if (!shading.tiled.empty())
            tiles_ = std::make_unique<paging::TilePool>(shading.tiled, tile_bytes_, bank_shift_);
        bring_pool("colour texels", shared::kUnitColorTexels, shared::kUnitColorBanks, GL_RGBA16F,
                   shading.color_texels);
        bring_pool("data texels", shared::kUnitDataTexels, shared::kUnitDataBanks, GL_RGBA8, shading.data_texels);
    }
    for (const View& v : views_) {
        const bool color = v.unit >= shared::kUnitColorBanks && v.unit < shared::kUnitDataBanks;
        if (v.unit < shared::kUnitColorBanks || v.unit >= shared::kUnitTileSlots) continue;
        defines_.set(fmt::format("HALFLIGHT_{}_BANK_{}", color ? "COLOR" : "DATA",
                                 1 + v.unit - (color ? shared::kUnitColorBanks : shared::kUnitDataBanks)));
        defines_.set(color ? "HALFLIGHT_COLOR_BANK_SHIFT" : "HALFLIGHT_DATA_BANK_SHIFT", std::to_string(bank_shift_));
    }
    if (tiles_) tiles_->define(defines_);
    bring(shared::kUnitLights, shading.lights, shaded ? &shaded->lights : nullptr);
    bring(shared::kUnitLightAlias, shading.light_alias, shaded ? &shaded->light_alias : nullptr);
    bring(shared::kUnitLightTree, shading.light_tree, shaded ? &shaded->light_tree : nullptr);
    bring(shared::kUnitLightOfTriangle, shading.light_of_triangle, shaded ? &shaded->light_of_triangle : nullptr);
    bring(shared::kUnitLightGroups, shading.light_groups, shaded ? &shaded->light_groups : nullptr);
    bring(shared::kUnitLightLinks, shading.light_links, shaded ? &shaded->light_links : nullptr);
    bring(shared::kUnitEnvironment, shading.environment.pixels, shaded ? &shaded->environment.pixels : nullptr);
    bring(shared::kUnitAlbedo, shading.albedo.pixels, shaded ? &shaded->albedo.pixels : nullptr);
    bring(shared::kUnitEnvironmentWarp, shading.environment_warp, shaded ? &shaded->environment_warp : nullptr);
    bind();  // bind() reports tables beyond the driver's limits
    set_draws(trace);
}

void SceneBuffers::set_draws(const TraceTables& trace) {
    draws_.clear();
    for (const Block& block : trace.blocks) draws_.push_back({block.first_triangle, block.triangle_count, 0, 0});
    for (const BlockInstance& instance : trace.instances) ++draws_[instance.block].instance_count;
    std::uint32_t first_instance = 0;
    for (Draw& draw : draws_) {
        draw.first_instance = first_instance;
        first_instance += draw.instance_count;
    }

    GLuint id = 0;
    glCreateVertexArrays(1, &id);
    vertex_array_ = gpu::Object<gpu::delete_vertex_array>(id);
    glVertexArrayVertexBuffer(id, 0, positions_.id(), 0, sizeof(vec3));
    glVertexArrayAttribFormat(id, 0, 3, GL_FLOAT, GL_FALSE, 0);
    glVertexArrayAttribBinding(id, 0, 0);
    glEnableVertexArrayAttrib(id, 0);
    glVertexArrayVertexBuffer(id, 1, instances_.id(), 0, sizeof(std::uint32_t));
    glVertexArrayAttribIFormat(id, 1, 1, GL_UNSIGNED_INT, 0);
    glVertexArrayAttribBinding(id, 1, 1);
    glVertexArrayBindingDivisor(id, 1, 1);
    glEnableVertexArrayAttrib(id, 1);
    glVertexArrayElementBuffer(id, indices_.id());
}

std::size_t SceneBuffers::bytes() const {
    std::size_t total = positions_.bytes() + indices_.bytes() + instance_rows_.bytes() + instances_.bytes();
    for (const View& v : views_) total += v.buffer.bytes();
    if (tiles_) total += tiles_->bytes();
    return total;
}

void SceneBuffers::bind() const {
    for (const View& v : views_) v.buffer.bind_texture(v.unit, v.format);
    positions_.bind_texture(shared::kUnitPositions, GL_RGB32F);
    instance_rows_.bind_texture(shared::kUnitInstances, GL_RGBA32F);
    if (tiles_) tiles_->bind();
}

void SceneBuffers::draw(const gpu::Program& program) const {
    glBindVertexArray(vertex_array_.id());
    glEnable(GL_DEPTH_TEST);
    glDepthFunc(GL_GREATER);                       // depth is reversed
    glClipControl(GL_LOWER_LEFT, GL_ZERO_TO_ONE);  // the range [-1, 1] would lose the precision of far depths
    for (const Draw& d : draws_) {
        program.set("first_triangle", d.first_triangle);
        const auto offset = reinterpret_cast<const void*>(std::size_t{d.first_triangle} * sizeof(uvec3));
        glDrawElementsInstancedBaseInstance(GL_TRIANGLES, static_cast<GLsizei>(d.triangle_count * 3), GL_UNSIGNED_INT,
                                            offset, static_cast<GLsizei>(d.instance_count), d.first_instance);
    }
}

}  // namespace halflight
