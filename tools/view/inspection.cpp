#include "tools/view/inspection.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <nlohmann/json.hpp>

#include "engine/core/image_tools.h"
#include "tools/view/region.h"
#include "tools/view/resolution.h"

namespace halflight::view {
namespace {

constexpr std::uint32_t kNone = ~0u;
constexpr float kNothing = 1e9f;  // depths beyond it belong to no surface

/// Returns a layer's channels at a pixel; null without the layer.
const float* channels(const Picture& picture, const char* aov, const ivec2& at) {
    const auto found = std::ranges::find(picture.aovs, aov);
    if (found == picture.aovs.end()) return nullptr;
    return picture.result.aovs[static_cast<std::size_t>(found - picture.aovs.begin())].image.at(at.x, at.y);
}

/// Returns the pixel of a picture, which may be coarse, at a pixel of the whole picture.
ivec2 place(const Image& image, const ivec2& size, const ivec2& pixel) {
    return glm::min(pixel * ivec2(image.width, image.height) / size, ivec2(image.width, image.height) - 1);
}

std::string text_of(const vec3& v) {
    return fmt::format("{:.5g}, {:.5g}, {:.5g}", v.x, v.y, v.z);
}

}  // namespace

std::optional<Probe> probe(const Picture& newest, const Picture* complete, const ivec2& size, const ivec2& pixel) {
    if (pixel.x < 0 || pixel.y < 0 || pixel.x >= size.x || pixel.y >= size.y) return std::nullopt;
    Probe p{.pixel = pixel};
    const Image& beauty = newest.result.beauty;
    const ivec2 at = place(beauty, size, pixel);
    const float* value = beauty.at(at.x, at.y);
    p.value = vec3(value[0], value[1], value[2]);
    const bool in_region = newest.region && contains(newest.region->window, pixel);
    p.samples = in_region ? newest.samples() : newest.result.stats.samples;
    if (!complete || complete->view != newest.view) return p;
    const ivec2 there = place(complete->result.beauty, size, pixel);
    const auto layer = [&](const char* aov) { return channels(*complete, aov, there); };
    const auto triple = [](const float* v) { return v ? std::optional(vec3(v[0], v[1], v[2])) : std::nullopt; };
    if (const auto variance = triple(layer("variance")); variance && complete->result.stats.samples > 1)
        p.error = std::sqrt(luminance(*variance));
    const float* depth = layer("depth");
    if (!depth || !(*depth < kNothing)) return p;
    p.depth = *depth;
    p.position = triple(layer("position"));
    p.normal = triple(layer("normal"));
    p.albedo = triple(layer("albedo"));
    if (const float* ids = layer("ids"); ids && std::bit_cast<std::uint32_t>(ids[0]) != kNone)
        p.surface = {std::bit_cast<std::uint32_t>(ids[0]), std::bit_cast<std::uint32_t>(ids[1]),
                     std::bit_cast<std::uint32_t>(ids[2])};
    return p;
}

std::vector<std::pair<std::string, std::string>> lines_of(const Probe& p, const Scene& scene) {
    std::vector<std::pair<std::string, std::string>> lines;
    const auto add = [&](const char* name, std::string text) { lines.emplace_back(name, std::move(text)); };
    add("Pixel", fmt::format("{}, {}", p.pixel.x, p.pixel.y));
    add("Radiance", text_of(p.value));
    add("Luminance", fmt::format("{:.5g}", luminance(p.value)));
    add("Samples", fmt::format("{}", p.samples));
    if (p.error) add("Std. error", fmt::format("{:.3g}", *p.error));
    if (!p.depth) return lines;
    add("Depth", fmt::format("{:.5g}", *p.depth));
    if (p.position) add("Position", text_of(*p.position));
    if (p.normal) add("Normal", text_of(*p.normal));
    if (p.albedo) add("Albedo", text_of(*p.albedo));
    if (!p.surface) return lines;
    add("Instance", fmt::format("{}", p.surface->instance));
    add("Triangle", fmt::format("{}", p.surface->primitive));
    const std::size_t material = p.surface->material;
    const std::string name = material < scene.materials.size() ? scene.materials[material].name : "";
    if (p.surface->material != kNone)
        add("Material", name.empty() ? fmt::format("{}", material) : fmt::format("{} \"{}\"", material, name));
    return lines;
}

nlohmann::ordered_json json_of(const Probe& p) {
    const auto triple = [](const vec3& v) { return nlohmann::ordered_json{v.x, v.y, v.z}; };
    nlohmann::ordered_json json{{"pixel", {p.pixel.x, p.pixel.y}}, {"value", triple(p.value)}, {"samples", p.samples}};
    if (p.error) json["error"] = *p.error;
    if (p.depth) json["depth"] = *p.depth;
    if (p.position) json["position"] = triple(*p.position);
    if (p.normal) json["normal"] = triple(*p.normal);
    if (p.albedo) json["albedo"] = triple(*p.albedo);
    if (p.surface)
        json.update({{"instance", p.surface->instance},
                     {"primitive", p.surface->primitive},
                     {"material", p.surface->material}});
    return json;
}

nlohmann::ordered_json json_of(const Histogram& h) {
    return {{"lowest", Histogram::kLowest},
            {"highest", Histogram::kHighest},
            {"shares", h.shares},
            {"black", h.black},
            {"above", h.above},
            {"mean", h.mean},
            {"maximum", h.maximum}};
}

Histogram histogram(const Image& beauty, float stops) {
    Histogram h;
    const float factor = std::exp2(stops);
    double sum = 0;
    std::array<std::size_t, Histogram::kBins> counts{};
    std::size_t black = 0, above = 0;
    const auto pixels = static_cast<std::size_t>(beauty.width) * static_cast<std::size_t>(beauty.height);
    for (std::size_t i = 0; i < pixels; ++i) {
        const float* p = beauty.pixels.data() + i * static_cast<std::size_t>(beauty.channels);
        const float y = luminance(vec3(p[0], p[1], p[2]));
        sum += double{y};
        h.maximum = std::max(h.maximum, y);
        if (!(y > 0)) {
            ++black;
            continue;
        }
        if (y * factor > 1) ++above;
        const float at = (std::log2(y) - Histogram::kLowest) / (Histogram::kHighest - Histogram::kLowest);
        const int bin = std::clamp(static_cast<int>(at * Histogram::kBins), 0, Histogram::kBins - 1);
        ++counts[static_cast<std::size_t>(bin)];
    }
    const double share = pixels > 0 ? 1 / static_cast<double>(pixels) : 0;
    const auto share_of = [&](std::size_t count) { return static_cast<float>(static_cast<double>(count) * share); };
    std::ranges::transform(counts, h.shares.begin(), share_of);
    h.black = share_of(black), h.above = share_of(above);
    h.mean = static_cast<float>(sum * share);
    return h;
}

}  // namespace halflight::view
