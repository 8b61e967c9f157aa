// Frames of an animated scene as pictures, with or without motion blur.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "engine/device/deform.h"
#include "renderer/preview_picture.h"
#include "renderer/render.h"
#include "tools/halflight/animated_scene.h"
#include "tools/halflight/arguments.h"

namespace halflight {

/// At how many times a frame of so many samples is seen while the shutter is open: what was asked for, otherwise 8
/// where there are as many samples, or twice as many for the layer "variance". 1 without a shutter.
int shutter_count(const RenderArguments& arguments, int samples);

/// "open for 0.5 of a frame, 8 times", as files tell it; empty without a shutter.
std::string shutter_text(const RenderArguments& arguments, int samples);

/// Renders with one Renderer, which is brought from pose to pose; meshes that deform do so on the GPU. Everything that
/// it is given must outlive it.
class FrameRenderer {
  public:
    FrameRenderer(const RenderArguments& arguments, AnimatedScene& scene, gpu::Context& context,
                  const ColorConfig& config, RenderSettings settings);
    FrameRenderer(const FrameRenderer&) = delete;
    FrameRenderer& operator=(const FrameRenderer&) = delete;
    ~FrameRenderer();

    /// The picture of a frame, at its own time; with a shutter that is open for S > 0, the mean of times up to S / 2
    /// frames before and after. Throws Error where it cannot be made; other frames can.
    RenderResult render(std::uint32_t frame, const ProgressCallback& progress);
    /// Those of the frame rendered last: with its number and its camera.
    const RenderSettings& settings() const { return settings_; }
    /// That posing the scene took for it.
    double load_seconds() const { return load_seconds_; }
    /// What was deformed for it; none of scenes that nothing deforms.
    const std::optional<DeformStatistics>& deformed() const { return deformed_; }
    std::string graph_dot() const { return renderer_->graph_dot(); }

  private:
    /// Brings scene and renderer to a time.
    void pose(double seconds, const FrameSettings& frame);
    /// Calls f(); where that throws, the next picture gets another renderer.
    template <class F>
    auto guarded(F f);
    RenderResult picture(double seconds, const FrameSettings& frame, const ProgressCallback& progress);
    /// At the frame's own time, with the motion of surfaces where it is asked for.
    RenderResult still(std::uint32_t frame, const FrameSettings& settings, const ProgressCallback& progress);
    RenderResult blurred(std::uint32_t frame, const ProgressCallback& progress);

    const RenderArguments& a_;
    AnimatedScene& scene_;
    gpu::Context& context_;
    const ColorConfig& config_;
    RenderSettings settings_;
    std::optional<GpuDeformer> deformer_;  // of the scene, where anything deforms
    std::optional<DeformStatistics> deformed_;
    std::optional<Renderer> renderer_;
    PictureHistory history_;                   // of the frame rendered last, with RenderSettings::preview
    std::optional<std::uint32_t> last_frame_;  // rendered
    double load_seconds_ = 0;
    double reference_seconds_ = 0;  // that preparing the reference pose took, for the next picture
};

}  // namespace halflight
