// Conversion of sums to pictures: the mean, and the mean through the view transform.
#pragma once

#include <vector>

#include "engine/color/color.h"
#include "engine/gpu/texture.h"
#include "passes/steps/sums.h"

namespace halflight {

/// The view transform on the device: its tables, and its GLSL in front of the kernels that apply it.
class ViewKernel {
  public:
    explicit ViewKernel(const ViewProcessor& processor);

    float exposure_scale() const { return exposure_scale_; }
    /// Returns the complete kernel of add_composite(), and that of add_view().
    const gpu::ShaderSource& source() const { return source_; }
    const gpu::ShaderSource& develop_source() const { return develop_source_; }
    /// Binds the tables to the samplers of a program of a source.
    void bind(const gpu::Program& program) const;

  private:
    struct Lut {
        std::string sampler;
        gpu::Texture texture;
    };
    float exposure_scale_ = 1;
    gpu::ShaderSource source_, develop_source_;
    std::vector<Lut> luts_;
};

struct Composite {
    graph::TextureHandle beauty;  // RGBA32F, band size: mean of all components, scene-linear; A: as in RenderResult
    graph::TextureHandle view;    // RGBA32F: display-encoded, [0,1]; empty without a view kernel
};

/// Divides the sums by `samples`. Shadows on catchers darken the background and add to alpha. `view_kernel` may be null
/// and must outlive the graph. `opaque_background` tells whether the environment is visible behind surfaces.
/// straight_view: the colours of the view are divided by alpha.
Composite add_composite(graph::Graph& graph, const Band& band, const Accumulated& sums, int samples,
                        bool opaque_background, const ViewKernel* view_kernel, bool straight_view = false);

/// Returns the view of a finished picture, RGBA32F, with the bits of Composite::view. `view_kernel` must outlive the
/// graph.
graph::TextureHandle add_view(graph::Graph& graph, graph::TextureHandle picture, const ViewKernel& view_kernel,
                              bool straight_view);

}  // namespace halflight
