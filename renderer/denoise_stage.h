// Denoising of final pictures in a renderer: the halves of its bands replace the picture of a film.
#pragma once

#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "engine/color/color.h"
#include "engine/graph/execute.h"
#include "passes/picture/denoiser.h"
#include "renderer/film.h"
#include "renderer/needs.h"
#include "renderer/noisy_frame.h"
#include "renderer/render.h"

namespace halflight {

/// Connects the denoiser with the bands and the film of a renderer. Owns the textures of a picture that is denoised at
/// once.
class DenoiseStage {
  public:
    /// Prepares for pictures of `size` pixels that come from elsewhere: denoise() alone may be called. view: the view
    /// transform; none: no view is made. transparent: as PictureSettings::transparent.
    DenoiseStage(gpu::ProgramCache& programs, const ivec2& size, std::optional<ViewProcessor> view, bool transparent);
    /// Prepares for settings with `denoise`. Throws Error if the driver has no textures so large.
    DenoiseStage(gpu::ProgramCache& programs, const RenderSettings& settings, const ColorConfig& colors,
                 const FrameNeeds& needs, const SceneNeeds& scene);

    /// Begins another picture. frame: keeps the picture for denoise(), so that apply() leaves it noisy; null: apply()
    /// denoises it. camera: its lens is focused at a distance. band: a band of the picture. shown: upper left pixel of
    /// the picture among those that are rendered.
    void begin(NoisyFrame* frame, const Camera& camera, const Band& band, const ivec2& shown);
    /// Adds a band's inputs, if a picture will be denoised, to the graph that makes its beauty. sums: as Accumulated,
    /// with features and halves.
    void add_band(graph::Graph& graph, const Band& band, const Accumulated& sums, graph::TextureHandle beauty,
                  const SampleHalves& samples);
    /// Replaces the picture of the film, and fills its layers of LayerSource::denoiser. Call it after all bands. Does
    /// nothing for a band with a single sample, whose picture stays the mean. complete: all bands have samples;
    /// otherwise the whole picture stays the mean.
    void apply(Film& film, bool complete);
    /// Adds memory, bias and times of the last picture.
    void fill_stats(RenderStats& stats) const;
    /// Replaces the picture of a frame that begin() has kept, like apply(). Adds memory, bias and times.
    void denoise(NoisyFrame& frame, std::span<const NearFrame> near, RenderResult& result);

  private:
    /// A denoised picture with its weights, RGBA.
    struct Made {
        Image picture, weights;
    };
    struct Inputs {
        DenoiserPixels pixels;
        std::vector<DenoiserNeighbour> neighbours{};
    };
    /// Denoises windows one after the other. inputs: adds those of a window to a graph. Returns none for pictures that
    /// have nothing to denoise.
    std::optional<Made> make(std::span<const DenoiserWindow> windows,
                             const std::function<Inputs(graph::Graph&, const DenoiserWindow&)>& inputs);

    gpu::TextureDesc desc_;
    DenoiserTextures::Present present_{};
    bool chains_ = false;  // specular chains are followed
    std::optional<DenoiserTextures> own_;
    DenoiserBlur blur_{0};                 // blur of the picture's camera
    std::vector<DenoiserWindow> windows_;  // parts of the picture that are denoised apart
    NoisyFrame* kept_ = nullptr;           // frame that gets the picture; null: own_ gets it
    std::optional<ViewProcessor> view_;
    graph::Executor executor_;
    std::size_t transient_bytes_ = 0;
    bool transparent_ = false;
    bool filters_ = true;      // false: pictures stay noisy, and are kept
    bool has_halves_ = false;  // a band has samples in both halves
    bool denoised_ = false;    // the last apply() has replaced the picture
};

}  // namespace halflight
