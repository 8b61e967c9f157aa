#include "tools/measure/compare/compare.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <set>

#include "engine/core/error.h"
#include "engine/core/math.h"
#include "engine/core/metrics.h"

namespace halflight::compare {
namespace {

constexpr float kNoValue = std::numeric_limits<float>::quiet_NaN();

/// Compares two values; NaN equals NaN, ids are compared by their bits.
bool same_value(float a, float b, LayerKind kind) {
    if (kind == LayerKind::ids) return std::bit_cast<std::uint32_t>(a) == std::bit_cast<std::uint32_t>(b);
    return a == b || (std::isnan(a) && std::isnan(b));
}

/// Two layers with zeros in place of pixels that are not finite in either.
struct Pair {
    Image image, reference;
    std::vector<bool> finite;  // whether both values of a pixel are finite
};

Pair count_differences(const Image& image, const Image& reference, LayerResult& result) {
    Pair pair{image, reference, {}};
    const auto channels = static_cast<std::size_t>(image.channels);
    result.pixels = image.pixels.size() / channels;
    for (std::size_t p = 0; p < result.pixels; ++p) {
        bool same = true, finite[2] = {true, true};
        for (std::size_t i = p * channels; i < (p + 1) * channels; ++i) {
            const float a = image.pixels[i], b = reference.pixels[i];
            const bool same_here = same_value(a, b, result.kind);
            same = same && same_here;
            if (result.kind == LayerKind::ids || (std::isfinite(a) && std::isfinite(b))) continue;
            finite[0] = finite[0] && std::isfinite(a), finite[1] = finite[1] && std::isfinite(b);
            result.not_finite_alike = result.not_finite_alike && same_here;
        }
        result.different += !same;
        result.not_finite[0] += !finite[0], result.not_finite[1] += !finite[1];
        pair.finite.push_back(finite[0] && finite[1]);
        if (pair.finite.back()) continue;
        std::fill_n(pair.image.pixels.begin() + static_cast<std::ptrdiff_t>(p * channels), channels, 0.0f);
        std::fill_n(pair.reference.pixels.begin() + static_cast<std::ptrdiff_t>(p * channels), channels, 0.0f);
    }
    return pair;
}

/// Returns a layer that is compared by value. Whole numbers become floats.
Layer as_values(Layer layer) {
    layer.kind = LayerKind::data;
    for (float& v : layer.image.pixels)
        if (layer.whole_numbers) v = static_cast<float>(std::bit_cast<std::uint32_t>(v));
    return layer;
}

/// Returns the linear value of an sRGB-encoded one (IEC 61966-2-1).
float srgb_decoded(float v) {
    return v <= 0.04045f ? v / 12.92f : std::pow((v + 0.055f) / 1.055f, 2.4f);
}

/// Returns the layer in linear Rec.709, the input of FLIP.
Image viewed(Image image, const PictureFile& file) {
    if (file.encoded)
        for (float& v : image.pixels) v = srgb_decoded(v);
    const mat3 matrix(rgb_conversion(file.primaries, kRec709));
    for (std::size_t i = 0; i + 2 < image.pixels.size() && image.channels == 3; i += 3) {
        const vec3 c = matrix * vec3(image.pixels[i], image.pixels[i + 1], image.pixels[i + 2]);
        for (std::size_t k = 0; k < 3; ++k) image.pixels[i + k] = c[static_cast<int>(k)];
    }
    return image;
}

Image largest_difference_map(const Image& a, const Image& b) {
    Image map(a.width, a.height, 1);
    const auto channels = static_cast<std::size_t>(a.channels);
    for (std::size_t i = 0; i < a.pixels.size(); ++i) {
        float& largest = map.pixels[i / channels];
        largest = std::max(largest, std::abs(a.pixels[i] - b.pixels[i]));
    }
    return map;
}

Image map_of(Metric metric, const Pair& pair, const PictureFile& file, double pixels_per_degree) {
    if (metric == Metric::mse) return squared_error_map(pair.image, pair.reference);
    if (metric == Metric::relmse) return relative_squared_error_map(pair.image, pair.reference);
    if (metric == Metric::max) return largest_difference_map(pair.image, pair.reference);
    const Image a = viewed(pair.image, file), b = viewed(pair.reference, file);
    return file.encoded ? flip_map(a, b, pixels_per_degree) : hdr_flip_map(a, b, pixels_per_degree);
}

Verdict judged(double value, Metric metric, const CompareArguments& a) {
    const double none = std::numeric_limits<double>::infinity();
    if (value > a.fail.at(metric).value_or(none)) return Verdict::fail;
    return value > a.warn.at(metric).value_or(none) ? Verdict::warn : Verdict::same;
}

LayerResult compare_layers(const Layer& image, const Layer& reference, const PictureFile& file,
                           const CompareArguments& arguments) {
    LayerResult result;
    result.name = image.name;
    result.kind = image.kind;
    result.origin = image.origin;
    const Pair pair = count_differences(image.image, reference.image, result);
    const auto finite = static_cast<double>(std::ranges::count(pair.finite, true));
    const bool must_be_same = image.kind == LayerKind::ids || (!arguments.warn.any() && !arguments.fail.any());
    if ((must_be_same && result.different > 0) || !result.not_finite_alike) result.verdict = Verdict::fail;
    if (image.kind == LayerKind::ids) return result;
    for (const Metric metric : arguments.metrics) {
        if (finite == 0 || (metric == Metric::flip && image.kind != LayerKind::color)) continue;
        MetricResult& m = result.metrics.emplace_back();
        m.metric = metric;
        m.map = map_of(metric, pair, file, arguments.pixels_per_degree);
        double sum = 0, largest = 0;
        std::vector<float> values;
        for (std::size_t p = 0; p < result.pixels; ++p) {
            if (pair.finite[p]) {
                sum += values.emplace_back(m.map.pixels[p]);
                largest = std::max<double>(largest, values.back());
            } else {
                m.map.pixels[p] = kNoValue;
            }
        }
        m.value = metric == Metric::max ? largest : sum / finite;
        m.worst_share = worst_share(values);
        m.verdict = must_be_same && m.value > 0 ? Verdict::fail : judged(m.value, metric, arguments);
        result.verdict = std::max(result.verdict, m.verdict);
    }
    return result;
}

}  // namespace

const char* name(Metric metric) {
    constexpr const char* kNames[] = {"mse", "relmse", "flip", "max"};
    return kNames[static_cast<int>(metric)];
}

const char* name(Verdict verdict) {
    constexpr const char* kNames[] = {"same", "warn", "fail", "sizes differ", "file error"};
    return kNames[static_cast<int>(verdict)];
}

std::optional<double> Thresholds::at(Metric metric) const {
    const auto own = of.find(metric);
    return own == of.end() ? all : own->second;
}

Comparison compare(const PictureFile& image, const PictureFile& reference, const CompareArguments& arguments) {
    if (image.encoded != reference.encoded)
        throw Error(image.name, "cannot be compared with {}: one is encoded for a display, the other is scene-linear",
                    reference.name);
    if (!same_space(image.primaries, reference.primaries))
        throw Error(image.name, "cannot be compared with {}: their colours have different primaries", reference.name);
    const auto wanted = [&](const std::string& layer) {
        return arguments.layers.empty() || std::ranges::find(arguments.layers, layer) != arguments.layers.end();
    };
    for (const std::string& layer : arguments.layers)
        if (!image.find(layer) && !reference.find(layer)) throw Error(layer, "is a layer of neither picture");

    Comparison result;
    for (const Layer& layer : image.layers) {
        if (!wanted(layer.name)) continue;
        const Layer* other = reference.find(layer.name);
        if (other && other->channels == layer.channels && other->whole_numbers != layer.whole_numbers)
            result.layers.push_back(compare_layers(as_values(layer), as_values(*other), image, arguments));
        else if (other && other->channels == layer.channels &&
                 (other->kind == LayerKind::ids) == (layer.kind == LayerKind::ids))
            result.layers.push_back(compare_layers(layer, *other, image, arguments));
        else
            result.missing[1].push_back(layer.name);
    }
    for (const Layer& layer : reference.layers)
        if (wanted(layer.name) && !image.find(layer.name)) result.missing[0].push_back(layer.name);
    for (const LayerResult& layer : result.layers) result.verdict = std::max(result.verdict, layer.verdict);
    if (!result.missing[0].empty() || !result.missing[1].empty())
        result.verdict = std::max(result.verdict, Verdict::fail);
    return result;
}

}  // namespace halflight::compare
