// One interface to whoever finds hits: plain, by compute culling, by raster culling. Passes do not know which; the hits
// are the same, bit for bit.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "engine/gpu/buffer.h"
#include "engine/graph/graph.h"
#include "engine/rays/batch_server.h"
#include "engine/rays/batch_statistics.h"
#include "engine/rays/rays.h"
#include "engine/rays/tiles.h"
#include "engine/settings/visibility.h"

namespace halflight::rays {

/// A scene and how its batches are served. What it learns decides about time and nothing else, and it learns about each
/// place by itself: what is fast in one part of the picture need not be in another.
class Tracer {
  public:
    /// The scene outlives the tracer. Throws Error for Culling::raster, which is a server, and where tile settings are
    /// out of range.
    explicit Tracer(const TraceScene& scene, Culling culling = Culling::off, const TileSettings& tiles = {});
    /// All batches are left to a server, which outlives the tracer.
    Tracer(const TraceScene& scene, BatchServer& server);
    Tracer(const Tracer&) = delete;
    Tracer& operator=(const Tracer&) = delete;
    ~Tracer();

    const TraceScene& scene() const { return scene_; }
    const TileSettings& tile_settings() const { return tiles_; }
    /// Before any graph is made: there will be so many runs of each batch at most, place by place. Where `automatic`
    /// would try nothing in these, the plain tracer is all there is, and no buffer is made for anything else.
    void expect(std::uint64_t runs);
    /// Whether tiles come into question for such a batch.
    bool may_cull_by_tiles(const RayBatch& rays) const;
    /// Camera cut, scene edit, resize: what is known of the fastest way is forgotten, and what a server knows. The tile
    /// lists are carried buffers of the graph's History, which is invalidated there.
    void invalidate();
    /// All sums start from zero; what is known stays.
    void reset_statistics();
    /// Batches added to graphs from now on count rays and lists, in passes of their own that wait for the GPU; and
    /// those that have but one way to be served are timed as well.
    void count() { counts_ = true; }
    std::vector<BatchStatistics> statistics() const;
    /// Whether the last run of such a batch in its place was by tiles.
    bool ran_by_tiles(const RayBatch& rays) const;

  private:
    friend class BatchRun;
    class Batch;
    Batch& batch(const RayBatch& rays);

    const TraceScene& scene_;
    Culling culling_;
    BatchServer* server_ = nullptr;
    TileSettings tiles_;
    bool counts_ = false;
    bool short_ = false;  // no run will be one on trial
    std::map<BatchKey, std::unique_ptr<Batch>> batches_;
};

/// As closest_hit and any_hit of rays.h. The tracer outlives the graph's runs. Batches of one graph differ in kind or
/// depth. Throws Error, too, where the driver's storage blocks do not hold the tile lists.
graph::BufferHandle closest_hit(graph::Graph& graph, Tracer& tracer, const RayBatch& batch, graph::BufferHandle hits);
graph::BufferHandle any_hit(graph::Graph& graph, Tracer& tracer, const RayBatch& batch, graph::BufferHandle occluded);

/// The tile lists (shaders/shared/tile_list.h, tile_settings()) that runs of such a batch have left, in whatever graph
/// of the same History; as they are where ran_by_tiles(). None where none are carried.
graph::BufferHandle kept_lists(graph::Graph& graph, const Tracer& tracer, const RayBatch& batch);

}  // namespace halflight::rays
