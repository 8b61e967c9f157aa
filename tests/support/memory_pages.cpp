#include "tests/support/memory_pages.h"

#include <algorithm>

#include "engine/rays/hierarchies.h"
#include "shaders/shared/bvh.h"

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
    index_.ranges = tables.ranges;
    index_.stack_entries = 1;
    if (tables.triangles.empty()) return;
    for (const rays::Part& part : rays::cut(tables, rays::parts_of(tables).front(), bucket)) {
        const std::vector<std::uint32_t> ids = rays::triangles_of(part);
        std::vector<rays::Corners> corners;
        for (const std::uint32_t id : ids) {
            const uvec4& t = tables.triangles[id];
            corners.push_back({tables.positions[t.x], tables.positions[t.y], tables.positions[t.z]});
        }
        paging::PageSet set = paging::build_pages(corners, ids, {}, limits);
        for (paging::PageRoot root : set.roots) {
            root.page += static_cast<std::uint32_t>(pages_.size());
            index_.roots.push_back(root);
        }
        for (paging::Page& page : set.pages) {
            index_.pages.push_back({static_cast<std::uint32_t>(page.nodes.size() / shared::kBvhPageTexels),
                                    static_cast<std::uint32_t>(page.pairs.size() / shared::kBvhPairTexels)});
            pages_.push_back(std::move(page));
        }
        index_.stack_entries = std::max(index_.stack_entries, set.stack_entries);
    }
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
