#include "renderer/film.h"

#include <algorithm>
#include <array>
#include <bit>

#include "engine/core/error.h"
#include "renderer/frame_constants.h"
#include "shaders/shared/pixel_order.h"
#include "shaders/shared/rays.h"

namespace halflight {
namespace {

bool is_color(const AovInfo& a) {
    return a.channels == "RGB" && a.name != "variance";
}

/// Names of the EXR channels. Depth is the standard's plain "Z".
std::vector<std::string> channel_names(const AovInfo& a) {
    if (a.name == "ids") return {"ids.instance", "ids.primitive", "ids.material"};
    if (a.name == "culling") return {"culling.leaves", "culling.others"};
    if (a.name == "depth") return {"Z"};
    if (const std::string_view layer = cryptomatte_layer(a.name); !layer.empty()) return cryptomatte_channels(layer);
    std::vector<std::string> names;
    for (char c : a.channels) names.push_back(std::string(a.name) + "." + c);
    return names;
}

/// Calls f(x, y of the whole image, path) for every pixel of the band that is in the image.
template <class F>
void for_each_pixel(const Band& band, F&& f) {
    const int rows = std::min(band.rows, band.image.y - band.y);
    for (int y = 0; y < rows; ++y)
        for (int x = 0; x < band.image.x; ++x)
            f(x, band.y + y, std::size_t{shared::path_of_pixel({x, y}, band.tiles())});
}

/// Mean of three channels of sums that has `stride` doubles per path.
void add_mean(const Band& band, Image* to, const std::vector<double>& sums, std::size_t stride, std::size_t first,
              int samples) {
    if (!to || sums.empty()) return;
    for_each_pixel(band, [&](int x, int y, std::size_t path) {
        for (std::size_t c = 0; c < 3; ++c)
            to->at(x, y)[c] = static_cast<float>(sums[path * stride + first + c] / samples);
    });
}

}  // namespace

bool asked_for(const RenderSettings& s, std::initializer_list<std::string_view> names) {
    return std::any_of(s.aovs.begin(), s.aovs.end(),
                       [&](const std::string& a) { return std::find(names.begin(), names.end(), a) != names.end(); });
}

std::size_t layer_channels(const AovInfo& aov) {
    return channel_names(aov).size();
}

std::size_t film_bytes(const RenderSettings& s) {
    std::size_t channels = s.want_view ? 8 : 4;
    for (const std::string& aov : s.aovs) channels += layer_channels(*find_aov(aov));
    return channels * sizeof(float);
}

Film::Film(const RenderSettings& settings, const TraceTables& tables)
    : settings_(settings), tables_(tables), beauty_(settings.width, settings.height, 4) {
    if (settings.want_view) view_ = Image(settings.width, settings.height, 4);
    choose(settings.aovs);
}

void Film::choose(const std::vector<std::string>& aovs) {
    planes_.clear();
    for (const std::string& name : aovs) {
        const AovInfo* const aov = find_aov(name);
        if (!aov || (!aov->at_any_time && !asked_for(settings_, {name})))
            throw Error("render settings", "AOV \"{}\" was not asked for before the samples were made", name);
        planes_.push_back(
            {name, Image(settings_.width, settings_.height, static_cast<int>(channel_names(*aov).size()))});
    }
}

bool Film::wants(std::initializer_list<std::string_view> names) const {
    return std::ranges::any_of(
        planes_, [&](const Plane& p) { return std::ranges::find(names, std::string_view(p.aov)) != names.end(); });
}

Image* Film::plane(std::string_view aov) {
    const auto found = std::find_if(planes_.begin(), planes_.end(), [&](const Plane& p) { return p.aov == aov; });
    return found == planes_.end() ? nullptr : &found->image;
}

double Film::Sums::beauty(std::size_t path, std::size_t channel) const {
    double sum = emission[path * 4 + channel];
    for (const std::vector<double>* light : {&direct, &indirect})
        if (!light->empty()) sum += (*light)[path * 6 + channel] + (*light)[path * 6 + 3 + channel];
    return sum;
}

void Film::add_sums(const Band& band, int samples, const Sums& sums) {
    add_mean(band, plane("emission"), sums.emission, 4, 0, samples);
    add_mean(band, plane("direct_diffuse"), sums.direct, 6, 0, samples);
    add_mean(band, plane("direct_glossy"), sums.direct, 6, 3, samples);
    add_mean(band, plane("indirect_diffuse"), sums.indirect, 6, 0, samples);
    add_mean(band, plane("indirect_glossy"), sums.indirect, 6, 3, samples);
    add_mean(band, plane("albedo"), sums.features, 6, 0, samples);
    add_mean(band, plane("normal"), sums.features, 6, 3, samples);
    if (Image* count = plane("samples"))
        for_each_pixel(band, [&](int x, int y, std::size_t) { *count->at(x, y) = static_cast<float>(samples); });
    if (Image* variance = plane("variance"); variance && samples > 1) {
        for_each_pixel(band, [&](int x, int y, std::size_t path) {
            for (std::size_t c = 0; c < 3; ++c) {
                const double sum = sums.beauty(path, c);
                const double of_samples =
                    std::max(sums.squares[path * 3 + c] - sum * sum / samples, 0.0) / (samples - 1);
                variance->at(x, y)[c] = static_cast<float>(of_samples / samples);
            }
        });
    }
}

void Film::add_pictures(const Band& band, const std::vector<float>& beauty, const std::vector<float>& view) {
    const int rows = std::min(band.rows, band.image.y - band.y);
    const auto count = static_cast<std::ptrdiff_t>(rows) * band.image.x * 4;
    std::copy_n(beauty.begin(), count, beauty_.at(0, band.y));
    if (!view.empty()) std::copy_n(view.begin(), count, view_.at(0, band.y));
}

void Film::replace_pictures(Image beauty, const ViewProcessor* view) {
    beauty_ = std::move(beauty);
    if (view) view_ = view->apply(beauty_);
}

void Film::add_ids(const Band& band, int samples, std::string_view aov, const IdCoverage& coverage) {
    Image* ids = plane(aov);
    if (!ids) return;
    for_each_pixel(band, [&](int x, int y, std::size_t path) {
        coverage.rank(path, samples, std::span<float, 2 * kCryptomatteRanks>(ids->at(x, y), 2 * kCryptomatteRanks));
    });
}

void Film::add_data(const Band& band, const std::vector<shared::AovRecord>& records) {
    Image* position = plane("position");
    Image* depth = plane("depth");
    Image* motion = plane("motion");
    Image* ids = plane("ids");
    for_each_pixel(band, [&](int x, int y, std::size_t path) {
        const shared::AovRecord& r = records[path];
        const bool seen = r.triangle != shared::kMiss;
        if (position) {
            const vec3 world = seen ? vec3(dvec3(r.position) + tables_.origin) : vec3(0);
            std::copy_n(&world.x, 3, position->at(x, y));
        }
        if (depth) *depth->at(x, y) = r.depth;
        if (motion) std::copy_n(&r.motion.x, 2, motion->at(x, y));
        if (ids) {
            const TriangleSource source = seen ? source_of(tables_, r.instance, r.triangle) : TriangleSource{~0u, ~0u};
            const std::uint32_t material = seen ? tables_.triangles[r.triangle].w & kTriangleMaterialMask : ~0u;
            float* to = ids->at(x, y);
            to[0] = std::bit_cast<float>(source.instance);
            to[1] = std::bit_cast<float>(source.triangle);
            to[2] = std::bit_cast<float>(material);
        }
    });
}

void Film::add_surface_motion(const Band& band, const std::vector<shared::AovRecord>& records,
                              const PreviousSurfaces& surfaces, const Camera& previous) {
    Image* motion = plane("motion");
    if (!motion) return;
    const dvec2 size(band.image);
    const dmat4 to_clip = world_to_clip(previous, band.image, 1);  // depth is not looked at
    for_each_pixel(band, [&](int x, int y, std::size_t path) {
        const shared::AovRecord& r = records[path];
        if (r.triangle == shared::kMiss) return;
        const TriangleSource source = source_of(tables_, r.instance, r.triangle);
        if (!surfaces.moved(source.instance)) return;
        const dvec3 before = surfaces.before(source.instance, source.triangle, dvec3(r.position) + tables_.origin);
        const dvec4 clip = to_clip * dvec4(before, 1);
        if (!(clip.w > 0)) return;  // behind the camera it had no place in the picture
        const dvec2 there = dvec2(0.5 + 0.5 * clip.x / clip.w, 0.5 - 0.5 * clip.y / clip.w) * size;
        motion->at(x, y)[0] = static_cast<float>(x + 0.5 - there.x);
        motion->at(x, y)[1] = static_cast<float>(y + 0.5 - there.y);
    });
}

void Film::add_debug(const Band& band, const std::vector<shared::DebugRecord>& records) {
    Image* nodes = plane("nodes");
    Image* culling = plane("culling");
    for_each_pixel(band, [&](int x, int y, std::size_t path) {
        const shared::DebugRecord& r = records[path];
        if (nodes) *nodes->at(x, y) = static_cast<float>(r.nodes);
        if (culling) {
            culling->at(x, y)[0] = static_cast<float>(r.leaves);
            culling->at(x, y)[1] = static_cast<float>(r.others);
        }
    });
}

void Film::take(RenderResult& result) {
    result.beauty = std::move(beauty_);
    result.view = std::move(view_);
    for (Plane& p : planes_) {
        const AovInfo& a = *find_aov(p.aov);
        const ExrType type = a.name == "ids"                       ? ExrType::uint32
                             : settings_.half_color && is_color(a) ? ExrType::half
                                                                   : ExrType::float32;
        result.aovs.push_back({channel_names(a), std::move(p.image), type});
    }
    planes_.clear();
}

}  // namespace halflight
