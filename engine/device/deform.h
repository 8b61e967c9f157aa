// Morph targets and skins on the GPU (engine/scene/deformer.h). Results equal those of deform(), bit for bit, if the
// device's double arithmetic is IEEE 754.
#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "engine/gpu/buffer.h"
#include "engine/gpu/context.h"
#include "engine/gpu/program_cache.h"
#include "engine/scene/deformer.h"

namespace halflight {

struct DeformStatistics {
    std::size_t vertices = 0;         // deformed vertices
    std::size_t vertices_on_cpu = 0;  // vertices deformed by deform() because of the driver's limits
    double seconds = 0;               // seconds of the CPU clock, including reading and uploading
};

/// Deformer that runs on the device. It owns device copies of shapes, and of morph targets that have been active.
/// Shapes with more vertices than the driver's blocks and buffers hold are divided. The context must outlive the
/// object, and be current on the calling thread when the object is made or destroyed.
class GpuDeformer final : public Deformer {
  public:
    /// Creates a deformer; `limits` are those of the context, or lower ones.
    GpuDeformer(const gpu::Context& context, const gpu::Limits& limits);
    explicit GpuDeformer(const gpu::Context& context) : GpuDeformer(context, context.limits()) {}
    GpuDeformer(const GpuDeformer&) = delete;
    GpuDeformer& operator=(const GpuDeformer&) = delete;
    ~GpuDeformer() override;

    /// Uses its own context, and leaves the current one as it is. If its context is current on another thread, the
    /// CPU deforms. Throws what RestShape throws, and Error if the driver runs out of memory.
    std::vector<VertexArrays> deform(std::span<const Deformation> deformations) override;

    /// Returns the statistics since the last call.
    DeformStatistics take_statistics() { return std::exchange(statistics_, {}); }
    std::size_t bytes() const;  ///< Returns the size in device memory, bytes.

  private:
    struct Resident;
    struct Job;
    struct Piece;
    bool fit(std::size_t joints, std::size_t targets) const;
    std::size_t first_batch(std::span<const Deformation> deformations) const;
    std::vector<VertexArrays> deform_batch(std::span<const Deformation> deformations);
    Resident& resident(const std::shared_ptr<const RestShape>& shape);
    void upload_targets(Resident& shape, const Deformation& deformation);
    void start(const Job& job);
    VertexArrays read(const Job& job) const;

    const gpu::Context& context_;
    gpu::Limits limits_;
    gpu::ProgramCache programs_;
    std::map<std::shared_ptr<const RestShape>, std::unique_ptr<Resident>> shapes_;
    std::vector<gpu::Buffer> results_;  // results of the last call, by piece
    gpu::Buffer matrices_, targets_;    // inputs of the last call
    DeformStatistics statistics_;
};

}  // namespace halflight
