#include "tools/view/layer_view.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <functional>
#include <string_view>

#include "engine/core/hash.h"
#include "engine/core/math.h"
#include "engine/core/metrics.h"
#include "tools/common/color_map.h"

namespace halflight::view {
namespace {

const AovInfo& info(const std::string& view) {
    return *std::ranges::find(known_aovs(), view, &AovInfo::name);
}

/// Returns the image whose pixels have the colour f(channels of the pixel, x, y).
template <class F>
Image mapped(const Image& image, const F& f) {
    Image out(image.width, image.height, 3);
    for (int y = 0; y < image.height; ++y) {
        for (int x = 0; x < image.width; ++x) {
            const vec3 color = f(image.at(x, y), x, y);
            std::copy_n(&color.x, 3, out.at(x, y));
        }
    }
    return out;
}

/// Returns a quantile of the finite values; 0 without finite values.
float percentile(std::vector<float> values, double share) {
    std::erase_if(values, [](float v) { return !std::isfinite(v); });
    if (values.empty()) return 0;
    const auto at = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
    std::nth_element(values.begin(), at, values.end());
    return *at;
}

/// Rounds up to 1, 2 or 5 times a power of ten; 1 for 0.
float round_up(float value) {
    if (!(value > 0)) return 1;
    const float power = std::pow(10.0f, std::floor(std::log10(value)));
    for (const float step : {1.0f, 2.0f, 5.0f})
        if (value <= step * power) return step * power;
    return 10 * power;
}

/// Maps f(channels of the pixel, x, y) to a magma scale, which is logarithmic if `decades` > 0.
template <class F>
DisplayImage on_scale(const Image& image, const std::string& unit, const F& f, int decades = 0) {
    Image values(image.width, image.height, 1);
    for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x) *values.at(x, y) = f(image.at(x, y), x, y);
    Scale scale{round_up(percentile(values.pixels, 0.99)), unit};
    if (decades == 0) return {magma(values, double{scale.top}), true, scale};
    scale.bottom = scale.top * std::pow(10.0f, static_cast<float>(-decades));
    for (float& v : values.pixels)
        v = 1 + std::log10(std::max(v, scale.bottom) / scale.top) / static_cast<float>(decades);
    return {magma(values, 1), true, scale};
}

vec3 color_of_id(std::uint32_t id) {
    Hash hash;
    hash.add(id);
    const std::uint64_t h = hash.value();
    const auto part = [&](int shift) { return 0.2f + 0.8f * static_cast<float>(h >> shift & 0xff) / 255; };
    return {part(0), part(8), part(16)};
}

Image positions(const Image& image) {
    vec3 lower(kInfinity), upper(-kInfinity);
    for (int y = 0; y < image.height; ++y) {
        for (int x = 0; x < image.width; ++x) {
            const float* p = image.at(x, y);
            lower = glm::min(lower, vec3(p[0], p[1], p[2]));
            upper = glm::max(upper, vec3(p[0], p[1], p[2]));
        }
    }
    const vec3 extent = glm::max(upper - lower, vec3(1e-30f));
    return mapped(image, [&](const float* p, int, int) { return (vec3(p[0], p[1], p[2]) - lower) / extent; });
}

Image motions(const Image& image) {
    constexpr float kLeast = 0.1f;  // minimum scale of motion, pixels; less is rounding
    std::vector<float> lengths;
    for (std::size_t i = 0; i + 1 < image.pixels.size(); i += 2)
        lengths.push_back(std::hypot(image.pixels[i], image.pixels[i + 1]));
    const float top = std::max(percentile(std::move(lengths), 0.99), kLeast);
    return mapped(image, [&](const float* p, int, int) {
        return glm::clamp(vec3(0.5f + 0.5f * p[0] / top, 0.5f + 0.5f * p[1] / top, 0.5f), 0.0f, 1.0f);
    });
}

DisplayImage relative_errors(const Image& variance, const Image& beauty) {
    return on_scale(variance, "standard error / value", [&](const float* v, int x, int y) {
        const float* b = beauty.at(x, y);
        const float mean = luminance(vec3(b[0], b[1], b[2]));
        return std::sqrt(luminance(vec3(v[0], v[1], v[2])) / (mean * mean + static_cast<float>(kRelativeEpsilon)));
    });
}

DisplayImage data_picture(const std::string& view, const Image& image) {
    constexpr float kNoSurface = 1e9f;  // depths beyond it belong to no surface
    constexpr int kVarianceDecades = 4;
    if (view == "variance")
        return on_scale(
            image, "variance of luminance", [](const float* v, int, int) { return luminance(vec3(v[0], v[1], v[2])); },
            kVarianceDecades);
    if (view == "normal")
        return {mapped(image, [](const float* p, int, int) { return 0.5f + 0.5f * vec3(p[0], p[1], p[2]); }), true};
    if (view == "position") return {positions(image), true};
    if (view == "motion") return {motions(image), true};
    if (view == "depth")
        return on_scale(image, "world units",
                        [](const float* p, int, int) { return *p < kNoSurface ? *p : kInfinity; });
    if (view == "ids")
        return {mapped(image,
                       [](const float* p, int, int) {
                           const auto id = std::bit_cast<std::uint32_t>(p[0]);
                           return id == ~0u ? vec3(0) : color_of_id(id);
                       }),
                true};
    if (view == "residency") {
        constexpr float kAbsent = 0.2f;  // brightness of pages that are not in the pool
        return {mapped(image,
                       [](const float* p, int, int) {
                           const vec3 color = p[0] > 0 ? color_of_id(static_cast<std::uint32_t>(p[0])) : vec3(0);
                           return p[1] > 0 ? color : kAbsent * color;
                       }),
                true};
    }
    return on_scale(image, view == "culling" ? "nodes and leaves of the tile's list" : view,
                    [&](const float* p, int, int) {
                        float sum = 0;
                        for (int c = 0; c < image.channels; ++c) sum += p[c];
                        return sum;
                    });
}

const Image& layer(std::string_view aov, const std::vector<std::string>& aovs, const RenderResult& result) {
    return result.aovs.at(static_cast<std::size_t>(std::ranges::find(aovs, aov) - aovs.begin())).image;
}

/// Returns the median of a channel over the 3x3 pixels around (x, y) that are inside the image.
float median_around(const Image& image, int x, int y, int channel) {
    std::array<float, 9> values{};
    auto end = values.begin();
    for (int j = std::max(y - 1, 0); j <= std::min(y + 1, image.height - 1); ++j)
        for (int i = std::max(x - 1, 0); i <= std::min(x + 1, image.width - 1); ++i) *end++ = image.at(i, j)[channel];
    const auto middle = values.begin() + (end - values.begin()) / 2;
    std::nth_element(values.begin(), middle, end);
    return *middle;
}

Image sum_of(const LayerView& layer_view, const std::vector<std::string>& aovs, const RenderResult& result) {
    Image sum(result.beauty.width, result.beauty.height, 3);
    for (std::size_t i = 0; i < kComponents.size(); ++i) {
        if (!layer_view.components[i]) continue;
        const Image& part = layer(kComponents[i], aovs, result);
        std::ranges::transform(sum.pixels, part.pixels, sum.pixels.begin(), std::plus());
    }
    return sum;
}

}  // namespace

