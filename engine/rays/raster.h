// Raster culling, a back end of CHC+RT (Mattausch, Bittner, Jaspe, Gobbetti, Wimmer, Pajarola 2015, CHC+RT: Coherent
// Hierarchical Culling for Ray Tracing, Computer Graphics Forum 34(2)). The CPU traverses the object hierarchy front to
// back. Occlusion queries over rasterized tiles of rays determine the nodes that rays can meet, and fragment kernels
// trace those nodes.
//
// A tile is 64 consecutive rays of a batch. A query draws the tiles, in blocks, against the boxes of nodes. The vertex
// kernel drops blocks, the depth test drops tiles whose rays have ended, and the fragment kernel drops tiles whose
// shaft misses. Visible leaves are traced several at a time. One more such draw writes, per tile, a list of the leaves
// that its rays can meet; then tiles with entries are drawn at one texel per ray. Draws are separated by barriers, and
// a ray has one fragment in each. Therefore the kernel itself keeps the nearest hit and breaks ties exactly like the
// plain tracer. Depth only rejects, because it cannot represent all t >= 0 exactly. Tiles of incoherent rays are traced
// from the root at once.
//
// This method wins where much is hidden and the rays of a tile are coherent: camera rays into a city. It loses where
// rays meet many leaves. Every draw pays for reading and setting up the rays again, and a list holds the leaves of all
// rays of a tile. The traversal has one order for all tiles, although each tile has its own front. Software drivers run
// vertices and the binning of points on one thread, and there queries do not overlap with tracing.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "engine/graph/execute.h"
#include "engine/rays/batch_server.h"
#include "engine/rays/raster_walk.h"
#include "engine/rays/rays.h"

namespace halflight::rays {

struct RasterSettings {
    CutSizes cut;
    bool believe_queries = true;  // false: every answer is "visible", like from a driver that overcounts
    bool measure = false;         // true: fills in RasterStatistics::pairs and ::stages, and waits for every draw
};

/// Resources of one batch's pass.
struct RasterTargets {
    graph::BufferHandle results;
    graph::BufferHandle shafts;  // vec4[4] per tile, then per block
    graph::BufferHandle alive;   // uvec2 per tile: a bit per ray
    graph::TextureHandle depth;  // reach of rays, one texel per tile
    graph::TextureHandle sizes;  // one texel per tile: size of its list
    graph::BufferHandle lists;   // kRasterList entries per tile
};

/// Server of batches by raster culling. It owns the culling tree of a scene, and the visibility state of batches. add()
/// throws Error if the driver's points or targets are too small for the batch.
///
/// Its hits equal those of the plain tracer bit for bit, with two exceptions:
/// - A search that the driver would cut short may end here, because it is divided.
/// - Numbers below 2^-126 count as 0 in llvmpipe's fragment kernels, but not in its compute kernels. Results differ
///   if directions have such components.
class RasterCulling final : public BatchServer {
  public:
    /// Builds the culling tree of `packed`, from which the TraceScene must be made, too. Needs a current context.
    explicit RasterCulling(const PackedScene& packed, const RasterSettings& settings = {});
    /// Takes an existing tree; settings.cut is ignored.
    explicit RasterCulling(CullTree tree, const RasterSettings& settings = {});
    ~RasterCulling() override;

    /// Sets the tree of another pose. The visibility state is kept if the number of nodes is the same.
    void set_tree(CullTree tree);
    void follow(const ServedScene& scene) override { set_tree(scene.cull_tree); }

    const RasterSettings& settings() const;
    const CullTree& tree() const;
    TraceMethod method() const override { return TraceMethod::raster; }
    graph::BufferHandle add(graph::Graph& graph, const TraceScene& scene, const RayBatch& batch,
                            graph::BufferHandle results, bool any_hit) override;
    /// Declares the resources of a batch in its pass. `results` are declared by the caller. Throws Error like add().
    static RasterTargets declare(graph::Graph& graph, graph::Pass& pass, const RayBatch& batch,
                                 graph::BufferHandle results);
    /// Returns the leaves of the tree that rays can meet, about front to back, without tracing any; results become
    /// misses. `ends` has a float per ray beyond which nodes do not count; null: its t_max.
    std::vector<std::uint32_t> visible_leaves(graph::Resources& resources, const TraceScene& scene,
                                              const RayBatch& batch, const RasterTargets& targets, bool any_hit,
                                              const gpu::Buffer* ends);
    /// Returns the visibility state of a batch, which may be overwritten with any bits.
    CullState& state(const BatchKey& key);
    void invalidate() override;
    /// Returns the bytes of tree and states, on CPU and GPU.
    std::size_t bytes() const;
    std::size_t state_bytes(const RayBatch&) const override;
    /// Returns sums over all places since construction or reset_statistics().
    RasterStatistics& statistics(RayKind kind, std::uint32_t depth);
    void reset_statistics() override;
    std::vector<RasterBatch> batches() const;

  private:
    friend class RasterRun;
    struct Parts;
    std::unique_ptr<Parts> parts_;
};

/// Makes the server of Culling::raster. Throws Error if the scene was prepared without a tree.
std::unique_ptr<BatchServer> make_raster_server(const ServedScene& scene);

}  // namespace halflight::rays
