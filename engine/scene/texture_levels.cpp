#include "engine/scene/texture_levels.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <span>
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

/// Returns linear values of sRGB codes of 16 bits, in steps of 1/kDeepOne. Their weighted sums fit into 64 bits.
constexpr double kDeepOne = 0x1p30;
const std::vector<std::uint32_t>& deep_linear() {
    static const std::vector<std::uint32_t> table = [] {
        std::vector<std::uint32_t> values;
        for (int i = 0; i <= 65535; ++i)
            values.push_back(static_cast<std::uint32_t>(std::lround(kDeepOne * srgb_to_linear(i / 65535.0))));
        return values;
    }();
    return table;
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

std::uint32_t mean_of(std::uint64_t sum, std::uint64_t weights) {
    return static_cast<std::uint32_t>((2 * sum + weights) / (2 * weights));
}

/// Returns the mean of weighted texels as codes; `sums` are those of linear values for colours, of codes otherwise.
template <Mean mean, bool deep>
std::array<std::uint32_t, 4> mean_of(const std::array<std::uint64_t, 4>& sums, std::uint64_t weights) {
    constexpr double kLargest = deep ? 65535 : 255;
    std::array<std::uint32_t, 4> codes;
    for (std::size_t c = 0; c < 4; ++c) codes[c] = mean_of(sums[c], weights);
    if constexpr (mean == Mean::color) {
        for (std::size_t c = 0; c < 3; ++c)
            codes[c] = deep ? static_cast<std::uint32_t>(std::lround(kLargest * linear_to_srgb(codes[c] / kDeepOne)))
                            : srgb_tables().code[codes[c]];
    }
    if constexpr (mean == Mean::normal) {
        dvec3 n;
        for (int c = 0; c < 3; ++c)
            n[c] =
                2 * static_cast<double>(sums[static_cast<std::size_t>(c)]) / (kLargest * static_cast<double>(weights)) -
                1;
        const double length = glm::length(n);
        if (length < 1.0 / 255) n = dvec3(0, 0, 1);  // normals that cancel out
        if (length >= 1.0 / 255) n /= length;
        for (int c = 0; c < 3; ++c)
            codes[static_cast<std::size_t>(c)] = static_cast<std::uint32_t>(std::lround(kLargest / 2 * (n[c] + 1)));
    }
    return codes;
}

template <Mean mean, bool deep>
TextureImage next_level(const TextureImage& from) {
    constexpr std::size_t kBytes = deep ? 8 : 4;
    TextureImage to{.name = from.name,
                    .width = std::max(1, from.width / 2),
                    .height = std::max(1, from.height / 2),
                    .rgba = {},
                    .deep = deep};
    std::vector<std::uint8_t> rgba(kBytes * static_cast<std::size_t>(to.width) * static_cast<std::size_t>(to.height));
    const std::uint64_t weights = weight_sum(from.width) * weight_sum(from.height);
    const auto linear = [] {
        if constexpr (deep)
            return std::span(deep_linear());
        else
            return std::span(srgb_tables().linear);
    }();
    const auto code = [](const std::uint8_t* texel, std::size_t c) {
        return deep ? std::uint32_t{texel[c]} << 8 | texel[c + 4] : texel[c];
    };
    std::uint8_t* out = rgba.data();
    for (int y = 0; y < to.height; ++y) {
        const Taps rows = taps_of(y, from.height);
        for (int x = 0; x < to.width; ++x, out += kBytes) {
            const Taps columns = taps_of(x, from.width);
            std::array<std::uint64_t, 4> sums{};
            for (int j = 0; j < rows.count; ++j) {
                const std::size_t row = static_cast<std::size_t>(rows.first + j) * static_cast<std::size_t>(from.width);
                const std::uint8_t* in = &from.rgba[kBytes * (row + static_cast<std::size_t>(columns.first))];
                for (int i = 0; i < columns.count; ++i, in += kBytes) {
                    const std::uint64_t weight =
                        rows.weight[static_cast<std::size_t>(j)] * columns.weight[static_cast<std::size_t>(i)];
                    for (std::size_t c = 0; c < 3; ++c)
                        sums[c] += weight * (mean == Mean::color ? std::uint64_t{linear[code(in, c)]} : code(in, c));
                    sums[3] += weight * code(in, 3);
                }
            }
            const std::array<std::uint32_t, 4> codes = mean_of<mean, deep>(sums, weights);
            for (std::size_t c = 0; c < 4; ++c) {
                out[c] = static_cast<std::uint8_t>(deep ? codes[c] >> 8 : codes[c]);
                if (deep) out[c + 4] = static_cast<std::uint8_t>(codes[c] & 255);
            }
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
    const auto next = image.deep ? next_level<mean, true> : next_level<mean, false>;
    while (last->width > 1 || last->height > 1) last = &levels.emplace_back(next(*last));
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
