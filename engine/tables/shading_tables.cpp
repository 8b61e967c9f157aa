#include "engine/tables/shading_tables.h"

#include <algorithm>
#include <cmath>
#include <future>

#include "engine/scene/material_properties.h"
#include "engine/tables/albedo.h"
#include "engine/tables/light_tree.h"
#include "engine/tables/shading_textures.h"
#include "shaders/shared/light.h"
#include "shaders/shared/texture.h"
#include "shaders/shared/vertex.h"
#include "shaders/shared/word.h"

namespace halflight {
namespace {

/// Returns the albedo table, which is equal for all scenes with, and for all without sheen.
Image albedo_table(bool sheen) {
    if (sheen) {
        static const Image table = build_albedo_table(true);
        return table;
    }
    static const Image table = build_albedo_table();
    return table;
}

/// Transform of normals and tangents of a merged mesh to world space. The largest coefficient of each matrix is scaled
/// to 1, so that products do not overflow and all vertices of a mesh keep equal weight.
struct VertexTransform {
    dmat3 normal{1};
    dmat3 tangent{1};
    float handedness = 1;  // sign of the determinant

    VertexTransform() = default;
    explicit VertexTransform(const dmat4& object_to_world) {
        const dmat3 m = scaled(dmat3(object_to_world));
        // Cofactors are the inverse transpose times the determinant, and exist for singular matrices, too.
        const dmat3 cofactors(glm::cross(m[1], m[2]), glm::cross(m[2], m[0]), glm::cross(m[0], m[1]));
        handedness = glm::determinant(m) < 0 ? -1.0f : 1.0f;
        normal = scaled(cofactors) * static_cast<double>(handedness);
        tangent = m;
    }

  private:
    static dmat3 scaled(const dmat3& m) {
        double largest = 0;
        for (int column = 0; column < 3; ++column) {
            for (int row = 0; row < 3; ++row) largest = std::max(largest, std::abs(m[column][row]));
        }
        return largest > 0 ? m / largest : m;
    }
};

class Builder {
  public:
    Builder(const Scene& scene, const TraceTables& trace, const SceneNeeds& kept, LightChoice choice, SunChoice sun)
        : scene_(scene), trace_(trace), kept_(kept), choice_(choice), sun_(sun), pools_(scene, tables_) {}

    ShadingTables build(const std::vector<PooledImage>* last) {
        std::vector<bool> used(scene_.materials.size(), false);
        for (const uvec4& triangle : trace_.triangles) used[triangle.w & kTriangleMaterialMask] = true;
        SceneNeeds& needs = tables_.needs;
        for (const BlockInstance& instance : trace_.instances) needs.instances |= !instance.identity;
        needs.alpha = trace_.alpha_tested;
        needs.slivers = trace_.slivers;
        find_attributes();
        const auto rows = static_cast<std::size_t>(material_rows());
        tables_.materials.assign(scene_.materials.size() * rows, vec4(0));
        for (std::size_t i = 0; i < scene_.materials.size(); ++i) {
            if (used[i]) add_material(scene_.materials[i], &tables_.materials[i * rows]);
        }
        complete(static_cast<MaterialNeeds&>(needs));
        tables_.texels_left_out = last && *last == tables_.pooled;
        if (!tables_.texels_left_out) pools_.fill();
        // The table takes about 15 ms, twice as much with sheen, and nothing below depends on it.
        std::future<Image> albedo;
        if (needs.glossy || kept_.glossy)
            albedo = std::async(std::launch::async, albedo_table, needs.sheen || kept_.sheen);
        add_lights();
        needs = united(needs, kept_);
        fill_light_tables();
        add_vertices();
        if (albedo.valid()) tables_.albedo = albedo.get();
        return std::move(tables_);
    }

  private:
    void find_attributes() {
        for (const MeshRange& range : trace_.ranges) {
            const std::vector<vec4>& colors = scene_.meshes[range.mesh].colors;
            tables_.needs.vertex_colors |=
                std::any_of(colors.begin(), colors.end(), [](const vec4& c) { return c != vec4(1); });
            has_tangents_ |= !scene_.meshes[range.mesh].tangents.empty();
        }
    }

    // --- Materials ------------------------------------------------------------------------------------------------

    void add_material(const Material& m, vec4* rows) {
        SceneNeeds& needs = tables_.needs;
        for (const MaterialLobe& lobe : material_lobes()) needs.*lobe.need |= lobe.present(m);
        for (const MaterialProperty& property : material_properties()) {
            const vec4 value = packed_value(m, property);
            for (int i = 0; property.packing.row != kNone && i < component_count(property.field); ++i)
                rows[property.packing.row][property.packing.component + i] = value[i];
        }
        for (const MaterialTexture& texture : material_textures()) {
            const TextureRef& ref = m.*texture.field;
            const bool normal_map = texture.use == TextureUse::normal_map;
            const bool used = ref && texture.matters(m) && (!normal_map || has_tangents_);
            needs.*texture.need |= used;
            const std::uint32_t slot = !used                              ? shared::kNoTexture
                                       : texture.use == TextureUse::color ? pools_.color(ref)
                                                                          : pools_.data(ref);
            rows[texture.packing.row][texture.packing.component] = shared::float_of_word(slot);
        }
    }

