// Interface of tracers that serve whole batches by passes of their own: the raster back end, and tracers of callers.
#pragma once

#include <cstddef>

#include "engine/gpu/program.h"
#include "engine/rays/culling.h"
#include "engine/rays/kinds.h"
#include "engine/rays/rays.h"

namespace halflight::rays {

class BatchServer {
  public:
    virtual ~BatchServer() = default;

    virtual TraceMethod method() const { return TraceMethod::other; }
    /// Adds the passes that trace a batch, with the contract of closest_hit() and any_hit() (rays.h). Server and scene
    /// outlive the graph's runs.
    virtual graph::BufferHandle add(graph::Graph& graph, const TraceScene& scene, const RayBatch& batch,
                                    graph::BufferHandle results, bool any_hit) = 0;
    /// Changes to another pose of the scene.
    virtual void follow(const ServedScene&) { invalidate(); }
    /// Discards remembered visibility after a camera cut, scene edit or resize.
    virtual void invalidate() {}
    virtual void reset_statistics() {}
    /// Returns the bytes that are carried from run to run for such a batch.
    virtual std::size_t state_bytes(const RayBatch&) const { return 0; }
};

/// Declares that a pass of a server reads a batch and writes its results. If the batch has a list, results of paths
/// that are not in it are kept.
void read_batch(graph::Pass& pass, const TraceScene& scene, const RayBatch& batch,
                graph::Access rays = graph::Access::texture_read);
graph::BufferHandle write_results(graph::Pass& pass, const RayBatch& batch, graph::BufferHandle results);
/// Returns the defines of programs that include shaders/lib/batch_rays.glsl.
gpu::Defines batch_defines(const TraceScene& scene, const RayBatch& batch);
/// Binds the scene, the rays, the list (blocks List and Header) and the keys of alpha tests to a program that includes
/// shaders/lib/batch_rays.glsl.
void bind_batch(graph::Resources& resources, const gpu::Program& program, const TraceScene& scene,
                const RayBatch& batch);

}  // namespace halflight::rays
