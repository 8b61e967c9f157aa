#include "renderer/preview_stage.h"

#include <utility>

#include "renderer/frame_constants.h"

namespace halflight {

PreviewStage::PreviewStage(gpu::ProgramCache& programs, const RenderSettings& settings, const ColorConfig& colors)
    : size_(settings.width, settings.height), picture_(programs, settings.preview, size_) {
    picture_.measure(settings.measure);
    if (settings.want_view) view_ = colors.view(settings.view);
}

void PreviewStage::begin(PictureHistory* history) {
    picture_.begin(history);
    made_ = {};
}

void PreviewStage::add_band(graph::Graph& graph, const Band& band, const Accumulated& sums, graph::BufferHandle records,
                            graph::TextureHandle beauty, const PreviewSamples& samples) {
    PreviewPixels to = picture_.import_pixels(graph);
    if (picture_.swaps_halves()) std::swap(to.texels.first, to.texels.second);
    const PreviewPixels filled = add_preview_input(graph, band, sums, records, beauty, samples, to);
    const PreviewTexels& t = filled.texels;
    for (const graph::TextureHandle h : {t.first, t.second, t.guide, filled.albedo, filled.beauty}) graph.output(h);
    if (t.place) graph.output(t.place);
}

void PreviewStage::apply(const FrameSettings& frame, const TraceTables& tables, int samples, Film& film) {
    FrameSettings still = frame;
    still.previous_camera.reset();
    made_ = picture_.make(frame_constants(still, tables, {.band = {size_, 0, size_.y}}), tables.origin, samples);
    if (made_.beauty) film.replace_pictures(*std::move(made_.beauty), view_ ? &*view_ : nullptr);
}

void PreviewStage::fill_stats(RenderStats& stats) const {
    stats.gpu_bytes += picture_.bytes();
    stats.bad_values.push_back({"earlier pictures", made_.nans, made_.infinities, 0});
    stats.biases.insert(stats.biases.end(), made_.biases.begin(), made_.biases.end());
    for (const graph::PassTime& t : picture_.times()) stats.passes.push_back({t.name, t.count, t.seconds});
}

}  // namespace halflight
