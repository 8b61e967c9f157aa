// Who serves whole batches by passes of its own, for a tracer that is made of it: the raster back end, and others'
// tracers.
#pragma once

#include <cstddef>

#include "engine/gpu/program.h"
#include "engine/rays/kinds.h"
#include "engine/rays/rays.h"

namespace halflight::rays {

class BatchServer {
  public:
    virtual ~BatchServer() = default;

    virtual Way way() const { return Way::other; }
    /// As closest_hit() and any_hit() of rays.h. Server and scene outlive the graph's runs.
    virtual graph::BufferHandle add(graph::Graph& graph, const TraceScene& scene, const RayBatch& batch,
                                    graph::BufferHandle results, bool any_hit) = 0;
    /// Camera cut, scene edit, resize.
    virtual void invalidate() {}
    virtual void reset_statistics() {}
    /// That are carried from run to run for such a batch.
    virtual std::size_t state_bytes(const RayBatch&) const { return 0; }
};

/// For those that serve: declares that a pass reads a batch, and that it writes the results; with a list, what other
/// paths had stays, if there is anything yet.
void read_batch(graph::Pass& pass, const TraceScene& scene, const RayBatch& batch,
                graph::Access rays = graph::Access::texture_read);
graph::BufferHandle write_results(graph::Pass& pass, const RayBatch& batch, graph::BufferHandle results);
/// Binds the scene, the rays, the list (blocks List and Header) and the keys of alpha tests to a program that includes
/// shaders/lib/batch_rays.glsl.
void bind_batch(graph::Resources& resources, const gpu::Program& program, const TraceScene& scene,
                const RayBatch& batch);

}  // namespace halflight::rays
