// Ray batches and who serves them. Passes fill a batch and ask for hits; they do not know which tracer answers.
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

/// Rays and hits lie at their path's index (structs Ray and Hit of shaders/shared/rays.h), `capacity` of each; where
/// paths have several, as `paths` and `rays_of_path` say. Which of them are to be traced: with `list`, the first
/// `count` entries of that list of path indices, in tile order (64 consecutive entries are one 8x8 tile, or what is
/// left of several); without, all of them. A ray with t_max < t_min is dead: it is not traced and reports a miss.
struct RayBatch {
    RayKind kind = RayKind::primary;
    // Reflections before; of camera rays, number of the batch. With the kind it tells the batches of a graph apart.
    std::uint32_t depth = 0;
    std::uint32_t place = 0;     // part of the picture: what is known of where rays go is kept apart by it
    std::uint32_t capacity = 0;  // rays; a multiple of 256
    // > 0: ray i is of path i modulo this, of which there are several rays, those of all paths in turns. 0: rays of a
    // path follow one another, as many as `rays_of_path` says: a power of two, at most 16. With a list it is 1.
    std::uint32_t paths = 0;
    std::uint32_t rays_of_path = 1;
    graph::BufferHandle rays;         // capacity x Ray
    graph::BufferHandle list;         // optional: capacity x uint
    graph::BufferHandle list_header;  // with list: ListHeader of shaders/shared/rays.h
    // Keys the alpha test of blended surfaces, only read where TraceTables::alpha_tested: uniform block of struct Frame
    // (shaders/shared/frame.h), whose seed and sample_index change from run to run and whose band tells the pixel of a
    // path, and a salt that tells batches of one run apart. The kernel's key: shaders/lib/alpha_key.glsl.
    graph::BufferHandle frame_constants;
    std::uint32_t alpha_salt = 0;
};

/// Of all batches, at whatever time, that are alike: what is known of one is of use to the next.
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
    std::size_t nodes = 0;  // four-wide, of all hierarchies
    NodeFormat node_format = NodeFormat::grid;
    bool two_level = false;
    std::uint32_t stack_entries = 0;  // that the deepest traversal can need: the kernels' stacks have so many
    std::size_t bytes = 0;            // in device memory
    double build_seconds = 0;
};

/// Hierarchies and triangles of one scene on the GPU.
class TraceScene {
  public:
    /// Builds one BVH4 per block with Embree's builder and, unless all triangles are in world space, one over the
    /// instances. shading: SceneBuffers::defines(), needed where tables.alpha_tested, for the kernels then read
    /// coverage (shaders/lib/alpha.glsl); the scene's texture units must be bound whenever such a graph runs. Throws
    /// Error where a table exceeds what the driver can address.
    explicit TraceScene(const TraceTables& tables, const gpu::Defines& shading = {});
    /// packed: what pack_scene() made of the tables.
    TraceScene(const TraceTables& tables, const PackedScene& packed, const gpu::Defines& shading);

    /// Brings it to another pose. last: what is packed there, so that no more is written than what differs; or null.
    /// Throws Error as the constructor; it is of no use then.
    void update(const TraceTables& tables, const PackedScene& packed, const gpu::Defines& shading,
                const PackedScene* last);

    /// The scene is shaded otherwise: defines() follow.
    void set_shading(const gpu::Defines& shading);

    /// Binds UNIT_NODES, UNIT_TRIANGLE_VERTICES and UNIT_INSTANCES.
    void bind() const;
    /// Variant of shaders/trace_scene.glsl and shaders/lib/traverse.glsl.
    const gpu::Defines& defines() const { return defines_; }
    /// Whether hits depend on coverage, and so on RayBatch::frame_constants and the scene's texture units.
    bool alpha_tested() const { return alpha_tested_; }
    const TraceStatistics& statistics() const { return statistics_; }
    /// Another one for every scene and pose of the process: what was made for one is not for another.
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

/// Adds the passes that fill one Hit per ray of the batch (index: path); with a list, other paths keep what they had.
/// A miss has triangle kMiss and t +inf; a search that the driver cut short has t NaN. Nearest of what lies in (t_min,
/// t_max), both ends open, from both sides; among equal t the lower (instance, triangle). Returns the hits. Throws
/// Error where the driver cannot start so many rays.
graph::BufferHandle closest_hit(graph::Graph& graph, const TraceScene& scene, const RayBatch& batch,
                                graph::BufferHandle hits);

/// Adds the passes that tell for each ray of the batch whether anything lies in (t_min, t_max): one uint per path,
/// kFree, kOccluded, or kUnfinished where the driver cut the search short (shaders/shared/rays.h).
graph::BufferHandle any_hit(graph::Graph& graph, const TraceScene& scene, const RayBatch& batch,
                            graph::BufferHandle occluded);

/// Throws Error where the driver does not start so many work groups at once; `rays` is for the message.
void check_groups(std::uint32_t groups, std::uint32_t rays);
/// What the pass of either does, for passes that have declared the batch, and the results as written.
void trace_plain(graph::Resources& resources, const TraceScene& scene, const RayBatch& batch,
                 graph::BufferHandle results, bool any_hit);

}  // namespace halflight::rays
