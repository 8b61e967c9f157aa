// The tracer of naive.comp: a conventional shader ray tracer.
#pragma once

#include <cstdint>

#include "engine/gpu/buffer.h"
#include "engine/gpu/program_cache.h"
#include "engine/rays/batch_server.h"
#include "engine/tables/tables.h"

namespace halflight::bench {

class NaiveTracer final : public rays::BatchServer {
  public:
    /// Builds a binary tree per block by Embree's binned surface area heuristic, with leaves of at most four triangles.
    /// Another tree contains the instances unless all triangles are in world space. Throws Error if a buffer exceeds
    /// `storage_block_bytes`, the most that a shader can address.
    NaiveTracer(const TraceTables& tables, std::size_t storage_block_bytes);

    /// Traces `count` rays; writes one Hit or one uint for each.
    void trace(gpu::ProgramCache& programs, const gpu::Buffer& rays, std::uint32_t count, bool any_hit,
               gpu::Buffer& results) const;

    /// Adds the passes of a batch of a whole frame. Its rays are in the order of the pass, which is more coherent than
    /// the picture's rows.
    graph::BufferHandle add(graph::Graph& graph, const rays::TraceScene& scene, const rays::RayBatch& batch,
                            graph::BufferHandle results, bool any_hit) override;

    double build_seconds() const { return build_seconds_; }

  private:
    const gpu::Program& bound(gpu::ProgramCache& programs, gpu::Defines defines, const gpu::Buffer& rays, bool any_hit,
                              const gpu::Buffer& results) const;

    double build_seconds_ = 0;
    bool two_level_ = false;
    std::uint32_t root_ = 0;
    gpu::Buffer nodes_{"naive nodes", 0};
    gpu::Buffer triangles_{"naive triangles", 0};
    gpu::Buffer instances_{"naive instances", 0};
};

}  // namespace halflight::bench
