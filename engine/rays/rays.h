// Ray batches and who serves them. Passes fill a batch and ask for hits; they do not know which tracer answers.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "engine/graph/graph.h"
#include "engine/scene/tables.h"

namespace halflight::rays {

/// What a batch is for. Coherence, and with it every decision of a scheduler, goes by kind.
enum class RayKind : std::uint8_t { primary, shadow, diffuse, glossy, continuation, occlusion };
const char* name(RayKind kind);

/// Rays and hits lie at their path's index (structs Ray and Hit of shaders/shared/rays.h), `capacity` of each.
/// Which of them are to be traced: with `list`, the first `count` entries of that list of path indices, in tile order (64
/// consecutive entries are one 8x8 tile, or what is left of several); without, all of them. A ray with t_max < t_min is dead: it is
/// not traced and reports a miss.
struct RayBatch {
    RayKind kind = RayKind::primary;
    std::uint32_t capacity = 0;       // rays; a multiple of 256
    graph::BufferHandle rays;         // capacity x Ray
    graph::BufferHandle list;         // optional: capacity x uint
    graph::BufferHandle list_header;  // with list: ListHeader of shaders/shared/rays.h
    // Keys the alpha test of blended surfaces, only read where TraceTables::alpha_tested: uniform block of struct Frame
    // (shaders/shared/frame.h), whose seed and sample_index change from run to run, and a salt that tells batches of one
    // run apart. The kernel's key: ray_key(path, hash_combine(hash_combine(frame.seed, frame.sample_index), alpha_salt)).
    graph::BufferHandle frame_constants;
    std::uint32_t alpha_salt = 0;
};

/// Hierarchies and triangles of one scene on the GPU. Immutable.
class TraceScene {
  public:
    /// Builds one BVH4 per block with Embree's builder and, for more than one instance, one over the instances.
    /// Throws Error where a table exceeds what the driver can address.
    explicit TraceScene(const TraceTables& tables);
    // ... the rays room's owner completes this: binding, sizes in bytes, build seconds, node counts.
};

/// Adds the passes that fill one Hit per ray of the batch (index: path). Returns the hits.
graph::BufferHandle closest_hit(graph::Graph& graph, const TraceScene& scene, const RayBatch& batch, graph::BufferHandle hits);

/// Adds the passes that tell for each ray of the batch whether anything lies in (t_min, t_max): one uint per path, 1 = occluded.
graph::BufferHandle any_hit(graph::Graph& graph, const TraceScene& scene, const RayBatch& batch, graph::BufferHandle occluded);

}  // namespace halflight::rays
