// Ray batches, and the plain tracer. Passes fill a batch and request hits; they do not know which tracer serves it.
#pragma once

#include <compare>
#include <cstdint>

#include "engine/gpu/buffer.h"
#include "engine/gpu/shader_source.h"
#include "engine/graph/graph.h"
#include "engine/rays/kinds.h"
#include "engine/rays/packed_bvh.h"
#include "engine/tables/tables.h"

namespace halflight::rays {

/// A batch of rays. Rays and hits are stored at their path's index (structs Ray and Hit of shaders/shared/rays.h),
/// `capacity` of each. `paths` and `rays_of_path` define the index where paths have several rays. With `list`, only the
/// rays of its first `count` path indices are traced. They are in tile order: 64 consecutive entries are one 8x8 tile,
/// or the remains of several. Without it all rays are traced. A ray with t_max < t_min is dead: it is not traced and
/// reports a miss.
struct RayBatch {
    RayKind kind = RayKind::primary;
    // Number of reflections before the rays; for camera rays, number of the batch. Kind and depth identify a batch in a
    // graph.
    std::uint32_t depth = 0;
    std::uint32_t place = 0;     // part of the picture; tracers keep separate state and statistics for each
    std::uint32_t capacity = 0;  // rays; a multiple of 256
    // > 0: ray i belongs to path i modulo this number; the rays of all paths alternate. 0: the rays of a path are
    // consecutive, `rays_of_path` of them: a power of two, at most 16, and 1 with a list.
    std::uint32_t paths = 0;
    std::uint32_t rays_of_path = 1;
    graph::BufferHandle rays;         // capacity x Ray
    graph::BufferHandle list;         // optional: capacity x uint
    graph::BufferHandle list_header;  // with a list: ListHeader of shaders/shared/rays.h
    // Keys of the alpha test of blended surfaces, read only if TraceTables::alpha_tested. The uniform block of struct
    // Frame (shaders/shared/frame.h) has seed and sample_index, which change from run to run, and the band, which gives
    // the pixel of a path. The salt distinguishes the batches of a run. shaders/lib/alpha_key.glsl computes the key.
    graph::BufferHandle frame_constants;
    std::uint32_t alpha_salt = 0;
};

/// Identifies similar batches of all runs; what one of them has learned serves the next.
struct BatchKey {
    RayKind kind = RayKind::primary;
    std::uint32_t depth = 0;
    std::uint32_t place = 0;
    auto operator<=>(const BatchKey&) const = default;
};
inline BatchKey key_of(const RayBatch& batch) {
    return {batch.kind, batch.depth, batch.place};
}

struct TraceStatistics {
    std::size_t triangles = 0;
    std::size_t instances = 0;
    std::size_t nodes = 0;  // four-wide nodes of all hierarchies
    NodeFormat node_format = NodeFormat::grid;
    bool two_level = false;
    std::uint32_t stack_entries = 0;  // stack size of the deepest possible traversal, which the kernels use
    std::size_t bytes = 0;            // in device memory
    double build_seconds = 0;
};

/// Hierarchies and triangles of one scene on the GPU.
class TraceScene {
  public:
    /// Builds one BVH4 per block with Embree's builder and, unless all triangles are in world space, one over the
    /// instances. `shading` is SceneBuffers::defines(), which is needed if tables.alpha_tested: kernels then read
    /// coverage (shaders/lib/alpha.glsl). The scene's texture units must then be bound whenever such a graph runs.
    /// Throws Error where a table exceeds what the driver can address.
    explicit TraceScene(const TraceTables& tables, const gpu::Defines& shading = {});
    /// `packed` is the result of pack_scene() for the tables.
    TraceScene(const TraceTables& tables, const PackedScene& packed, const gpu::Defines& shading);

    /// Updates the scene to another pose. `last` is the packed scene of the current pose, so that only differences are
    /// written, or null. Throws Error like the constructor; after a failed update the object may only be destroyed.
    void update(const TraceTables& tables, const PackedScene& packed, const gpu::Defines& shading,
                const PackedScene* last);

    /// Sets other shading defines, which change defines().
    void set_shading(const gpu::Defines& shading);

    /// Binds UNIT_NODES, UNIT_TRIANGLE_VERTICES and UNIT_INSTANCES.
    void bind() const;
    /// Returns the defines for shaders/trace_scene.glsl and shaders/lib/traverse.glsl.
    const gpu::Defines& defines() const { return defines_; }
    /// Returns whether hits depend on coverage, and thus on RayBatch::frame_constants and the scene's texture units.
    bool alpha_tested() const { return alpha_tested_; }
    const TraceStatistics& statistics() const { return statistics_; }
    /// Returns the serial number, unique per scene and pose within the process. Caches made for one serial must not be
    /// used with another.
    std::uint32_t serial() const { return serial_; }

  private:
    std::uint32_t serial_ = 0;
    bool alpha_tested_ = false;
    bool slivers_ = false;
    TraceStatistics statistics_;
    gpu::Defines defines_;
    gpu::Buffer nodes_;
    gpu::Buffer triangles_;
    gpu::Buffer instances_;
};

/// Adds the passes that fill one Hit per ray of the batch, at the index of its path; with a list, other hits stay
/// unchanged. The hit is the nearest one in (t_min, t_max), both ends open, on either side of surfaces; the lower
/// (instance, triangle) wins ties. A miss has triangle kMiss and t +inf; a search cut short by the driver has t NaN.
/// Returns the hits. Throws Error where the driver cannot start so many rays.
graph::BufferHandle closest_hit(graph::Graph& graph, const TraceScene& scene, const RayBatch& batch,
                                graph::BufferHandle hits);

/// Adds the passes that determine for each ray of the batch whether there is a hit in (t_min, t_max). Writes one uint
/// per path: kFree, kOccluded, or kUnfinished where the driver cut the search short (shaders/shared/rays.h).
graph::BufferHandle any_hit(graph::Graph& graph, const TraceScene& scene, const RayBatch& batch,
                            graph::BufferHandle occluded);

/// Throws Error where the driver cannot start so many work groups at once; `rays` is used in the message.
void check_groups(std::uint32_t groups, std::uint32_t rays);
/// Runs the plain tracer inside a pass that has declared the batch, and the results as written.
void trace_plain(graph::Resources& resources, const TraceScene& scene, const RayBatch& batch,
                 graph::BufferHandle results, bool any_hit);

}  // namespace halflight::rays
