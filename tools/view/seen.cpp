#include "tools/view/seen.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "engine/core/color_map.h"
#include "engine/core/hash.h"
#include "engine/core/math.h"

namespace halflight::view {
namespace {

const AovInfo& info(const std::string& view) {
    return *std::ranges::find(known_aovs(), view, &AovInfo::name);
}

bool is_color(const AovInfo& aov) {
    return aov.channels == "RGB" && aov.name != "variance";
}

/// f(pixel's channels, x, y) as the colour of each pixel.
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

/// Of the finite ones; 0 where there is none.
float percentile(std::vector<float> values, double share) {
    std::erase_if(values, [](float v) { return !std::isfinite(v); });
    if (values.empty()) return 0;
    const auto at = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
    std::nth_element(values.begin(), at, values.end());
    return *at;
}

/// f(pixel's channels, x, y) on magma's scale.
template <class F>
Image on_scale(const Image& image, const F& f) {
    Image values(image.width, image.height, 1);
    for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x) *values.at(x, y) = f(image.at(x, y), x, y);
    const float top = percentile(values.pixels, 0.99);
    return magma(values, top > 0 ? top : 1);
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
    constexpr float kLeast = 0.01f;  // pixels on the scale: less are roundings
    std::vector<float> lengths;
    for (std::size_t i = 0; i + 1 < image.pixels.size(); i += 2)
        lengths.push_back(std::hypot(image.pixels[i], image.pixels[i + 1]));
    const float top = std::max(percentile(std::move(lengths), 0.99), kLeast);
    return mapped(image, [&](const float* p, int, int) {
        return glm::clamp(vec3(0.5f + 0.5f * p[0] / top, 0.5f + 0.5f * p[1] / top, 0.5f), 0.0f, 1.0f);
    });
}

/// The standard error of a pixel's luminance, relative to that luminance as relMSE has it.
Image relative_errors(const Image& variance, const Image& beauty) {
    return on_scale(variance, [&](const float* v, int x, int y) {
        const float* b = beauty.at(x, y);
        const float mean = luminance(vec3(b[0], b[1], b[2]));
        return std::sqrt(luminance(vec3(v[0], v[1], v[2])) / (mean * mean + 0.01f));
    });
}

Image data_picture(const std::string& view, const Image& image, const Image& beauty) {
    constexpr float kNothing = 1e9f;  // of depths, beyond which there is no surface
    if (view == "variance") return relative_errors(image, beauty);
    if (view == "normal")
        return mapped(image, [](const float* p, int, int) { return 0.5f + 0.5f * vec3(p[0], p[1], p[2]); });
    if (view == "position") return positions(image);
    if (view == "motion") return motions(image);
    if (view == "depth")
        return on_scale(image, [](const float* p, int, int) { return *p < kNothing ? *p : kInfinity; });
    if (view == "ids")
        return mapped(image, [](const float* p, int, int) {
            const auto id = std::bit_cast<std::uint32_t>(p[0]);
            return id == ~0u ? vec3(0) : color_of_id(id);
        });
    return on_scale(image, [&](const float* p, int, int) {
        float sum = 0;
        for (int c = 0; c < image.channels; ++c) sum += p[c];
        return sum;
    });
}

}  // namespace

std::vector<std::string> views() {
    std::vector<std::string> all = {kFinal};
    for (const AovInfo& aov : known_aovs()) all.emplace_back(aov.name);
    return all;
}

std::vector<std::string> aovs_of(const std::string& view) {
    if (view == kFinal) return {};
    return {view};
}

std::string description(const std::string& view) {
    return view == kFinal ? "the picture" : std::string(info(view).description);
}

Seen seen(const std::string& view, const RenderResult& result) {
    if (view == kFinal) return {result.beauty, false};
    const AovInfo& aov = info(view);
    const Image& image = result.aovs.front().image;
    if (is_color(aov)) return {image, false};
    if (view.starts_with("crypto"))
        // Pairs of id and coverage: the object that covers most of the pixel.
        return {
            mapped(image, [](const float* p, int,
                             int) { return std::min(p[1], 1.0f) * color_of_id(std::bit_cast<std::uint32_t>(p[0])); }),
            true};
    return {data_picture(view, image, result.beauty), true};
}

}  // namespace halflight::view