bool LayerView::is_sum() const {
    return layer == kFinal && std::ranges::count(components, false) > 0;
}

std::vector<std::string> layer_view_names() {
    std::vector<std::string> all = {kFinal, kError};
    for (const AovInfo& aov : known_aovs()) all.emplace_back(aov.name);
    all.emplace_back(kLuminance);
    return all;
}

std::vector<std::string> required_aovs(const LayerView& layer_view) {
    if (layer_view.is_sum()) return {kComponents.begin(), kComponents.end()};
    if (layer_view.layer == kFinal || layer_view.layer == kLuminance) return {};
    if (layer_view.layer == kError) return {"variance"};
    return {layer_view.layer};
}

std::string description(const std::string& view) {
    if (view == kFinal) return "the rendered picture";
    if (view == kLuminance) return "luminance of the rendered picture, before exposure and view transform";
    if (view == kError) return "standard error of each pixel's mean luminance, relative to its value";
    return std::string(info(view).description);
}

DisplayImage display_image(const LayerView& layer_view, const std::vector<std::string>& aovs,
                           const RenderResult& result) {
    const std::string& view = layer_view.layer;
    if (layer_view.is_sum()) return {sum_of(layer_view, aovs, result), false};
    if (view == kFinal) return {result.beauty, false};
    if (view == kLuminance) {
        constexpr int kDecades = 4;
        return on_scale(
            result.beauty, "luminance", [](const float* p, int, int) { return luminance(vec3(p[0], p[1], p[2])); },
            kDecades);
    }
    if (view == kError) return relative_errors(layer("variance", aovs, result), result.beauty);
    const AovInfo& aov = info(view);
    const Image& image = layer(view, aovs, result);
    if (aov.is_color()) return {image, false};
    if (aov.is_matte())
        // Values are pairs of id and coverage; the first belongs to the object that covers most of the pixel.
        return {
            mapped(image, [](const float* p, int,
                             int) { return std::min(p[1], 1.0f) * color_of_id(std::bit_cast<std::uint32_t>(p[0])); }),
            true};
    return data_picture(view, image);
}

