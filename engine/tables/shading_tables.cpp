#include "engine/tables/shading_tables.h"

#include <algorithm>
#include <cmath>
#include <future>

#include "engine/tables/albedo.h"
#include "engine/tables/light_tree.h"
#include "engine/tables/shading_textures.h"
#include "shaders/shared/light.h"
#include "shaders/shared/material.h"
#include "shaders/shared/texture.h"
#include "shaders/shared/vertex.h"
#include "shaders/shared/word.h"

namespace halflight {
namespace {

/// The same for all scenes.
Image albedo_table() {
    static const Image table = build_albedo_table();
    return table;
}

/// How an instance carries normals and tangents of a merged mesh to world space, by matrices scaled to a largest
/// coefficient of 1, so that neither overflows nor are the vertices of a mesh weighted differently.
struct Carrier {
    dmat3 normal{1};
    dmat3 tangent{1};
    float handedness = 1;  // sign of the determinant

    Carrier() = default;
    explicit Carrier(const dmat4& object_to_world) {
        const dmat3 m = scaled(dmat3(object_to_world));
        // The inverse transpose times the determinant; unlike it this exists for singular matrices, too.
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
        for (std::size_t i = 0; i < scene_.materials.size(); ++i) {
            tables_.materials.resize((i + 1) * shared::kMaterialStride, vec4(0));
            if (used[i]) add_material(scene_.materials[i], &tables_.materials[i * shared::kMaterialStride]);
        }
        tables_.texels_left_out = last && *last == tables_.pooled;
        if (!tables_.texels_left_out) pools_.fill();
        // Takes a while, and nothing else depends on it.
        std::future<Image> albedo;
        if (needs.glossy || kept_.glossy) albedo = std::async(std::launch::async, albedo_table);
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

    /// Bits of the descriptor's index; `need` is raised where there is one.
    float color_slot(const TextureRef& texture, bool matters, bool& need) {
        if (!texture || !matters) return shared::float_of_word(shared::kNoTexture);
        need = true;
        return shared::float_of_word(pools_.color(texture));
    }
    float data_slot(const TextureRef& texture, bool matters, bool& need) {
        if (!texture || !matters) return shared::float_of_word(shared::kNoTexture);
        need = true;
        return shared::float_of_word(pools_.data(texture));
    }

    void add_material(const Material& m, vec4* row) {
        SceneNeeds& needs = tables_.needs;
        const bool lit = !m.unlit;
        const bool dielectric = lit && (m.metallic < 1 || m.metallic_roughness_texture);
        const bool metal = lit && m.metallic > 0;
        const bool base = dielectric && vec3(m.base_color) != vec3(0);  // something under the dielectric's reflection
        const bool specular = dielectric && m.specular > 0;
        const bool coat = lit && m.clearcoat > 0;
        const bool transmission = base && m.transmission > 0;
        const bool emission = lit && m.emission != vec3(0);
        needs.unlit |= m.unlit;
        needs.emission |= emission || m.unlit;
        needs.diffuse |= base && (m.transmission < 1 || m.transmission_texture);
        needs.transmission |= transmission;
        needs.clearcoat |= coat;
        needs.glossy |= metal || specular || coat || transmission;
        needs.specular_color |= specular && (m.specular_color != vec3(1) || m.specular_color_texture);

        const float r0 = (m.ior - 1) / (m.ior + 1);
        const float cutoff = m.alpha_mode == AlphaMode::blend  ? shared::kAlphaBlend
                             : m.alpha_mode == AlphaMode::mask ? m.alpha_cutoff
                                                               : 0.0f;
        row[0] = m.base_color;
        row[1] = vec4(lit ? m.emission : vec3(0), m.unlit ? 1 : 0);
        row[2] = vec4(m.metallic, m.roughness, m.specular, r0 * r0);
        row[3] = vec4(m.specular_color, m.transmission);
        row[4] = vec4(m.clearcoat, m.clearcoat_roughness, m.normal_scale, m.clearcoat_normal_scale);
        row[5].x = cutoff;
        row[5].y = color_slot(m.base_color_texture, true, needs.base_color_texture);
        row[5].z = data_slot(m.metallic_roughness_texture, lit, needs.metallic_roughness_texture);
        row[5].w = data_slot(m.normal_texture, lit && has_tangents_, needs.normal_texture);
        row[6].x = color_slot(m.emission_texture, emission, needs.emission_texture);
        row[6].y = data_slot(m.specular_texture, specular, needs.specular_texture);
        row[6].z = color_slot(m.specular_color_texture, specular, needs.specular_color_texture);
        row[6].w = data_slot(m.transmission_texture, transmission, needs.transmission_texture);
        row[7].x = data_slot(m.clearcoat_texture, coat, needs.clearcoat_texture);
        row[7].y = data_slot(m.clearcoat_roughness_texture, coat, needs.clearcoat_roughness_texture);
        row[7].z = data_slot(m.clearcoat_normal_texture, coat && has_tangents_, needs.clearcoat_normal_texture);
    }

    // --- Vertices -------------------------------------------------------------------------------------------------

    void add_vertices() {
        const auto stride = static_cast<std::size_t>(tables_.needs.vertex_stride());
        tables_.vertices.assign(trace_.positions.size() * stride, vec4(0));
        for (const MeshRange& range : trace_.ranges) {
            const Carrier carrier =
                range.merged ? Carrier(scene_.instances[range.instance].object_to_world) : Carrier();
            for (std::uint32_t i = 0; i < range.vertex_count; ++i) {
                add_vertex(scene_.meshes[range.mesh], i, carrier, &tables_.vertices[(range.first_vertex + i) * stride]);
            }
        }
    }

    void add_vertex(const Mesh& mesh, std::uint32_t i, const Carrier& carrier, vec4* row) const {
        const SceneNeeds& needs = tables_.needs;
        const vec2 uv0 = mesh.uvs[0].empty() ? vec2(0) : mesh.uvs[0][i];
        const vec2 uv1 = mesh.uvs[1].empty() ? vec2(0) : mesh.uvs[1][i];
        const vec4 tangent = mesh.tangents.empty() ? vec4(0) : mesh.tangents[i];
        row[shared::kVertexNormalTexel] = vec4(vec3(carrier.normal * dvec3(mesh.normals[i])), uv0.x);
        if (needs.texture_coordinates) row[shared::kVertexUvTexel] = vec4(uv0.y, uv1, tangent.w * carrier.handedness);
        if (needs.normal_maps) row[shared::kVertexTangentTexel] = vec4(vec3(carrier.tangent * dvec3(tangent)), 0);
        if (needs.vertex_colors) row[needs.vertex_stride() - 1] = mesh.colors.empty() ? vec4(1) : mesh.colors[i];
    }

    // --- Lights ---------------------------------------------------------------------------------------------------

    void add_lights() {
        LightTables lights = build_lights(scene_, trace_, choice_, sun_);
        SceneNeeds& needs = tables_.needs;
        needs.area_lights = lights.triangle_count > 0;
        needs.punctual_lights = lights.punctual_count > 0;
        needs.environment = !lights.environment.pixels.empty();
        needs.environment_map = needs.environment && !scene_.environment.map.pixels.empty();
        needs.light_choice = lights.probabilities.size() > 1;
        needs.light_tree = !lights.tree.empty();
        needs.sun = lights.sun;
        for (std::size_t i = 0; i < lights.punctual_count; ++i) {
            const vec4& head = lights.rows[(lights.triangle_count + i) * shared::kLightStride];
            needs.spot_lights |= shared::light_kind(shared::word_of_float(head.w)) == shared::kLightSpot;
            needs.directional_lights |= shared::light_kind(shared::word_of_float(head.w)) == shared::kLightDirectional;
        }
        tables_.lights = std::move(lights.rows);
        tables_.light_alias = std::move(lights.alias);
        tables_.light_tree = std::move(lights.tree);
        // Of the scene, not of what is kept: it decides which light is picked.
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

    /// Where shaders are to look at lights that are not there: one that lights nothing, triangles that are none, a
    /// black sky.
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
