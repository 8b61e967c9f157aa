#include "renderer/film.h"

#include <algorithm>
#include <bit>
#include <limits>

#include "engine/core/error.h"
#include "engine/core/image_tools.h"
#include "passes/picture/shadow_catcher.h"
#include "renderer/frame_constants.h"
#include "shaders/shared/aov_record.h"
#include "shaders/shared/pixel_order.h"
#include "shaders/shared/ray_structs.h"

namespace halflight {
namespace {

/// Calls f(x, y, path) for every pixel of the band inside the image. x, y: pixel of the whole image.
template <class F>
void for_each_pixel(const Band& band, F&& f) {
    const int rows = std::min(band.rows, band.image.y - band.y);
    for (int y = 0; y < rows; ++y)
        for (int x = 0; x < band.image.x; ++x)
            f(x, band.y + y, std::size_t{shared::path_of_pixel({x, y}, band.tiles())});
}

/// Writes the mean of some channels of sums that have `stride` doubles per path.
void add_mean(const Band& band, Image& to, const std::vector<double>& sums, std::size_t stride, std::size_t first,
              int samples, std::size_t channels = 3) {
    if (sums.empty()) return;
    for_each_pixel(band, [&](int x, int y, std::size_t path) {
        for (std::size_t c = 0; c < channels; ++c)
            to.at(x, y)[c] = static_cast<float>(sums[path * stride + first + c] / samples);
    });
}

void add_variance(const Band& band, Image& to, const Film::Sums& sums, int samples) {
    if (samples < 2) return;
    for_each_pixel(band, [&](int x, int y, std::size_t path) {
        for (std::size_t c = 0; c < 3; ++c) {
            const double sum = sums.beauty(path, c);
            const double of_samples = std::max(sums.squares[path * 3 + c] - sum * sum / samples, 0.0) / (samples - 1);
            constexpr double kMost = std::numeric_limits<float>::max();
            to.at(x, y)[c] = static_cast<float>(std::min(of_samples / samples, kMost));
        }
    });
}

std::size_t group_of(const AovInfo& layer, const std::vector<std::string>& groups) {
    return static_cast<std::size_t>(std::ranges::find(groups, layer.name) - groups.begin());
}

/// Writes a layer from the sums of its source. groups: light_group_layers().
void add_layer(const Band& band, const AovInfo& layer, Image& to, const Film::Sums& sums, int samples,
               const std::vector<std::string>& groups) {
    switch (layer.source) {
        case LayerSource::emission:
            return add_mean(band, to, sums.emission, 4, layer.first, samples);
        case LayerSource::direct:
            return add_mean(band, to, sums.direct, 6, layer.first, samples);
        case LayerSource::indirect:
            return add_mean(band, to, sums.indirect, 6, layer.first, samples);
        case LayerSource::features:
            return add_mean(band, to, sums.features, 6, layer.first, samples);
        case LayerSource::groups:
            return add_mean(band, to, sums.groups, 3 * groups.size(), 3 * group_of(layer, groups), samples);
        case LayerSource::squares:
            return add_variance(band, to, sums, samples);
        case LayerSource::count:
            return for_each_pixel(band, [&](int x, int y, std::size_t) { *to.at(x, y) = static_cast<float>(samples); });
        case LayerSource::objects:
        case LayerSource::materials:
        case LayerSource::record:
        case LayerSource::noisy:
        case LayerSource::denoiser:
        case LayerSource::debug:
            return;
    }
}

}  // namespace

bool asked_for(const RenderSettings& s, std::string_view name) {
    return std::ranges::find(s.aovs, name) != s.aovs.end();
}

bool asked_for(const RenderSettings& s, std::initializer_list<LayerSource> sources) {
    return std::ranges::any_of(s.aovs, [&](const std::string& name) {
        return std::ranges::find(sources, find_aov(name)->source) != sources.end();
    });
}

std::vector<std::string> light_group_layers(const RenderSettings& s) {
    std::vector<std::string> layers;
    std::ranges::copy_if(s.aovs, std::back_inserter(layers), [](const std::string& name) {
        const AovInfo* const aov = find_aov(name);
        return aov && aov->is_light_group();
    });
    return layers;
}

std::size_t film_bytes(const RenderSettings& s) {
    std::size_t channels = (s.want_view ? 8 : 4);
    for (const std::string& aov : s.aovs) channels += find_aov(aov)->channel_names().size();
    return channels * sizeof(float);
}

Film::Film(const RenderSettings& settings, const TraceTables& tables, const paging::PageSource* pages,
           const std::vector<std::string>& aovs)
    : settings_(settings), tables_(tables), pages_(pages), beauty_(settings.width, settings.height, 4) {
    if (settings.want_view) view_ = Image(settings.width, settings.height, 4);
    choose(aovs);
}

void Film::choose(const std::vector<std::string>& aovs) {
    planes_.clear();
    for (const std::string& name : aovs) {
        const AovInfo* const aov = find_aov(name);
        if (!aov || (!aov->at_any_time() && !asked_for(settings_, name)))
            throw Error("render settings", "layer \"{}\" was not requested before the samples were rendered", name);
        planes_.push_back(
            {aov, Image(settings_.width, settings_.height, static_cast<int>(aov->channel_names().size()))});
    }
}

bool Film::wants(std::initializer_list<LayerSource> sources) const {
    return std::ranges::any_of(
        planes_, [&](const Plane& p) { return std::ranges::find(sources, p.aov->source) != sources.end(); });
}

Image* Film::plane(std::string_view aov) {
    const auto found = std::ranges::find_if(planes_, [&](const Plane& p) { return p.aov->name == aov; });
    return found == planes_.end() ? nullptr : &found->image;
}

double Film::Sums::beauty(std::size_t path, std::size_t channel) const {
    double sum = emission[path * 4 + channel];
    for (const std::vector<double>* light : {&direct, &indirect})
        if (!light->empty()) sum += (*light)[path * 6 + channel] + (*light)[path * 6 + 3 + channel];
    return sum;
}

void Film::add_sums(const Band& band, int samples, const Sums& sums) {
    const std::vector<std::string> groups = light_group_layers(settings_);
    for (Plane& p : planes_) add_layer(band, *p.aov, p.image, sums, samples, groups);
}

void Film::add_pictures(const Band& band, const std::vector<float>& beauty, const std::vector<float>& view) {
    const int rows = std::min(band.rows, band.image.y - band.y);
    const auto count = static_cast<std::ptrdiff_t>(rows) * band.image.x * 4;
    std::copy_n(beauty.begin(), count, beauty_.at(0, band.y));
    if (!view.empty()) std::copy_n(view.begin(), count, view_.at(0, band.y));
}

void Film::replace_pictures(Image beauty, const ViewProcessor* view) {
    beauty_ = std::move(beauty);
    if (view) view_ = view->apply(settings_.transparent ? straight(beauty_) : beauty_);
}

void Film::keep_noisy() {
    if (Image* noisy = plane("noisy")) *noisy = rgb(beauty_);
}

void Film::add_denoiser_weights(const std::vector<float>& weights) {
    Image all(settings_.width, settings_.height, 4);
    all.pixels = weights;
    if (Image* own = plane("denoiser")) *own = rgb(all);
}

void Film::add_sample_counts(const Band& band, std::span<const std::uint32_t> samples) {
    Image* own = plane("samples");
    if (!own) return;
    for_each_pixel(band,
                   [&](int x, int y, std::size_t path) { *own->at(x, y) = static_cast<float>(samples[path / 256]); });
}

void Film::add_ids(const Band& band, int samples, std::string_view aov, const IdCoverage& coverage) {
    Image* ids = plane(aov);
    if (!ids) return;
    for_each_pixel(band, [&](int x, int y, std::size_t path) {
        coverage.rank(path, samples, std::span<float, 2 * kCryptomatteRanks>(ids->at(x, y), 2 * kCryptomatteRanks));
    });
}

void Film::add_data(const Band& band, const std::vector<shared::AovRecord>& records) {
    for (Plane& p : planes_) {
        if (!p.aov->read) continue;
        for_each_pixel(band,
                       [&](int x, int y, std::size_t path) { p.aov->read(records[path], tables_, p.image.at(x, y)); });
        if (pages_ && p.aov->storage == LayerStorage::ids) add_materials(band, records, p.image);
    }
}

/// Sets the materials in the layer of ids, which are in pages.
void Film::add_materials(const Band& band, const std::vector<shared::AovRecord>& records, Image& ids) const {
    std::vector<std::uint32_t> triangles;
    std::vector<float*> places;
    for_each_pixel(band, [&](int x, int y, std::size_t path) {
        if (records[path].triangle == shared::kMiss) return;
        triangles.push_back(records[path].triangle);
        places.push_back(ids.at(x, y) + 2);
    });
    paging::TriangleRows rows;
    pages_->read_rows(triangles, rows);
    for (std::size_t i = 0; i < places.size(); ++i)
        *places[i] = std::bit_cast<float>(rows.triangles[i].w & kTriangleMaterialMask);
}

void Film::add_surface_motion(const Band& band, const std::vector<shared::AovRecord>& records,
                              const PreviousSurfaces& surfaces, const Camera& now, const Camera& previous) {
    Image* motion = plane("motion");
    if (!motion) return;
    const CameraPlaces places(now, band.whole()), earlier(previous, band.whole());
    for_each_pixel(band, [&](int x, int y, std::size_t path) {
        const shared::AovRecord& r = records[path];
        if (r.triangle == shared::kMiss) return;
        const TriangleSource source = source_of(tables_, r.instance, r.triangle);
        if (!surfaces.moved(source.instance)) return;
        const dvec3 position = dvec3(r.position) + tables_.origin;
        const ivec2 pixel = band.origin + ivec2(x, y);
        const auto before = earlier.place(surfaces.before(source.instance, source.triangle, position), pixel);
        // The rasterizer may show a triangle beside the pixel's ray, so that the point itself is projected.
        const auto here = places.place(position, pixel);
        if (!before || !here) return;  // the point was behind the camera
        const dvec2 way = places.shorter(*here - *before);
        motion->at(x, y)[0] = static_cast<float>(way.x);
        motion->at(x, y)[1] = static_cast<float>(way.y);
    });
}

void Film::add_debug(const Band& band, const std::vector<shared::DebugRecord>& records) {
    for (Plane& p : planes_) {
        if (!p.aov->read_debug) continue;
        for_each_pixel(band,
                       [&](int x, int y, std::size_t path) { p.aov->read_debug(records[path], p.image.at(x, y)); });
    }
}

void Film::take(RenderResult& result) {
    result.beauty = std::move(beauty_);
    result.view = std::move(view_);
    for (Plane& p : planes_) {
        const ExrType type = p.aov->storage == LayerStorage::ids         ? ExrType::uint32
                             : settings_.half_color && p.aov->is_color() ? ExrType::half
                                                                         : ExrType::float32;
        result.aovs.push_back({p.aov->channel_names(), std::move(p.image), type, std::string(p.aov->name)});
    }
    planes_.clear();
}

void Film::take(RenderResult& result, const ivec2& first, const ivec2& size) {
    take(result);
    if (first == ivec2(0) && size == ivec2(settings_.width, settings_.height)) return;
    result.beauty = part_of(result.beauty, first, size);
    if (!result.view.pixels.empty()) result.view = part_of(result.view, first, size);
    for (ExrLayer& layer : result.aovs) layer.image = part_of(layer.image, first, size);
}

}  // namespace halflight