RenderResult shown_result(const LayerView& layer_view, const std::vector<std::string>& aovs,
                          const RenderResult& result) {
    RenderResult shown;
    shown.beauty = result.beauty;
    shown.attributes = result.attributes;
    shown.stats = result.stats;
    for (const std::string& aov : required_aovs(layer_view))
        shown.aovs.push_back(result.aovs.at(static_cast<std::size_t>(std::ranges::find(aovs, aov) - aovs.begin())));
    if (!layer_view.is_sum()) return shown;
    const Image sum = sum_of(layer_view, aovs, result);
    for (int y = 0; y < sum.height; ++y)
        for (int x = 0; x < sum.width; ++x) std::copy_n(sum.at(x, y), 3, shown.beauty.at(x, y));
    return shown;
}

const std::vector<std::string>& biases_of(const LayerView& layer_view, const RenderStats& stats) {
    const bool of_picture = (layer_view.layer == kFinal && !layer_view.is_sum()) || layer_view.layer == kError ||
                            layer_view.layer == kLuminance;
    return of_picture ? stats.biases : stats.layer_biases;
}

std::vector<std::string> bias_lines(const std::vector<std::string>& biases) {
    constexpr std::string_view kPreview = "preview: ";
    std::vector<std::string> lines;
    std::string of_previews;
    for (const std::string& bias : biases) {
        if (!bias.starts_with(kPreview))
            lines.push_back("biased: " + bias);
        else
            of_previews += (of_previews.empty() ? bias : "; " + bias.substr(kPreview.size()));
    }
    if (!of_previews.empty()) lines.insert(lines.begin(), std::move(of_previews));
    return lines;
}

std::optional<double> estimated_relmse(const std::vector<std::string>& aovs, const RenderResult& result, int samples,
                                       const PixelWindow& window) {
    if (samples < kMinSamples || std::ranges::find(aovs, "variance") == aovs.end()) return std::nullopt;
    const Image& variance = layer("variance", aovs, result);
    double sum = 0;
    for (int y = window.first.y; y < window.end.y; ++y) {
        for (int x = window.first.x; x < window.end.x; ++x) {
            for (int c = 0; c < 3; ++c) {
                const double value{median_around(result.beauty, x, y, c)};
                sum += double{variance.at(x, y)[c]} / (value * value + kRelativeEpsilon);
            }
        }
    }
    return sum / (3.0 * window.size().x * window.size().y);
}

std::optional<double> estimated_relmse(const std::vector<std::string>& aovs, const RenderResult& result) {
    return estimated_relmse(aovs, result, result.stats.samples, {{0, 0}, {result.beauty.width, result.beauty.height}});
}

}  // namespace halflight::view
