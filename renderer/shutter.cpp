#include "renderer/shutter.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string_view>
#include <utility>

#include "engine/core/error.h"
#include "passes/picture/shadow_catcher.h"
#include "shaders/shared/denoise.h"
#include "shaders/shared/sobol.h"

namespace halflight {
namespace {

void add_weighted(std::vector<double>& sums, const std::vector<float>& values, double weight) {
    sums.resize(values.size());
    for (std::size_t i = 0; i < values.size(); ++i) sums[i] += weight * double{values[i]};
}

std::vector<float> as_floats(const std::vector<double>& sums) {
    return {sums.begin(), sums.end()};
}

/// Takes the shadows on catchers into (sign = 1) or out of (-1) a picture of RGBA. share: that of the means in the
/// sums.
template <class Means>
void shade_catchers(std::vector<double>& beauty, const Means& means, double sign, double share) {
    for (std::size_t i = 0; i < means.size() / kCatcherSums; ++i) {
        const auto* const mean = &means[i * kCatcherSums];
        if (!(mean[1] > 0)) continue;
        const double shadow = sign * share * std::max(0.0, 1 - double{mean[0]} / double{mean[1]});
        for (std::size_t c = 0; c < 3; ++c) beauty[4 * i + c] -= shadow * double{mean[3 + c]};
        beauty[4 * i + 3] += shadow * double{mean[2]};
    }
}

/// Adds attributes to those of earlier pictures; manifests are united.
void merge_attributes(std::map<std::string, std::string>& to, const std::map<std::string, std::string>& from) {
    using Json = nlohmann::json;
    for (const auto& [name, text] : from) {
        std::string& known = to[name];
        if (known == text) continue;
        if (name.ends_with("/manifest") && !known.empty()) {
            Json both = Json::parse(known);
            both.update(Json::parse(text));
            known = both.dump();
        } else {
            known = text;
        }
    }
}

void add_stats(RenderStats& all, const RenderStats& more) {
    all.samples += more.samples;
    all.prepare_seconds += more.prepare_seconds;
    all.hierarchies.kept += more.hierarchies.kept;
    all.hierarchies.refitted += more.hierarchies.refitted;
    all.hierarchies.built += more.hierarchies.built;
    all.compile_seconds += more.compile_seconds;
    all.render_seconds += more.render_seconds;
    all.paths += more.paths;
    all.gpu_bytes = std::max(all.gpu_bytes, more.gpu_bytes);
    all.batches = more.batches;
    all.raster = more.raster;
    if (!more.tracing_note.empty()) all.tracing_note = more.tracing_note;
    for (const PassTime& pass : more.passes) {
        const auto same = std::ranges::find(all.passes, pass.name, &PassTime::name);
        if (same == all.passes.end())
            all.passes.push_back(pass);
        else
            same->runs += pass.runs, same->seconds += pass.seconds;
    }
    for (const BadValues& bad : more.bad_values) {
        const auto same = std::ranges::find(all.bad_values, bad.component, &BadValues::component);
        if (same == all.bad_values.end()) {
            all.bad_values.push_back(bad);
        } else {
            same->nans += bad.nans;
            same->infinities += bad.infinities;
            same->negatives += bad.negatives;
        }
    }
}

}  // namespace

std::vector<ShutterTime> shutter_times(int samples, int times, std::uint32_t seed, std::uint32_t frame) {
    assert(1 <= times && times <= samples);
    // Shutter times have a sequence apart from those of pixels and of their common sample point (sample_view()).
    const std::uint32_t of_frame = shared::hash_combine(shared::hash_u32(seed), frame);
    const auto jitter = [&](int k) {
        return double{shared::sample_1d(shared::make_sampler(~0u, ~1u, static_cast<std::uint32_t>(k), of_frame), 0)};
    };
    std::vector<ShutterTime> all;
    for (int k = 0; k < times; ++k) {
        const auto begin = [&](int i) { return static_cast<int>(std::int64_t{i} * samples / times); };
        ShutterTime time{.first_sample = begin(k), .samples = begin(k + 1) - begin(k)};
        time.at = (time.first_sample + jitter(k) * time.samples) / samples;
        all.push_back(time);
    }
    return all;
}

ShutterMean::ShutterMean(const std::vector<std::string>& aovs, int samples) : samples_(samples) {
    for (const std::string& aov : aovs) layers_.push_back({find_aov(aov), {}, IdCoverage(0)});
}

bool ShutterMean::wants_still() const {
    return std::ranges::any_of(layers_, [](const Layer& layer) { return layer.aov->at_centre(); });
}

void ShutterMean::add(const RenderResult& picture) {
    if (picture.aovs.size() != layers_.size()) throw Error("shutter", "a picture has other layers than the others");
    const int samples = picture.stats.samples;
    const double share = double(samples) / samples_;
    add_weighted(beauty_, picture.beauty.pixels, share);
    add_weighted(catchers_, picture.catchers.pixels, share);
    shade_catchers(beauty_, picture.catchers.pixels, -1, share);
    for (std::size_t i = 0; i < layers_.size(); ++i) add_layer(layers_[i], picture.aovs[i].image, samples);
    if (result_.beauty.pixels.empty()) {
        result_ = picture;
    } else {
        add_stats(result_.stats, picture.stats);
        merge_attributes(result_.attributes, picture.attributes);
    }
}

void ShutterMean::add_layer(Layer& layer, const Image& image, int samples) {
    const double share = double(samples) / samples_;
    switch (layer.aov->merge) {
        case LayerMerge::none:
            return;
        case LayerMerge::mean:
            return add_weighted(layer.sums, image.pixels, share);
        case LayerMerge::variance:
            return add_weighted(layer.sums, image.pixels, share * share);
        case LayerMerge::sum:
            return add_weighted(layer.sums, image.pixels, 1);
        case LayerMerge::coverage:
            break;
    }
    const std::size_t stride = 2 * kCryptomatteRanks, pixels = image.pixels.size() / stride;
    if (result_.beauty.pixels.empty()) layer.coverage = IdCoverage(pixels);  // this is the first picture
    for (std::size_t p = 0; p < pixels; ++p) {
        for (std::size_t rank = 0; rank < kCryptomatteRanks; ++rank) {
            const float* const pair = &image.pixels[p * stride + 2 * rank];
            const auto count = static_cast<std::uint32_t>(std::lround(pair[1] * static_cast<float>(samples)));
            if (count > 0) layer.coverage.add(p, pair[0], count);
        }
    }
}

RenderResult ShutterMean::take(RenderResult still) {
    RenderResult result = std::move(result_);
    result.view = result.catchers = {};
    const int done = result.stats.samples;
    const double rest = done == samples_ ? 1 : double(samples_) / std::max(done, 1);
    const auto scale = [](std::vector<double>& sums, double factor) {
        for (double& value : sums) value *= factor;
    };
    if (rest != 1) {
        scale(beauty_, rest), scale(catchers_, rest);
        for (Layer& layer : layers_)
            if (layer.aov->merge == LayerMerge::mean || layer.aov->merge == LayerMerge::variance)
                scale(layer.sums, layer.aov->merge == LayerMerge::mean ? rest : rest * rest);
    }
    shade_catchers(beauty_, catchers_, 1, 1);
    if (!catchers_.empty())
        for (double& value : beauty_) value = std::max(value, 0.0);  // undoes roundings
    result.beauty.pixels = as_floats(beauty_);
    for (std::size_t i = 0; i < layers_.size(); ++i) {
        const Layer& layer = layers_[i];
        Image& image = result.aovs[i].image;
        if (layer.aov->at_centre()) {
            if (!still.aovs.empty()) image = std::move(still.aovs[i].image);
        } else if (layer.aov->is_matte()) {
            constexpr std::size_t kStride = 2 * kCryptomatteRanks;
            for (std::size_t p = 0; p < image.pixels.size() / kStride; ++p)
                layer.coverage.rank(p, done, std::span<float, kStride>(&image.pixels[p * kStride], kStride));
        } else {
            image.pixels = as_floats(layer.sums);
        }
    }
    return result;
}

namespace {

// Places in DenoiserTextures::all().
constexpr std::size_t kMean = 0, kGuide = 1, kReflectance = 2, kDiffuseAlbedo = 3, kGlossyAlbedo = 4, kLight = 5,
                      kGlossyGuide = kLight + 2 * kFilteredLights.size(), kGlossyReflectance = kGlossyGuide + 1;

bool is_light(std::size_t i) {
    return i >= kLight && i < kGlossyGuide;
}
bool is_first(std::size_t light) {
    return (light - kLight) % 2 == 0;
}
/// Returns the albedo by which a half of light is divided.
std::size_t albedo_of(std::size_t light) {
    return (light - kLight) / 2 == std::size_t(FilteredLight::glossy) ? kGlossyAlbedo : kDiffuseAlbedo;
}
/// Returns whether a texture has means over the samples that meet a surface.
bool is_of_surfaces(std::size_t i) {
    return i == kGuide || i == kReflectance || i == kGlossyGuide || i == kGlossyReflectance;
}

std::vector<vec4> texels(const gpu::Texture& texture) {
    const std::vector<float> values = texture.read_float();
    std::vector<vec4> all(values.size() / 4);
    for (std::size_t p = 0; p < all.size(); ++p)
        all[p] = {values[4 * p], values[4 * p + 1], values[4 * p + 2], values[4 * p + 3]};
    return all;
}

}  // namespace

void ShutterHalves::add(NoisyFrame& time) {
    const int n = time.samples.all, first = time.samples.first;
    const auto textures = time.pixels->all();
    sums_.resize(textures.size());
    // As ShutterMean does, so that a crop has the bits of the whole.
    add_weighted(mean_, textures[kMean]->read_float(), double(n) / of_samples_);
    std::array<std::vector<vec4>, kLight> surface;
    for (std::size_t i = kGuide; i < textures.size(); ++i) {
        if (!textures[i]) continue;
        std::vector<vec4> own = texels(*textures[i]);
        sums_[i].resize(own.size());
        covered_.resize(own.size());
        if (i < kLight) surface[i] = own;
        for (std::size_t p = 0; p < own.size(); ++p) {
            const bool covered = vec3(surface[kGuide][p]) != vec3(0);
            if (i == kGuide && covered) covered_[p] += static_cast<float>(n);
            if (is_light(i)) {
                const float half = static_cast<float>(is_first(i) ? first : n - first);
                sums_[i][p] += vec4(half * vec3(own[p]) * vec3(surface[albedo_of(i)][p]), own[p].w > 0 ? 1 : 0);
            } else {
                sums_[i][p] += (is_of_surfaces(i) && !covered ? 0 : static_cast<float>(n)) * own[p];
            }
        }
    }
    samples_ += n, first_ += first;
}

void ShutterHalves::take(const Image& picture, NoisyFrame& frame) {
    frame.has_halves = first_ > 0 && first_ < samples_;
    if (!frame.has_halves) return;
    frame.samples = {samples_, first_};
    const auto textures = frame.pixels->all();
    std::vector<float> mean = as_floats(mean_);
    const int width = textures[kMean]->desc().width;
    for (int y = 0; y < picture.height; ++y)
        std::copy_n(picture.at(0, y), 4 * picture.width,
                    &mean[4 * (std::size_t(frame.shown.y + y) * std::size_t(width) + std::size_t(frame.shown.x))]);
    textures[kMean]->upload(mean);
    const float all = static_cast<float>(samples_), share = static_cast<float>(first_) / all;
    for (std::size_t i = kGuide; i < textures.size(); ++i) {
        if (!textures[i]) continue;
        const float half = static_cast<float>(is_first(i) ? first_ : samples_ - first_);
        std::vector<vec4>& sums = sums_[i];
        for (std::size_t p = 0; p < sums.size(); ++p) {
            if (is_light(i)) {
                const vec3 light =
                    vec3(sums[p]) / (half * vec3(sums_[albedo_of(i)][p]));  // means since i = albedo_of()
                sums[p] = sums[p].w > 0 ? vec4(min(light, vec3(shared::kMostFilteredLight)), share) : vec4(0);
            } else {
                const float count = is_of_surfaces(i) ? covered_[p] : all;
                sums[p] *= count > 0 ? 1 / count : 0;
            }
        }
        textures[i]->upload({&sums[0][0], 4 * sums.size()});
    }
}

}  // namespace halflight
