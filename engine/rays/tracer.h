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
#include "engine/rays/rays.h"
#include "engine/rays/tiles.h"

namespace halflight::rays {

enum class Culling : std::uint8_t {
    automatic,  // whatever has been fastest for such a batch, plain included
    off,        // plain
    compute,    // tiles.h
    raster,     // raster.h
};
const char* name(Culling culling);

/// What is known of one batch of a frame: those of one kind and depth, run after run.
struct BatchStatistics {
    std::string batch;     // "shadow", "continuation 2", ...
    Way way = Way::plain;  // that of the next run
    std::string reason;    // why
    struct Measured {
        std::uint64_t runs = 0;
        std::uint64_t timed = 0;  // of these: all with Tracer::count(), else those on trial
        double seconds = 0;       // of the runs timed, sum
        double best = 0;          // and least of one
        std::uint64_t rays = 0;   // that were alive, over all runs; where counted
    };
    Measured measured[kWays];
    struct Seconds {
        double cull = 0;
        double search = 0;  // of the lists' leaves
        double rest = 0;    // of what is below their other entries
    };
    Seconds steps;                   // of runs by tiles
    std::uint64_t tiles = 0;         // that had culling to do, over all runs
    std::uint64_t tiles_culled = 0;  // of these, lists that were made; the others were kept
    /// Sums over runs by tiles; where counted.
    struct Lists {
        std::uint64_t tiles = 0;  // with a ray alive
        std::uint64_t entries = 0;
        std::uint64_t leaves = 0;      // of the entries
        std::uint64_t longest = 0;     // entries; the greatest of all runs
        std::uint64_t rays = 0;        // alive
        std::uint64_t rest_rays = 0;   // of these, that had not ended with the leaves of their tile
        std::uint64_t remembered = 0;  // any-hit rays that a leaf remembered from earlier runs has ended
    };
    Lists lists;
    std::size_t state_bytes = 0;  // carried from run to run, of all places
};

/// A scene and how its batches are served. What it learns decides about time and nothing else.
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
    Culling culling() const { return culling_; }  ///< off, where a server does everything
    const TileSettings& tile_settings() const { return tiles_; }
    /// Before any graph is made: there will be so many runs of each batch at most. Where `automatic` would try nothing
    /// in these, the plain tracer is all there is, and no buffer is made for anything else.
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
    /// Whether the last run of such a batch was by tiles.
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
    std::map<std::string, std::unique_ptr<Batch>> batches_;
};

/// As closest_hit and any_hit of rays.h. The tracer outlives the graph's runs. Batches of one graph differ in kind or
/// depth.
graph::BufferHandle closest_hit(graph::Graph& graph, Tracer& tracer, const RayBatch& batch, graph::BufferHandle hits);
graph::BufferHandle any_hit(graph::Graph& graph, Tracer& tracer, const RayBatch& batch, graph::BufferHandle occluded);

/// The tile lists (shaders/shared/tile_list.h, tile_settings()) that runs of such a batch have left, in whatever graph
/// of the same History; as they are where ran_by_tiles(). None where none are carried.
graph::BufferHandle kept_lists(graph::Graph& graph, const Tracer& tracer, const RayBatch& batch);

}  // namespace halflight::rays
