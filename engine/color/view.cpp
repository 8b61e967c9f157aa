#include <algorithm>
#include <cmath>

#include "engine/color/ocio.h"
#include "engine/core/error.h"

namespace halflight {
namespace {

// largest half float: far beyond display white, and small enough that matrices cannot overflow
constexpr float kLargest = 65504;

float presentable(float value) {
    return std::isnan(value) ? 0.0f : std::clamp(value, -kLargest, kLargest);
}

float displayable(float value) {
    return std::isnan(value) ? 0.0f : std::clamp(value, 0.0f, 1.0f);
}

}  // namespace

Image ViewProcessor::apply(const Image& image) const {
    if (image.channels != 3 && image.channels != 4)
        throw Error("view transform", "needs an image of 3 or 4 channels, not {}", image.channels);
    Image result = image;
    if (result.pixels.empty()) return result;
    const std::size_t stride = static_cast<std::size_t>(image.channels);
    const auto for_each_colour = [&](auto&& change) {
        for (std::size_t i = 0; i < result.pixels.size(); i += stride)
            for (std::size_t c = 0; c < 3; ++c) result.pixels[i + c] = change(result.pixels[i + c]);
    };
    for_each_colour([scale = data_->exposure_scale](float v) { return presentable(v * scale); });
    std::vector<float> alpha;
    if (stride == 4)
        for (std::size_t i = 3; i < result.pixels.size(); i += 4) alpha.push_back(result.pixels[i]);
    try {
        ocio::PackedImageDesc pixels(result.pixels.data(), result.width, result.height, result.channels);
        if (data_->looks) data_->looks_cpu->apply(pixels);
        if (data_->tone_map)
            for (std::size_t i = 0; i < result.pixels.size(); i += stride) {
                float* const p = &result.pixels[i];
                const vec3 mapped = data_->tone_map->apply({p[0], p[1], p[2]});
                for (int c = 0; c < 3; ++c) p[c] = mapped[c];
            }
        data_->cpu->apply(pixels);
    } catch (const ocio::Exception& e) {
        throw Error("view transform", e.what());
    }
    for_each_colour(displayable);
    for (std::size_t i = 0; i < alpha.size(); ++i) result.pixels[4 * i + 3] = alpha[i];
    return result;
}

float ViewProcessor::exposure_scale() const {
    return data_->exposure_scale;
}

const std::string& ViewProcessor::display() const {
    return data_->display;
}

const std::string& ViewProcessor::view() const {
    return data_->view;
}

std::string ViewProcessor::cache_id() const {
    std::string id = data_->processor->getCacheID();
    if (data_->tone_map) id += fmt::format(" {}", data_->tone_map->function);
    if (data_->looks) id += fmt::format(" {}", data_->looks->getCacheID());
    return id;
}

const std::optional<DisplayEncoding>& ViewProcessor::encoding() const {
    return data_->encoding;
}

const std::string& ViewProcessor::look() const {
    return data_->look;
}

}  // namespace halflight
