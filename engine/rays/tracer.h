// One interface to all tracing methods: plain, culling by compute, raster culling. Passes do not know the method; hits
// are equal bit for bit.
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
#include "engine/rays/culling.h"
#include "engine/rays/rays.h"
#include "engine/rays/tiles.h"

namespace halflight::rays {

class NativeServer;

/// A scene and the methods that serve its batches. State affects time only. It is kept per place, because the fastest
/// method may differ between parts of the picture.
class Tracer {
  public:
    /// Serves batches of the scene, which must outlive the tracer. Throws Error for methods that are servers
    /// (culling.h), and for tile settings out of range.
    explicit Tracer(const TraceScene& scene, Culling culling = Culling::off, const TileSettings& tiles = {});
    /// Leaves all batches to a server, which must outlive the tracer.
    Tracer(const TraceScene& scene, BatchServer& server);
    Tracer(const Tracer&) = delete;
    Tracer& operator=(const Tracer&) = delete;
    ~Tracer();

    const TraceScene& scene() const { return scene_; }
    const TileSettings& tile_settings() const { return tiles_; }
    /// Lets `automatic` choose a server of TraceMethod::native, too. The server must outlive the tracer. Call it before
    /// graphs are made.
    void offer(NativeServer& native) { native_ = &native; }
    /// Number of runs before the first trial of tiles if native tracing is offered. A trial, which compiles kernels
    /// and makes lists, takes as long as 20 to 60 runs of native tracing, and tiles seldom win.
    static constexpr std::uint64_t kFirstNativeRuns = 64;
    /// Announces the maximum number of runs of each batch per place; call it before graphs are made. If `automatic`
    /// would have no trial in these runs, only the plain tracer is used, and no buffers are made for other methods.
    void expect(std::uint64_t runs);
    /// Returns whether tiles are an option for such a batch.
    bool may_cull_by_tiles(const RayBatch& rays) const;
    /// Forgets the state of method selection and of the server, after a camera cut, scene edit or resize. The tile
    /// lists are carried buffers of the graph's History and must be invalidated with it.
    void invalidate();
    /// Sets all sums to zero; keeps the state.
    void reset_statistics();
    /// Makes batches added to graphs from now on count rays and lists, in passes of their own that wait for the GPU.
    /// Batches with a single method are timed, too.
    void count() { counts_ = true; }
    std::vector<BatchStatistics> statistics() const;
    /// Returns a line about native tracing that had to be switched off; empty if there was no need.
    std::string note() const;
    /// Returns whether the last run of such a batch in its place was by tiles.
    bool ran_by_tiles(const RayBatch& rays) const;

  private:
    friend class BatchRun;
    class Batch;
    Batch& batch(const RayBatch& rays);
    /// Returns the native server that serves batches, or may serve them; null: none.
    const NativeServer* native() const;
    std::uint64_t first_runs() const;  ///< Returns the number of runs before the first trial of tiles.

    const TraceScene& scene_;
    Culling culling_;
    BatchServer* server_ = nullptr;
    NativeServer* native_ = nullptr;  // candidate of `automatic`; null: none
    TileSettings tiles_;
    bool counts_ = false;
    bool short_ = false;  // true: the runs are too few for a trial
    std::map<BatchKey, std::unique_ptr<Batch>> batches_;
};

/// Adds the passes of closest_hit() and any_hit() of rays.h. The tracer must outlive the graph's runs. Batches of a
/// graph must differ in kind or depth. Runs also throw Error if the driver's storage blocks are too small for the tile
/// lists.
graph::BufferHandle closest_hit(graph::Graph& graph, Tracer& tracer, const RayBatch& batch, graph::BufferHandle hits);
graph::BufferHandle any_hit(graph::Graph& graph, Tracer& tracer, const RayBatch& batch, graph::BufferHandle occluded);

/// Returns the tile lists (shaders/shared/tile_list.h, tile_settings()) left by runs of such a batch in any graph of
/// the same History. They are up to date if ran_by_tiles(). Returns an empty handle if no lists are carried.
graph::BufferHandle kept_lists(graph::Graph& graph, const Tracer& tracer, const RayBatch& batch);

}  // namespace halflight::rays
