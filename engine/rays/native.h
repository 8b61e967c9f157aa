// Native tracing: rays are traced by vector code of the processor, in the memory of a driver that renders on the same
// processor (llvmpipe). The driver's kernels run both sides of a branch under masks; native code does not.
//
// The arithmetic is that of the plain tracer (shaders/lib/traverse.glsl), operation by operation, so hits are equal bit
// for bit. Nodes are eight wide (native_tree.h), which changes no hit, because box tests are monotone. Rays that meet
// an alpha-tested triangle, and rays out of the range in which all intermediate results are finite, are left to the
// plain kernel. A search that the driver would cut short ends here.
//
// Parts of the first batches of closest and of any hits are traced by the plain kernel, too, until 1024 hits or 65536
// rays have been compared. If any bit differs, the server says so in one line and leaves all batches to the plain
// kernel.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "engine/rays/batch_server.h"
#include "engine/rays/batch_statistics.h"

namespace halflight::rays {

class NativeServer final : public BatchServer {
  public:
    /// Builds eight-wide nodes for the scene, which must outlive the server. Needs a current context. Throws Error
    /// if the renderer is not the processor, the processor has no vectors of eight floats, or the scene is loaded in
    /// pages.
    explicit NativeServer(const TraceTables& tables, const TraceScene& scene);
    ~NativeServer() override;

    /// Returns the reason why a server cannot be made for the scene; empty if it can. Needs a current context.
    static std::string reason_against(const TraceScene& scene);

    TraceMethod method() const override { return TraceMethod::native; }
    graph::BufferHandle add(graph::Graph& graph, const TraceScene& scene, const RayBatch& batch,
                            graph::BufferHandle results, bool any_hit) override;
    void follow(const ServedScene& scene) override;
    void invalidate() override;
    void reset_statistics() override;
    std::size_t state_bytes(const RayBatch& batch) const override;
    /// Traces a batch in a pass that has declared the batch (read_batch()) and the results (write_results()).
    void trace(graph::Resources& resources, const TraceScene& scene, const RayBatch& batch, graph::BufferHandle results,
               bool any_hit);

    /// Counts of all batches so far.
    struct Counts {
        std::uint64_t rays = 0;       // rays that were traced, dead ones included
        std::uint64_t delegated = 0;  // rays that were left to the plain kernel
        bool disabled = false;        // the comparison at the start found a difference
        std::string note;             // one line about the difference; empty if there is none
    };
    const Counts& counts() const;
    /// Adds the tasks of a batch since the last reset_statistics() to its statistics.
    void add_tasks(const BatchKey& key, BatchStatistics& to) const;
    std::size_t bytes() const;  ///< Returns the bytes of the eight-wide nodes.

  private:
    struct Parts;
    std::unique_ptr<Parts> parts_;
};

/// Returns the number of threads of native code: those of the driver. llvmpipe takes LP_NUM_THREADS, or as many as
/// there are cores.
int native_threads();

/// Makes the server of Culling::native. Throws Error like the constructor of NativeServer.
std::unique_ptr<BatchServer> make_native_server(const ServedScene& scene);
/// Returns a server for Tracer::offer(); null if there can be none.
std::unique_ptr<NativeServer> offered_native_server(const ServedScene& scene);

}  // namespace halflight::rays
