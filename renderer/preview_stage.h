// Preview modes of whole pictures in a renderer: what its bands have come to goes in, a film's picture is replaced.
#pragma once

#include <optional>
#include <span>

#include "engine/color/color.h"
#include "passes/picture/accumulate.h"
#include "renderer/film.h"
#include "renderer/preview_picture.h"
#include "renderer/render.h"

namespace halflight {

class PreviewStage {
  public:
    /// For Preview::of_picture(). Throws what PreviewPicture and ColorConfig::view() throw.
    PreviewStage(gpu::ProgramCache& programs, const RenderSettings& settings, const ColorConfig& colors);

    /// Another picture begins; history: as of PreviewPicture::begin().
    void begin(PictureHistory* history);
    /// Into the graph that makes the band's beauty. sums: squares and features, too; records: of AovRecord; all of
    /// `samples`.
    void add_band(graph::Graph& graph, const Band& band, const Accumulated& sums, graph::BufferHandle records,
                  graph::TextureHandle beauty, int samples);
    /// As PreviewPicture::add_motion().
    void add_motion(const Band& band, std::span<const shared::AovRecord> records, const TraceTables& tables,
                    const PreviousSurfaces& surfaces) {
        picture_.add_motion(band, records, tables, surfaces);
    }
    /// After all bands, each with `samples` > 0 at least: the film's picture becomes another one while there is a bias.
    void apply(const FrameSettings& frame, const TraceTables& tables, int samples, Film& film);
    /// Adds memory, bad values, biases and times of the picture that was made last.
    void tell(RenderStats& stats) const;

  private:
    ivec2 size_;
    PreviewPicture picture_;
    std::optional<ViewProcessor> view_;  // of pictures that come from no sums
    PreviewPicture::Made made_;          // last
};

}  // namespace halflight
