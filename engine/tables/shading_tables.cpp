#include "engine/tables/shading_tables.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <future>
#include <mutex>
#include <optional>

#include "engine/scene/material_lobes.h"
#include "engine/scene/material_properties.h"
#include "engine/tables/albedo.h"
#include "engine/tables/shading_textures.h"
#include "engine/tables/table_rows.h"
#include "shaders/shared/light.h"
#include "shaders/shared/light_links.h"
#include "shaders/shared/texture_rows.h"
#include "shaders/shared/word.h"

namespace halflight {
namespace {

/// Returns the albedo table, which is equal for all scenes with equal parts.
Image albedo_table(AlbedoParts parts) {
    static std::mutex mutex;
    static std::array<std::optional<Image>, 8> tables;
    const std::lock_guard lock(mutex);
    std::optional<Image>& table = tables[(parts.sheen ? 1 : 0) + (parts.anisotropy ? 2 : 0) + (parts.solid ? 4 : 0)];
    if (!table) table = build_albedo_table(parts);
    return *table;
}

class Builder {
  public:
    Builder(const Scene& scene, const TraceTables& trace, const SceneNeeds& kept, LightChoice choice, SunChoice sun)
        : scene_(scene), trace_(trace), kept_(kept), choice_(choice), sun_(sun), pools_(scene, tables_) {}

    ShadingTables build(const std::vector<PooledImage>* last) {
        add_materials();
        SceneNeeds& needs = tables_.needs;
        tables_.texels_left_out = last && *last == tables_.pooled;
        if (!tables_.texels_left_out) pools_.fill();
        // The table takes about 15 ms, and more with sheen, anisotropy or solids (engine/tables/albedo.h). Nothing
        // below depends on it.
        std::future<Image> albedo;
        if (needs.glossy || kept_.glossy)
            albedo = std::async(std::launch::async, albedo_table,
                                AlbedoParts{.sheen = needs.sheen || kept_.sheen,
                                            .anisotropy = needs.anisotropy || kept_.anisotropy,
                                            .solid = needs.volume || kept_.volume});
        add_lights();
        needs = united(needs, kept_);
        fill_light_tables();
        add_vertices();
        if (albedo.valid()) tables_.albedo = albedo.get();
        return std::move(tables_);
    }

    SceneNeeds needs() {
        add_materials();
        add_lights();
        return united(tables_.needs, kept_);
    }

  private:
    // --- Materials ------------------------------------------------------------------------------------------------

    void add_materials() {
        std::vector<bool> used(scene_.materials.size(), false);
        std::vector<bool> tested(scene_.materials.size(), false);
        for (const uvec4& triangle : trace_.triangles) {
            used[triangle.w & kTriangleMaterialMask] = true;
            if (triangle.w & kTriangleAlpha) tested[triangle.w & kTriangleMaterialMask] = true;
        }
        if (trace_.absent) {  // most triangles have no rows here, and any of them may need the test
            used = trace_.absent->used_materials;
            for (std::size_t i = 0; i < used.size(); ++i)
                tested[i] = used[i] && trace_.alpha_tested && scene_.materials[i].alpha_mode != AlphaMode::opaque;
        }
        SceneNeeds& needs = tables_.needs;
        for (const BlockInstance& instance : trace_.instances) needs.instances |= !instance.identity;
        needs.alpha = trace_.alpha_tested;
        needs.slivers = trace_.slivers;
        needs.catchers = trace_.catchers;
        needs.one_sided = trace_.one_sided;
        needs.panes = trace_.panes;
        find_attributes();
        const auto rows = static_cast<std::size_t>(material_rows());
        tables_.materials.assign(scene_.materials.size() * rows, vec4(0));
        for (std::size_t i = 0; i < scene_.materials.size(); ++i) {
            if (!used[i]) continue;
            add_material(scene_.materials[i], tested[i], &tables_.materials[i * rows]);
            needs.solid_panes |= needs.panes && is_pane(scene_.materials[i]) && is_solid(scene_.materials[i]);
        }
        complete(static_cast<MaterialNeeds&>(needs));
    }

    void find_attributes() {
        if (trace_.absent)
            attributes_ = {trace_.absent->vertex_colors, trace_.absent->tangents};
        else
            for (const MeshRange& range : trace_.ranges) attributes_.add(scene_.meshes[range.mesh]);
        tables_.needs.vertex_colors = attributes_.colors;
    }

