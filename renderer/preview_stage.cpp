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
                            graph::TextureHandle beauty, int samples) {
    const PreviewPixels filled =
        add_preview_input(graph, band, sums, records, beauty, samples, picture_.import_pixels(graph));
    const PreviewTexels& t = filled.texels;
    for (const graph::TextureHandle h : {t.light, t.guide, t.place, filled.albedo, filled.beauty}) graph.output(h);
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
