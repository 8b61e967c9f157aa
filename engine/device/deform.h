// Morph targets and skins on the GPU: engine/scene/deformer.h, with the bits of deform() where double arithmetic is
// that of IEEE 754, as on CPUs.
#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "engine/gpu/buffer.h"
#include "engine/gpu/context.h"
#include "engine/gpu/program.h"
#include "engine/scene/deformer.h"

namespace halflight {

struct DeformStatistics {
    std::size_t vertices = 0;         // deformed
    std::size_t vertices_on_cpu = 0;  // of those, what the driver's limits leave to deform()
    double seconds = 0;               // CPU clock, what had to be read and uploaded included
};

/// Keeps shapes in device memory, of morph targets what has been active. Shapes of more vertices than the driver's
/// blocks and buffers hold are taken in pieces. Needs its context current on the calling thread, which must outlive it.
class GpuDeformer final : public Deformer {
  public:
    /// `limits`: of the context, or lower ones.
    GpuDeformer(const gpu::Context& context, const gpu::Limits& limits);
    explicit GpuDeformer(const gpu::Context& context) : GpuDeformer(context, context.limits()) {}
    GpuDeformer(const GpuDeformer&) = delete;
    GpuDeformer& operator=(const GpuDeformer&) = delete;
    ~GpuDeformer() override;

    /// Throws what RestShape throws, and Error where the driver has not got the memory.
    std::vector<VertexArrays> deform(std::span<const Deformation> deformations) override;

    /// Since the last call.
    DeformStatistics take_statistics() { return std::exchange(statistics_, {}); }
    std::size_t bytes() const;  ///< in device memory

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

    gpu::Limits limits_;
    gpu::ProgramCache programs_;
    std::map<std::shared_ptr<const RestShape>, std::unique_ptr<Resident>> shapes_;
    std::vector<gpu::Buffer> results_;  // of the last call's pieces, in their order
    gpu::Buffer matrices_, targets_;    // of the last call
    DeformStatistics statistics_;
};

}  // namespace halflight