    /// Adds a material. alpha_tested: alpha decides hits on some of its triangles.
    void add_material(const Material& m, bool alpha_tested, vec4* rows) {
        SceneNeeds& needs = tables_.needs;
        for (const MaterialLobe& lobe : material_lobes()) needs.*lobe.need |= has_lobe(m, lobe, attributes_);
        for (const MaterialProperty& property : material_properties()) {
            const vec4 value = packed_value(m, property);
            for (int i = 0; property.packing.row != kNone && i < component_count(property.field); ++i)
                rows[property.packing.row][property.packing.component + i] = value[i];
        }
        for (const MaterialTexture& texture : material_textures()) {
            const TextureRef& ref = m.*texture.field;
            const bool used = looks_up(m, texture, attributes_);
            needs.*texture.need |= used;
            const std::uint32_t slot = !used ? shared::kNoTexture
                                       : texture.use == TextureUse::color
                                           ? pools_.color(ref, is_pinned(m, texture, alpha_tested))
                                           : pools_.data(ref, is_pinned(m, texture, alpha_tested));
            rows[texture.packing.row][texture.packing.component] = shared::float_of_word(slot);
        }
    }

    /// Returns whether kernels other than shaders/resolve.comp look the texture up.
    static bool is_pinned(const Material& m, const MaterialTexture& texture, bool alpha_tested) {
        return is_pane(m) || texture.field == &Material::emission_texture ||
               (texture.field == &Material::base_color_texture && alpha_tested);
    }

    // --- Vertices -------------------------------------------------------------------------------------------------

    void add_vertices() {
        if (trace_.absent) {
            tables_.vertices = trace_.absent->attributes;
            return;
        }
        const auto stride = static_cast<std::size_t>(tables_.needs.vertex_stride());
        tables_.vertices.assign(trace_.positions.size() * stride, vec4(0));
        for (const MeshRange& range : trace_.ranges) {
            const VertexTransform transform =
                range.merged ? VertexTransform(scene_.instances[range.instance].object_to_world) : VertexTransform();
            write_vertex_rows(scene_.meshes[range.mesh], transform, tables_.needs,
                              &tables_.vertices[range.first_vertex * stride]);
        }
    }

    // --- Lights ---------------------------------------------------------------------------------------------------

    void add_lights() {
        // Transmission of the scene counts here, not kept transmission: it changes which light is chosen.
        LightTables lights = build_lights(scene_, trace_, choice_, sun_,
                                          tables_.needs.transmission || tables_.needs.diffuse_transmission);
        SceneNeeds& needs = tables_.needs;
        static_cast<LightNeeds&>(needs) = lights.needs;
        needs.every_light = lights.choice == LightChoice::all;
        tables_.lights = std::move(lights.rows);
        tables_.light_alias = std::move(lights.alias);
        tables_.light_tree = std::move(lights.tree);
        tables_.light_choice = lights.choice;
        tables_.light_of_triangle = std::move(lights.light_of_triangle);
        tables_.light_groups = std::move(lights.groups);
        tables_.light_links = std::move(lights.links);
        tables_.environment = std::move(lights.environment);
        tables_.environment_warp = std::move(lights.environment_warp);
    }

    /// Fills tables of lights that are kept but not in the scene: a light without radiance, no emissive triangles, a
    /// black environment, links that leave nothing out.
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
        if (needs.light_links && tables_.light_links.empty()) {  // one set with all objects, which have one class
            const std::size_t objects = trace_.triangles.size() + trace_.instances.size();
            tables_.light_links.assign(3 + objects / shared::kClassesPerTexel, uvec4(0));
            tables_.light_links[0].x = 2;
            tables_.light_links[1] = uvec4(~0u);
            tables_.light_groups.resize(2 + tables_.lights.size() / shared::kLightStride);
        }
        if (needs.environment && tables_.environment_warp.empty()) tables_.environment_warp.assign(2, vec4(0));
    }

    const Scene& scene_;
    const TraceTables& trace_;
    const SceneNeeds& kept_;
    const LightChoice choice_;
    const SunChoice sun_;
    VertexAttributes attributes_;
    ShadingTables tables_;
    TexturePools pools_;
};

}  // namespace

ShadingTables build_shading_tables(const Scene& scene, const TraceTables& trace, const SceneNeeds& kept,
                                   LightChoice choice, SunChoice sun, const std::vector<PooledImage>* last) {
    return Builder(scene, trace, kept, choice, sun).build(last);
}

SceneNeeds shading_needs(const Scene& scene, const TraceTables& trace, LightChoice choice, SunChoice sun) {
    return Builder(scene, trace, {}, choice, sun).needs();
}

}  // namespace halflight
