#include "passes/scene_buffers.h"

#include <algorithm>
#include <numeric>

#include "shaders/shared/bindings.h"
#include "shaders/shared/path.h"
#include "shaders/shared/surface.h"

namespace halflight {
namespace {

gpu::Texture table_texture(const char* name, const Image& image, GLenum format) {
    gpu::TextureDesc desc;
    desc.width = std::max(image.width, 1);
    desc.height = std::max(image.height, 1);
    desc.format = format;
    gpu::Texture texture(name, desc);
    if (!image.pixels.empty()) texture.upload(std::span<const float>(image.pixels));
    texture.set_filter(GL_LINEAR);
    return texture;
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

SceneBuffers::SceneBuffers(const TraceTables& trace, const ShadingTables& shading)
    : needs_(shading.needs),
      positions_(gpu::Buffer::from("positions", trace.positions)),
      indices_(gpu::Buffer::from("triangle indices", corner_indices(trace))),
      instances_(gpu::Buffer::from("instances by block", instances_by_block(trace))),
      environment_(table_texture("environment", shading.environment, GL_RGB32F)),
      albedo_(table_texture("directional albedo", shading.albedo, GL_RG32F)) {
    for (const auto& [name, value] : shader_defines(needs_)) defines_.set(name, value);
    defines_.set("HALFLIGHT_SURFACE_ROWS",
                 std::to_string(shared::surface_rows(needs_.glossy, needs_.transmission, needs_.clearcoat)) + "u");

    const auto add = [&](GLuint unit, GLenum format, const char* name, const auto& values) {
        views_.push_back({unit, format, gpu::Buffer::from(name, values)});
    };
    add(UNIT_TRIANGLES, GL_RGBA32UI, "triangles", trace.triangles);
    add(UNIT_VERTICES, GL_RGBA32F, "vertex attributes", shading.vertices);
    add(UNIT_MATERIALS, GL_RGBA32F, "materials", shading.materials);
    add(UNIT_TEXTURES, GL_RGBA32UI, "texture descriptors", shading.textures);
    add(UNIT_COLOR_TEXELS, GL_RGBA16F, "colour texels", shading.color_texels);
    add(UNIT_DATA_TEXELS, GL_RGBA8, "data texels", shading.data_texels);
    add(UNIT_LIGHTS, GL_RGBA32F, "lights", shading.lights);
    add(UNIT_LIGHT_ALIAS, GL_RG32F, "light alias table", shading.light_alias);
    add(UNIT_LIGHT_TREE, GL_RGBA32F, "light tree", shading.light_tree);
    add(UNIT_LIGHT_OF_TRIANGLE, GL_R32UI, "light of triangle", shading.light_of_triangle);
    add(UNIT_ENVIRONMENT_ALIAS, GL_RGBA32F, "environment cells", shading.environment_cells);

    bind();  // for its errors

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

std::size_t SceneBuffers::surface_record_bytes() const {
    return shared::surface_rows(needs_.glossy, needs_.transmission, needs_.clearcoat) * sizeof(vec4);
}

std::size_t SceneBuffers::widest_record_bytes() const {
    constexpr std::size_t sums = 6 * sizeof(double);  // of two lobes' radiance
    return std::max({surface_record_bytes(), sizeof(shared::PathState), sums});
}

std::size_t SceneBuffers::bytes() const {
    std::size_t total = positions_.bytes() + indices_.bytes() + instances_.bytes() +
                        gpu::texture_bytes(environment_.desc()) + gpu::texture_bytes(albedo_.desc());
    for (const View& v : views_) total += v.buffer.bytes();
    return total;
}

void SceneBuffers::bind() const {
    for (const View& v : views_) v.buffer.bind_texture(v.unit, v.format);
    positions_.bind_texture(UNIT_POSITIONS, GL_RGB32F);
    environment_.bind(UNIT_ENVIRONMENT);
    albedo_.bind(UNIT_ALBEDO);
}

void SceneBuffers::draw(const gpu::Program& program) const {
    glBindVertexArray(vertex_array_.id());
    glEnable(GL_DEPTH_TEST);
    glDepthFunc(GL_GREATER);                       // reversed depth
    glClipControl(GL_LOWER_LEFT, GL_ZERO_TO_ONE);  // which a shift by 1/2 would rob of its precision far away
    for (const Draw& d : draws_) {
        program.set("first_triangle", d.first_triangle);
        const auto offset = reinterpret_cast<const void*>(std::size_t{d.first_triangle} * sizeof(uvec3));
        glDrawElementsInstancedBaseInstance(GL_TRIANGLES, static_cast<GLsizei>(d.triangle_count * 3), GL_UNSIGNED_INT,
                                            offset, static_cast<GLsizei>(d.instance_count), d.first_instance);
    }
}

}  // namespace halflight
