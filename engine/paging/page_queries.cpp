#include "engine/paging/page_queries.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <functional>

#include "engine/rays/bvh.h"
#include "engine/rays/packed_bvh.h"
#include "shaders/shared/bvh_nodes.h"
#include "shaders/shared/tile_list.h"

namespace halflight::paging {
namespace {

constexpr rays::TileSettings kTiles;

constexpr std::uint32_t kAllSlots = 15;

}  // namespace

PageQueries::PageQueries(const PageIndex& index, Method method) : index_(index), top_(hierarchy_over(index)) {
    TraceTables tables;
    tables.instances.push_back({.identity = true});
    const rays::PackedScene packed = rays::pack_boxes(top_, index.bounds);
    scene_.emplace(tables, packed, gpu::Defines());
    if (method == Method::raster) raster_.emplace(rays::build_cull_tree(packed, {.leaf_triangles = 2}));
}

bool PageQueries::serves(rays::RayKind kind) {
    switch (kind) {
        case rays::RayKind::primary:
        case rays::RayKind::shadow:
        case rays::RayKind::sun:
        case rays::RayKind::occlusion:
        case rays::RayKind::connection:
            return true;
        default:
            return false;
    }
}

PageQueries::Targets PageQueries::declare(graph::Graph& graph, graph::Pass& pass, const rays::RayBatch& batch,
                                          graph::BufferHandle results) const {
    Targets targets;
    if (raster_) {
        targets.targets = rays::RasterCulling::declare(graph, pass, batch, results);
    } else {
        const std::size_t bytes = rays::tile_list_bytes(*scene_, batch, kTiles);
        targets.lists = pass.write(graph.create_buffer("lists of page queries", {bytes}), graph::Access::storage_write);
    }
    return targets;
}

std::vector<std::uint32_t> PageQueries::pages(graph::Resources& resources, const rays::RayBatch& batch,
                                              const Targets& targets, bool any_hit, const gpu::Buffer* ends) {
    if (!raster_) return pages_of_most_tiles(resources, batch, targets.lists, ends);
    std::vector<bool> found(index_.pages.size(), false);
    std::vector<std::uint32_t> pages;
    for (const std::uint32_t leaf :
         raster_->visible_leaves(resources, *scene_, batch, targets.targets, any_hit, ends)) {
        const rays::CullNode& node = raster_->tree().nodes[leaf];
        add_pages(node.node - 1, node.slots, found, pages);  // the head comes before the first node
    }
    return pages;
}

/// Adds the pages below some children of a node that have not been found before.
void PageQueries::add_pages(std::uint32_t node, std::uint32_t slots, std::vector<bool>& found,
                            std::vector<std::uint32_t>& pages) const {
    for (std::uint32_t slot = 0; slot < 4; ++slot) {
        const rays::BvhChild& child = top_.nodes[node].children[slot];
        if ((slots >> slot & 1u) == 0 || child.bounds.empty()) continue;
        if (!child.leaf()) {
            add_pages(child.first, kAllSlots, found, pages);
            continue;
        }
        const std::uint32_t page = index_.roots[top_.primitives[child.first]].page;
        if (!found[page]) pages.push_back(page);
        found[page] = true;
    }
}

std::vector<std::uint32_t> PageQueries::pages_of_most_tiles(graph::Resources& resources, const rays::RayBatch& batch,
                                                            graph::BufferHandle lists, const gpu::Buffer* ends) const {
    rays::TileBuffers tiles;
    tiles.settings = kTiles;
    tiles.lists = lists;
    tiles.ends = ends;
    tiles.finest = true;
    resources.buffer(lists).clear();  // tiles without rays keep an empty list
    rays::cull_tiles(resources, *scene_, batch, tiles, false, culled_);
    glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);

    const std::vector<uvec4> texels = resources.buffer(lists).read<uvec4>();
    const std::size_t record = shared::kTileHeaderTexels + kTiles.capacity * std::size_t{shared::kTileBoxTexels};
    std::vector<std::uint32_t> tiles_of_page(index_.pages.size(), 0);
    for (std::size_t tile = 0; tile + record <= texels.size(); tile += record) {
        const std::uint32_t leaves = std::min(texels[tile + 1].w & 0xffffu, kTiles.capacity);
        for (std::uint32_t i = 0; i < leaves; ++i) {
            const std::uint32_t place = texels[tile + shared::kTileHeaderTexels + i].w & shared::kBvhIndexMask;
            ++tiles_of_page[index_.roots[top_.primitives[place]].page];
        }
    }
    std::vector<std::uint32_t> pages;
    for (std::uint32_t page = 0; page < tiles_of_page.size(); ++page)
        if (tiles_of_page[page] > 0) pages.push_back(page);
    std::ranges::stable_sort(pages, std::ranges::greater(), [&](std::uint32_t page) { return tiles_of_page[page]; });
    return pages;
}

}  // namespace halflight::paging
