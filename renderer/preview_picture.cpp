#include "renderer/preview_picture.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "engine/graph/compile.h"
#include "passes/picture/denoiser.h"
#include "shaders/shared/pixel_order.h"
#include "shaders/shared/preview_constants.h"
#include "shaders/shared/ray_structs.h"

namespace halflight {
namespace {

gpu::TextureDesc of_size(const ivec2& image) {
    return {image.x, image.y, GL_RGBA32F};
}

PreviewTexels output(graph::Graph& graph, const PreviewTexels& texels) {
    for (const graph::TextureHandle handle : {texels.first, texels.second, texels.guide, texels.place})
        graph.output(handle);
    return texels;
}

}  // namespace

PictureHistory::Kept::Kept(const shared::Frame& f, const dvec3& o)
    : first("earlier first half", of_size(f.size)),
      second("earlier second half", of_size(f.size)),
      guide("earlier guide", of_size(f.size)),
      place("earlier place", of_size(f.size)),
      frame(f),
      origin(o) {}

PreviewPicture::PreviewPicture(gpu::ProgramCache& programs, const Preview& preview, const ivec2& image)
    : preview_(preview),
      first_("preview first half", of_size(image)),
      second_("preview second half", of_size(image)),
      guide_("preview guide", of_size(image)),
      albedo_("preview albedo", of_size(image)),
      beauty_("preview beauty", of_size(image)),
      refused_("refused texels", shared::kRefusedKinds * sizeof(std::uint32_t)),
      executor_(programs) {
    if (preview.temporal) place_.emplace("preview place", of_size(image));
}

void PreviewPicture::begin(PictureHistory* history) {
    history_ = preview_.temporal ? history : nullptr;
    moved_ = Image();
    executor_.reset_times();
    swapped_ = false;
    if (!history_) return;
    if (history_->shown_ && history_->shown_->filled) {
        std::swap(history_->earlier_, history_->shown_);
        if (history_->shown_) history_->shown_->filled = false;
    }
    swapped_ = history_->earlier_ && !history_->earlier_->swapped;
}

PreviewPixels PreviewPicture::import_pixels(graph::Graph& graph) {
    const auto import = [&](gpu::Texture& texture) { return graph.import_texture(texture.name(), texture); };
    PreviewPixels pixels{{import(first_), import(second_), import(guide_)}, import(albedo_), import(beauty_)};
    if (place_) pixels.texels.place = import(*place_);
    return pixels;
}

void PreviewPicture::add_motion(const Band& band, std::span<const shared::AovRecord> records, const TraceTables& tables,
                                const PreviousSurfaces& surfaces) {
    if (!history_ || !history_->earlier_) return;
    const gpu::TextureDesc& desc = place_->desc();
    if (moved_.pixels.empty()) moved_ = Image(desc.width, desc.height, 4);
    for (int y = band.y; y < std::min(band.y + band.rows, desc.height); ++y) {
        for (int x = 0; x < desc.width; ++x) {
            const shared::AovRecord& r = records[shared::path_of_pixel({x, y - band.y}, band.tiles())];
            if (r.triangle == shared::kMiss) continue;
            const TriangleSource source = source_of(tables, r.instance, r.triangle);
            dvec3 place = dvec3(r.position) + tables.origin;
            if (surfaces.moved(source.instance)) place = surfaces.before(source.instance, source.triangle, place);
            const vec3 before(place - history_->earlier_->origin);
            std::copy_n(&before.x, 3, moved_.at(x, y));
        }
    }
}

std::optional<EarlierPicture> PreviewPicture::import_earlier(graph::Graph& graph, const dvec3& origin) {
    if (!history_->earlier_) return std::nullopt;
    PictureHistory::Kept& kept = *history_->earlier_;
    const auto import = [&](gpu::Texture& texture) { return graph.import_texture(texture.name(), texture); };
    EarlierPicture earlier;
    earlier.texels = {import(kept.first), import(kept.second), import(kept.guide), import(kept.place)};
    if (!moved_.pixels.empty()) {
        if (!before_) before_.emplace("places before", place_->desc());
        before_->upload(std::span<const float>(moved_.pixels));
        earlier.before = import(*before_);
    }
    earlier.to_clip = kept.frame.previous_view_projection;
    earlier.origin_shift = vec3(origin - kept.origin);
    const auto rows = static_cast<float>(kept.frame.size.y);
    earlier.pixel = 2 * glm::length(vec3(kept.frame.camera_up)) / rows;
    earlier.share = std::min(rows / static_cast<float>(place_->desc().height), 1.0f);
    return earlier;
}

PreviewTexels PreviewPicture::import_shown(graph::Graph& graph, const shared::Frame& frame, const dvec3& origin) {
    std::optional<PictureHistory::Kept>& shown = history_->shown_;
    if (!shown || shown->first.desc() != first_.desc()) shown.emplace(frame, origin);
    shown->filled = false;
    shown->frame = frame, shown->origin = origin, shown->swapped = swapped_;
    const auto import = [&](gpu::Texture& texture) { return graph.import_texture("new " + texture.name(), texture); };
    return {import(shown->first), import(shown->second), import(shown->guide), import(shown->place)};
}

PreviewPicture::Made PreviewPicture::make(const shared::Frame& frame, const dvec3& origin, int samples) {
    graph::Graph graph;
    const PreviewPixels pixels = import_pixels(graph);
    PreviewTexels texels = pixels.texels;
    Made made;
    if (history_) {
        const std::optional<EarlierPicture> earlier = import_earlier(graph, origin);
        texels = output(graph, add_temporal(graph, texels, earlier, import_shown(graph, frame, origin), refused_));
        graph::Pass kept = graph.add_pass("preview: earlier picture is complete");  // even if the filter is interrupted
        kept.keep();
        kept.execute([history = history_](graph::Resources&) { history->shown_->filled = true; });
        if (earlier && static_cast<float>(samples) < shared::kTemporalEnds)
            made.biases.push_back(fmt::format(
                "preview: light of earlier pictures is reused until there are {:g} samples", shared::kTemporalEnds));
    }
    std::optional<FilteredHalves> filtered;
    if (preview_.filter && static_cast<float>(samples) < shared::kFilterEnds) {
        const LightHalves halves = add_preview_halves(graph, texels, pixels.albedo);
        filtered = add_preview_filter(graph, halves, texels.guide, pixels.albedo);
        made.biases.push_back(
            fmt::format("preview: noise is filtered out until there are {:g} samples", shared::kFilterEnds));
    }
    graph::TextureHandle picture;
    if (!made.biases.empty()) graph.output(picture = add_preview_output(graph, pixels, texels, filtered));
    if (!history_ && !picture) return made;

    refused_.clear();
    const graph::CompiledGraph compiled = graph::compile(graph);
    transient_bytes_ = compiled.slot_bytes;
    executor_.run(compiled);
    const auto counts = refused_.read<std::uint32_t>();
    made.nans = counts[shared::kRefusedNan];
    made.infinities = counts[shared::kRefusedInfinite];
    if (picture) {
        made.beauty = Image(first_.desc().width, first_.desc().height, 4);
        made.beauty->pixels = executor_.texture(picture).read_float();
    }
    return made;
}

std::size_t PreviewPicture::bytes() const {
    const std::size_t each = gpu::texture_bytes(first_.desc());
    std::size_t sum = 5 * each + (place_ ? each : 0) + (before_ ? each : 0) + transient_bytes_;
    if (!history_) return sum;
    for (const auto& kept : {&history_->earlier_, &history_->shown_})
        if (*kept) sum += 4 * gpu::texture_bytes((*kept)->first.desc());
    return sum;
}

}  // namespace halflight
