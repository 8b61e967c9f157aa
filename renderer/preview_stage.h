// Preview modes of whole pictures in a renderer: the sums of its bands replace the picture of a film.
#pragma once

#include <optional>
#include <span>

#include "engine/color/color.h"
#include "passes/picture/accumulate.h"
#include "renderer/film.h"
#include "renderer/preview_picture.h"
#include "renderer/render.h"

namespace halflight {

/// Connects PreviewPicture with the bands and the film of a renderer.
class PreviewStage {
  public:
    /// Prepares for settings with Preview::of_picture(). Throws what PreviewPicture and ColorConfig::view() throw.
    PreviewStage(gpu::ProgramCache& programs, const RenderSettings& settings, const ColorConfig& colors);

    /// Begins another picture (PreviewPicture::begin()).
    void begin(PictureHistory* history);
    /// Adds a band's inputs to the graph that makes its beauty. sums: need features and halves. records: buffer of
    /// AovRecord, empty without Preview::temporal.
    void add_band(graph::Graph& graph, const Band& band, const Accumulated& sums, graph::BufferHandle records,
                  graph::TextureHandle beauty, const PreviewSamples& samples);
    /// Calls PreviewPicture::add_motion().
    void add_motion(const Band& band, std::span<const shared::AovRecord> records, const TraceTables& tables,
                    const PreviousSurfaces& surfaces) {
        picture_.add_motion(band, records, tables, surfaces);
    }
    /// Replaces the picture of the film while the modes have an effect. Call it after all bands, each with at least
    /// `samples` > 0 samples.
    void apply(const FrameSettings& frame, const TraceTables& tables, int samples, Film& film);
    /// Adds memory, bad values, biases and times of the last picture.
    void fill_stats(RenderStats& stats) const;

  private:
    ivec2 size_;
    PreviewPicture picture_;
    std::optional<ViewProcessor> view_;  // view transform of pictures that are not made from sums
    PreviewPicture::Made made_;          // result of the last apply()
};

}  // namespace halflight
