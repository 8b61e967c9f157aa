// The raster back end of CHC+RT (Mattausch, Bittner, Jaspe, Gobbetti, Wimmer, Pajarola 2015, CHC+RT: Coherent
// Hierarchical Culling for Ray Tracing, Computer Graphics Forum 34(2)): the CPU walks the object hierarchy front to
// back, occlusion queries over rasterized tiles of rays tell which of its nodes rays can meet, and fragment kernels
// trace those.
//
// A tile is 64 consecutive entries of a batch. A query draws the tiles, in blocks, against the boxes of nodes; the
// vertex kernel drops blocks, the depth test what has ended, the fragment kernel tiles whose shaft misses. Visible
// leaves are traced several at a time: one more such draw cuts them, tile by tile, into a list of what the tile's rays
// can meet, and tiles whose list is not empty are drawn at one texel per ray. Draws are separated by barriers and a ray
// has one fragment in each, so the kernel itself keeps the nearest hit and breaks ties exactly as the plain tracer
// does; depth, which cannot hold all t >= 0 exactly, only rejects. Tiles whose rays go all ways are traced from the
// root at once.
//
// It wins where much is hidden and rays of a tile stay together: camera rays into a city. It loses where they meet
// much: every draw pays for reading rays and setting them up again, a list tells every ray of a tile what one of them
// may meet, and what is near for one tile is not for the next, while the walk has one order for all. Software drivers
// also run vertices and the binning of points on one thread, and nothing of a query overlaps with tracing there.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "engine/rays/batch_server.h"
#include "engine/rays/raster_walk.h"
#include "engine/rays/rays.h"

namespace halflight::rays {

struct RasterSettings {
    CutSizes cut;
    bool believe_queries = true;  // false: every answer is "visible", as from a driver that overcounts
    bool measure = false;         // fill in RasterStatistics::pairs and ::stages; waits for every draw
};

/// What the raster back end knows of a scene, and what it remembers of batches from run to run. Its hits are the plain
/// tracer's, bit for bit. (A search that the driver would have cut short may come to its end here, being divided.
/// Numbers below 2^-126 count as 0 in llvmpipe's fragment kernels, and not in its compute kernels: results differ where
/// directions have such components.) add() throws Error where the driver's points or targets are too small for the
/// batch.
class RasterCulling final : public BatchServer {
  public:
    /// packed: what the TraceScene was made of. Needs a current context.
    explicit RasterCulling(const PackedScene& packed, const RasterSettings& settings = {});
    /// The same of a tree that is there already; settings.cut is not read.
    explicit RasterCulling(CullTree tree, const RasterSettings& settings = {});
    ~RasterCulling() override;

    /// Another pose of the scene. What is remembered stays, for as many nodes as there were.
    void set_tree(CullTree tree);

    const RasterSettings& settings() const;
    const CullTree& tree() const;
    Way way() const override { return Way::raster; }
    graph::BufferHandle add(graph::Graph& graph, const TraceScene& scene, const RayBatch& batch,
                            graph::BufferHandle results, bool any_hit) override;
    /// May be overwritten with anything.
    CullState& state(const BatchKey& key);
    void invalidate() override;
    /// Of tree and states, on both sides.
    std::size_t bytes() const;
    std::size_t state_bytes(const RayBatch&) const override;
    /// Sums since construction, or since they were last reset, over all places.
    RasterStatistics& statistics(RayKind kind, std::uint32_t depth);
    void reset_statistics() override;
    std::vector<RasterBatch> batches() const;

  private:
    friend class RasterRun;
    struct Parts;
    std::unique_ptr<Parts> parts_;
};

}  // namespace halflight::rays
