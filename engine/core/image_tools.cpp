#include "engine/core/image_tools.h"

#include <algorithm>
#include <span>

namespace halflight {
namespace {

/// Blurs a line of `count` pixels that are `stride` values apart.
void blur_line(const float* from, float* to, int count, std::size_t stride, int radius) {
    for (int i = 0; i < count; ++i) {
        const int first = std::max(i - radius, 0), last = std::min(i + radius, count - 1);
        double sum = 0;
        for (int k = first; k <= last; ++k) sum += from[static_cast<std::size_t>(k) * stride];
        to[static_cast<std::size_t>(i) * stride] = static_cast<float>(sum / (last - first + 1));
    }
}

}  // namespace

Image rgb(const Image& rgba) {
    Image result(rgba.width, rgba.height, 3);
    for (int y = 0; y < rgba.height; ++y)
        for (int x = 0; x < rgba.width; ++x) std::copy_n(rgba.at(x, y), 3, result.at(x, y));
    return result;
}

Image part_of(const Image& image, const ivec2& first, const ivec2& size) {
    Image result(size.x, size.y, image.channels);
    const auto row = static_cast<std::ptrdiff_t>(size.x) * image.channels;
    for (int y = 0; y < size.y; ++y) std::copy_n(image.at(first.x, first.y + y), row, result.at(0, y));
    return result;
}

Image placed(const Image& image, const ivec2& at, const ivec2& size) {
    Image result(size.x, size.y, image.channels);
    const ivec2 first = glm::max(at, 0), last = glm::min(at + ivec2(image.width, image.height), size);
    if (last.x <= first.x) return result;
    for (int y = first.y; y < last.y; ++y)
        std::copy_n(image.at(first.x - at.x, y - at.y), std::ptrdiff_t(last.x - first.x) * image.channels,
                    result.at(first.x, y));
    return result;
}

Image straight(Image premultiplied) {
    for (std::size_t i = 0; i + 3 < premultiplied.pixels.size(); i += 4) {
        float* const pixel = &premultiplied.pixels[i];
        for (int c = 0; c < 3; ++c) pixel[c] = pixel[3] > 0 ? pixel[c] / pixel[3] : 0;
    }
    return premultiplied;
}

bool same_bits(const Image& a, const Image& b) {
    return a.width == b.width && a.height == b.height && a.channels == b.channels &&
           std::ranges::equal(std::as_bytes(std::span(a.pixels)), std::as_bytes(std::span(b.pixels)));
}

Image box_blur(const Image& image, int radius) {
    Image rows(image.width, image.height, image.channels), both = rows;
    const auto channels = static_cast<std::size_t>(image.channels);
    for (int y = 0; y < image.height; ++y)
        for (int c = 0; c < image.channels; ++c)
            blur_line(image.at(0, y) + c, rows.at(0, y) + c, image.width, channels, radius);
    for (int x = 0; x < image.width; ++x)
        for (int c = 0; c < image.channels; ++c)
            blur_line(rows.at(x, 0) + c, both.at(x, 0) + c, image.height,
                      channels * static_cast<std::size_t>(image.width), radius);
    return both;
}

}  // namespace halflight
