#include "tests/support/memory_pages.h"

#include <algorithm>
#include <memory>

#include "engine/rays/hierarchies.h"
#include "engine/scene/material_lobes.h"
#include "engine/tables/shading_tables.h"
#include "engine/tables/table_rows.h"

namespace halflight::test {

MemoryPages::MemoryPages(const TraceTables& tables, std::size_t bucket, const paging::PageLimits& limits,
                         std::span<const vec4> attributes)
    : triangles_(tables.triangles), positions_(tables.positions), attributes_(attributes.begin(), attributes.end()) {
    index_.limits = limits;
    index_.origin = tables.origin;
    index_.bounds = tables.bounds;
    index_.triangles = static_cast<std::uint32_t>(tables.triangles.size());
    index_.vertices = tables.positions.size();
    index_.vertex_texels =
        static_cast<std::uint32_t>(attributes.size() / std::max<std::size_t>(tables.positions.size(), 1));
    index_.slivers = tables.slivers;
    index_.alpha = tables.alpha_tested;
    index_.one_sided = tables.one_sided;
    index_.panes = tables.panes;
    index_.ranges = tables.ranges;
    index_.stack_entries = 1;
    if (tables.triangles.empty()) return;
    for (const rays::Part& part : rays::cut(tables, rays::parts_of(tables).front(), bucket)) {
        const std::vector<std::uint32_t> ids = rays::triangles_of(part);
        std::vector<rays::Corners> corners;
        std::vector<std::uint32_t> words;
        for (const std::uint32_t id : ids) {
            const uvec4& t = tables.triangles[id];
            words.push_back(t.w);
            corners.push_back({tables.positions[t.x], tables.positions[t.y], tables.positions[t.z]});
        }
        paging::PageSet set = paging::build_pages(corners, ids, words, limits);
        paging::append_above(index_.above, set);
        for (paging::PageRoot root : set.roots) {
            root.page += static_cast<std::uint32_t>(pages_.size());
            index_.roots.push_back(root);
        }
        for (paging::Page& page : set.pages) {
            index_.pages.push_back(paging::size_of(page));
            pages_.push_back(std::move(page));
        }
        index_.stack_entries = std::max(index_.stack_entries, set.stack_entries);
    }
}

MemoryPages::MemoryPages(const Scene& scene, std::size_t bucket, const paging::PageLimits& limits)
    : MemoryPages(scene, build_trace_tables(scene, ~std::size_t{0}), bucket, limits) {}

MemoryPages::MemoryPages(const Scene& scene, const TraceTables& tables, std::size_t bucket,
                         const paging::PageLimits& limits)
    : MemoryPages(tables, bucket, limits, build_shading_tables(scene, tables).vertices) {
    index_.vertex_texels = std::max(index_.vertex_texels, 1u);
    AbsentGeometry& geometry = index_.geometry;
    geometry.used_materials.assign(scene.materials.size(), false);
    for (std::uint32_t i = 0; i < tables.triangles.size(); ++i) {
        const std::uint32_t index = tables.triangles[i].w & kTriangleMaterialMask;
        geometry.used_materials[index] = true;
        const Material& material = scene.materials[index];
        if ((!material.unlit && has_emission(material)) || is_pane(material)) geometry.resident.push_back(i);
    }
    VertexAttributes attributes;
    for (const MeshRange& range : tables.ranges) attributes.add(scene.meshes[range.mesh]);
    geometry.vertex_colors = attributes.colors;
    geometry.tangents = attributes.tangents;
}

void MemoryPages::read_rows(std::span<const std::uint32_t> triangles, paging::TriangleRows& rows) const {
    rows = {};
    for (const std::uint32_t triangle : triangles) {
        const uvec4& t = triangles_[triangle];
        rows.triangles.push_back(t);
        for (int corner = 0; corner < 3; ++corner) {
            rows.positions.push_back(positions_[t[corner]]);
            for (std::uint32_t texel = 0; texel < index_.vertex_texels; ++texel)
                rows.attributes.push_back(attributes_[std::size_t{t[corner]} * index_.vertex_texels + texel]);
        }
    }
}

}  // namespace halflight::test
