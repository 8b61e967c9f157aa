// Denoising of final pictures in a renderer: the halves of its bands replace the picture of a film.
#pragma once

#include <optional>

#include "engine/color/color.h"
#include "engine/graph/execute.h"
#include "passes/picture/denoiser.h"
#include "renderer/film.h"
#include "renderer/needs.h"
#include "renderer/render.h"

namespace halflight {

/// Connects the denoiser with the bands and the film of a renderer. Owns the textures of the whole picture.
class DenoiseStage {
  public:
    /// Prepares for settings with `denoise`. Throws Error where the driver has no textures so large.
    DenoiseStage(gpu::ProgramCache& programs, const RenderSettings& settings, const ColorConfig& colors,
                 const FrameNeeds& needs, const SceneNeeds& scene);

    /// Begins another picture.
    void begin();
    /// Adds a band's inputs to the graph that makes its beauty. sums: as Accumulated, with features and halves.
    void add_band(graph::Graph& graph, const Band& band, const Accumulated& sums, graph::TextureHandle beauty,
                  const SampleHalves& samples);
    /// Replaces the picture of the film, and fills its layers of LayerSource::denoiser. Call it after all bands. Does
    /// nothing for a band with a single sample, whose picture stays the mean.
    void apply(Film& film);
    /// Adds memory, bias and times of the last picture.
    void fill_stats(RenderStats& stats) const;

  private:
    DenoiserPixels import_pixels(graph::Graph& graph);

    /// Textures of the halves of a component.
    struct Halves {
        explicit Halves(const gpu::TextureDesc& desc) : first("first half", desc), second("second half", desc) {}
        gpu::Texture first, second;
    };
    gpu::TextureDesc desc_;
    gpu::Texture mean_, guide_, reflectance_, diffuse_albedo_, glossy_albedo_;  // see DenoiserPixels
    std::array<std::optional<Halves>, kFilteredLights.size()> light_;           // none: the picture has no such light
    std::optional<ViewProcessor> view_;
    graph::Executor executor_;
    std::size_t transient_bytes_ = 0;
    bool has_halves_ = false;  // a band has samples in both halves
    bool denoised_ = false;    // the last apply() has replaced the picture
};

}  // namespace halflight