    // --- Vertices -------------------------------------------------------------------------------------------------

    void add_vertices() {
        const auto stride = static_cast<std::size_t>(tables_.needs.vertex_stride());
        tables_.vertices.assign(trace_.positions.size() * stride, vec4(0));
        for (const MeshRange& range : trace_.ranges) {
            const VertexTransform transform =
                range.merged ? VertexTransform(scene_.instances[range.instance].object_to_world) : VertexTransform();
            for (std::uint32_t i = 0; i < range.vertex_count; ++i) {
                add_vertex(scene_.meshes[range.mesh], i, transform,
                           &tables_.vertices[(range.first_vertex + i) * stride]);
            }
        }
    }

    void add_vertex(const Mesh& mesh, std::uint32_t i, const VertexTransform& transform, vec4* row) const {
        const SceneNeeds& needs = tables_.needs;
        const vec2 uv0 = mesh.uvs[0].empty() ? vec2(0) : mesh.uvs[0][i];
        const vec2 uv1 = mesh.uvs[1].empty() ? vec2(0) : mesh.uvs[1][i];
        const vec4 tangent = mesh.tangents.empty() ? vec4(0) : mesh.tangents[i];
        row[shared::kVertexNormalTexel] = vec4(vec3(transform.normal * dvec3(mesh.normals[i])), uv0.x);
        if (needs.texture_coordinates) row[shared::kVertexUvTexel] = vec4(uv0.y, uv1, tangent.w * transform.handedness);
        if (needs.normal_maps) row[shared::kVertexTangentTexel] = vec4(vec3(transform.tangent * dvec3(tangent)), 0);
        if (needs.vertex_colors) row[needs.vertex_stride() - 1] = mesh.colors.empty() ? vec4(1) : mesh.colors[i];
    }

    // --- Lights ---------------------------------------------------------------------------------------------------

    void add_lights() {
        LightTables lights = build_lights(scene_, trace_, choice_, sun_);
        SceneNeeds& needs = tables_.needs;
        static_cast<LightNeeds&>(needs) = lights.needs;
        tables_.lights = std::move(lights.rows);
        tables_.light_alias = std::move(lights.alias);
        tables_.light_tree = std::move(lights.tree);
        // Transmission of the scene counts here, not kept transmission: the flag changes which light is chosen.
        if (needs.light_tree) {
            shared::LightTreeHeader header = light_tree_header(tables_.light_tree);
            header.through = needs.transmission ? 1 : 0;
            set_light_tree_header(tables_.light_tree, header);
        }
        tables_.light_choice = lights.choice;
        tables_.light_of_triangle = std::move(lights.light_of_triangle);
        tables_.environment = std::move(lights.environment);
        tables_.environment_cells = std::move(lights.environment_cells);
    }

    /// Fills tables of lights that are kept but not in the scene: a light without radiance, no emissive triangles, a
    /// black environment.
    void fill_light_tables() {
        const SceneNeeds& needs = tables_.needs;
        if (needs.lights() && tables_.lights.empty()) {
            tables_.lights.assign(shared::kLightStride, vec4(0));
            tables_.lights[0].w = shared::float_of_word(shared::kLightTriangle);
            tables_.light_alias = {vec2(1, shared::float_of_word(0))};
        }
        std::vector<std::uint32_t>& of_triangle = tables_.light_of_triangle;
        if (needs.area_lights && of_triangle.empty()) of_triangle.assign(trace_.triangles.size(), shared::kNoLight);
        if (needs.area_lights && needs.instances) of_triangle.resize(trace_.triangles.size() + trace_.instances.size());
        if (needs.environment && tables_.environment_cells.empty()) tables_.environment_cells.assign(2, vec4(0));
    }

    const Scene& scene_;
    const TraceTables& trace_;
    const SceneNeeds& kept_;
    const LightChoice choice_;
    const SunChoice sun_;
    bool has_tangents_ = false;
    ShadingTables tables_;
    TexturePools pools_;
};

}  // namespace

ShadingTables build_shading_tables(const Scene& scene, const TraceTables& trace, const SceneNeeds& kept,
                                   LightChoice choice, SunChoice sun, const std::vector<PooledImage>* last) {
    return Builder(scene, trace, kept, choice, sun).build(last);
}

}  // namespace halflight
