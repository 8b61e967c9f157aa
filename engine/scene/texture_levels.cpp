#include "engine/scene/texture_levels.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "engine/core/math.h"
#include "engine/scene/srgb.h"

namespace halflight {
namespace {

enum class Mean { color, data, normal };

/// Linear values of sRGB codes and the reverse, in steps of 1/65535, which are finer than those of the codes.
struct SrgbTables {
    std::array<std::uint16_t, 256> linear;
    std::vector<std::uint8_t> code = std::vector<std::uint8_t>(65536);  // nearest code in linear distance
    SrgbTables() {
        for (int i = 0; i < 256; ++i)
            linear[static_cast<std::size_t>(i)] =
                static_cast<std::uint16_t>(std::lround(65535 * srgb_to_linear(static_cast<std::uint8_t>(i))));
        std::size_t nearest = 0;
        for (std::size_t value = 0; value < code.size(); ++value) {
            while (nearest < 255 && 2 * value > std::size_t{linear[nearest]} + linear[nearest + 1]) ++nearest;
            code[value] = static_cast<std::uint8_t>(nearest);
        }
    }
};

const SrgbTables& srgb_tables() {
    static const SrgbTables tables;
    return tables;
}

/// The texels along an axis that a texel of the next level covers, and the lengths that it covers of them.
struct Taps {
    int first = 0, count = 0;
    std::array<std::uint64_t, 3> weight{};
};

/// Returns the taps of a texel. Their weights have the sum `size`, or 2 if that is even.
Taps taps_of(int texel, int size) {
    const int half = size / 2;
    if (size == 1) return {0, 1, {1, 0, 0}};
    if (size % 2 == 0) return {2 * texel, 2, {1, 1, 0}};
    const auto left = static_cast<std::uint64_t>(half - texel), right = static_cast<std::uint64_t>(texel + 1);
    return {2 * texel, 3, {left, static_cast<std::uint64_t>(half), right}};
}

std::uint64_t weight_sum(int size) {
    return size == 1 ? 1 : size % 2 == 0 ? 2 : static_cast<std::uint64_t>(size);
}

std::uint8_t mean_of(std::uint64_t sum, std::uint64_t weights) {
    return static_cast<std::uint8_t>((2 * sum + weights) / (2 * weights));
}

/// Returns the code of a component of a unit vector.
std::uint8_t code_of(double component) {
    return static_cast<std::uint8_t>(std::lround(127.5 * (component + 1)));
}

/// Writes the mean of weighted texels; `sums` are those of linear values for colours, of 8-bit values otherwise.
template <Mean mean>
void write_mean(const std::array<std::uint64_t, 4>& sums, std::uint64_t weights, std::uint8_t* rgba) {
    rgba[3] = mean_of(sums[3], weights);
    if constexpr (mean == Mean::color) {
        for (std::size_t c = 0; c < 3; ++c)
            rgba[c] = srgb_tables().code[static_cast<std::size_t>((2 * sums[c] + weights) / (2 * weights))];
        return;
    }
    for (std::size_t c = 0; c < 3; ++c) rgba[c] = mean_of(sums[c], weights);
    if constexpr (mean == Mean::normal) {
        dvec3 n;
        for (int c = 0; c < 3; ++c)
            n[c] =
                2 * static_cast<double>(sums[static_cast<std::size_t>(c)]) / (255.0 * static_cast<double>(weights)) - 1;
        const double length = glm::length(n);
        if (length < 1.0 / 255) n = dvec3(0, 0, 1);  // normals that cancel out
        if (length >= 1.0 / 255) n /= length;
        for (int c = 0; c < 3; ++c) rgba[c] = code_of(n[c]);
    }
}

template <Mean mean>
TextureImage next_level(const TextureImage& from) {
    TextureImage to{
        .name = from.name, .width = std::max(1, from.width / 2), .height = std::max(1, from.height / 2), .rgba = {}};
    std::vector<std::uint8_t> rgba(4 * static_cast<std::size_t>(to.width) * static_cast<std::size_t>(to.height));
    const std::uint64_t weights = weight_sum(from.width) * weight_sum(from.height);
    const std::array<std::uint16_t, 256>& linear = srgb_tables().linear;
    std::uint8_t* out = rgba.data();
    for (int y = 0; y < to.height; ++y) {
        const Taps rows = taps_of(y, from.height);
        for (int x = 0; x < to.width; ++x, out += 4) {
            const Taps columns = taps_of(x, from.width);
            std::array<std::uint64_t, 4> sums{};
            for (int j = 0; j < rows.count; ++j) {
                const std::size_t row = static_cast<std::size_t>(rows.first + j) * static_cast<std::size_t>(from.width);
                const std::uint8_t* in = &from.rgba[4 * (row + static_cast<std::size_t>(columns.first))];
                for (int i = 0; i < columns.count; ++i, in += 4) {
                    const std::uint64_t weight =
                        rows.weight[static_cast<std::size_t>(j)] * columns.weight[static_cast<std::size_t>(i)];
                    for (std::size_t c = 0; c < 3; ++c)
                        sums[c] += weight * (mean == Mean::color ? std::uint64_t{linear[in[c]]} : in[c]);
                    sums[3] += weight * in[3];
                }
            }
            write_mean<mean>(sums, weights, out);
        }
    }
    to.rgba = std::move(rgba);
    return to;
}

template <Mean mean>
std::vector<TextureImage> levels_of(const TextureImage& image) {
    std::vector<TextureImage> levels;
    levels.reserve(static_cast<std::size_t>(level_count(image.width, image.height)));
    const TextureImage* last = &image;
    while (last->width > 1 || last->height > 1) last = &levels.emplace_back(next_level<mean>(*last));
    return levels;
}

}  // namespace

LevelUses& LevelUses::operator|=(const LevelUses& other) {
    color |= other.color, data |= other.data, normal |= other.normal;
    return *this;
}

int level_count(int width, int height) {
    return std::bit_width(static_cast<unsigned>(std::max(width, height)));
}

std::size_t level_texels(int width, int height) {
    std::size_t texels = 0;
    while (width > 1 || height > 1) {
        width = std::max(1, width / 2), height = std::max(1, height / 2);
        texels += static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
    }
    return texels;
}

void add_levels(TextureImage& image, const LevelUses& uses) {
    if (uses.color) image.color_levels = levels_of<Mean::color>(image);
    if (uses.normal)
        image.data_levels = levels_of<Mean::normal>(image);
    else if (uses.data)
        image.data_levels = levels_of<Mean::data>(image);
}

}  // namespace halflight
