// Queries of tiles of rays against the hierarchy over the roots of all pages, by compute culling (engine/rays/tiles.h)
// or raster culling (engine/rays/raster.h). They decide which pages a batch can need before it is traced, like CHC+RT's
// scheduling of visible leaves (Mattausch, Bittner, Jaspe, Gobbetti, Wimmer, Pajarola 2015, CHC+RT: Coherent
// Hierarchical Culling for Ray Tracing, Computer Graphics Forum 34(2)).
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "engine/gpu/buffer.h"
#include "engine/graph/execute.h"
#include "engine/paging/pages.h"
#include "engine/rays/raster.h"
#include "engine/rays/tiles.h"

namespace halflight::paging {

class PageQueries {
  public:
    enum class Method : std::uint8_t { compute, raster };
    /// Builds the hierarchy over the roots. The index outlives the object.
    PageQueries(const PageIndex& index, Method method);

    /// Returns whether the rays of a tile are so coherent that queries can tell pages apart.
    static bool serves(rays::RayKind kind);
    /// Resources of a batch's queries.
    struct Targets {
        graph::BufferHandle lists;    // for Method::compute
        rays::RasterTargets targets;  // for Method::raster
        explicit operator bool() const { return lists || targets.results; }
    };
    /// Declares resources in the pass that traces the batch and has declared its results.
    Targets declare(graph::Graph& graph, graph::Pass& pass, const rays::RayBatch& batch,
                    graph::BufferHandle results) const;
    /// Returns the pages that rays can meet before their ends, and leaves the results undefined. Compute culling puts
    /// the pages of most tiles first, and a tile names the pages that it meets first, as far as its list has room.
    /// Raster culling goes front to back. `ends` has a float per ray beyond which pages do not count; null: its t_max.
    std::vector<std::uint32_t> pages(graph::Resources& resources, const rays::RayBatch& batch, const Targets& targets,
                                     bool any_hit, const gpu::Buffer* ends);
    /// Forgets what earlier queries have found.
    void forget() {
        if (raster_) raster_->invalidate();
    }

  private:
    std::vector<std::uint32_t> pages_of_most_tiles(graph::Resources& resources, const rays::RayBatch& batch,
                                                   graph::BufferHandle lists, const gpu::Buffer* ends) const;
    void add_pages(std::uint32_t node, std::uint32_t slots, std::vector<bool>& found,
                   std::vector<std::uint32_t>& pages) const;

    const PageIndex& index_;
    rays::Bvh top_;
    std::optional<rays::TraceScene> scene_;      // nodes of the hierarchy; no triangles
    std::optional<rays::RasterCulling> raster_;  // for Method::raster
    gpu::Buffer culled_{"tiles that queried pages", sizeof(std::uint32_t)};
};

}  // namespace halflight::paging
