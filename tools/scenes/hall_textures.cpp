// Textures of the hall. Rows of texels are made while the file is compressed, so any size needs little memory.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <vector>

// jpeglib.h needs <cstdio>.
#include <jpeglib.h>

#include "engine/core/error.h"
#include "tools/scenes/exact.h"
#include "tools/scenes/hall.h"

namespace halflight::scenes {
namespace {

/// Noise of one texture set: random values on a lattice of 256 x 256, interpolated. It tiles.
class Noise {
  public:
    explicit Noise(std::uint32_t seed) : values_(kSide * kSide) {
        for (std::uint32_t i = 0; i < kSide * kSide; ++i) values_[i] = static_cast<float>(hash(i, seed)) * 0x1p-32f;
    }
    /// Returns a value in [0, 1] with `cells` cells per repeat, a power of two of at most 256.
    float at(float u, float v, int cells) const {
        const float x = u * static_cast<float>(cells), y = v * static_cast<float>(cells);
        const float fx = std::floor(x), fy = std::floor(y);
        const auto i = static_cast<std::uint32_t>(static_cast<int>(fx)),
                   j = static_cast<std::uint32_t>(static_cast<int>(fy));
        const auto mask = static_cast<std::uint32_t>(cells - 1);
        const auto value = [&](std::uint32_t a, std::uint32_t b) {
            return values_[((b & mask) * kSide + (a & mask) + static_cast<std::uint32_t>(cells) * 7) &
                           (kSide * kSide - 1)];
        };
        const float s = smooth(x - fx), t = smooth(y - fy);
        const float top = value(i, j) + s * (value(i + 1, j) - value(i, j));
        const float bottom = value(i, j + 1) + s * (value(i + 1, j + 1) - value(i, j + 1));
        return top + t * (bottom - top);
    }
    /// Returns octaves from 4 cells up, in [0, 1].
    float clouds(float u, float v, int octaves) const {
        float sum = 0, weight = 0.5f, total = 0;
        for (int i = 0, cells = 4; i < octaves; ++i, cells *= 2, weight /= 2)
            sum += weight * at(u, v, cells), total += weight;
        return sum / total;
    }

  private:
    static constexpr std::uint32_t kSide = 256;
    static float smooth(float t) { return t * t * (3 - 2 * t); }
    std::vector<float> values_;
};

float step(float low, float high, float x) {
    const float t = std::clamp((x - low) / (high - low), 0.0f, 1.0f);
    return t * t * (3 - 2 * t);
}

float fraction(float x) {
    return x - std::floor(x);
}

/// A point of a surface. Heights are in units of the texture's width.
struct Point {
    vec3 color{0};
    float height = 0;
    float roughness = 0;
};

Point marble(const Noise& noise, float u, float v, const vec3& tint) {
    const float bend = noise.clouds(u, v, 5);
    const float vein = std::abs(2 * fraction(u + v + 1.5f * bend) - 1);
    const float line = 1 - step(0, 0.25f, vein);
    const float gap = step(0.002f, 0.006f, std::min({u, v, 1 - u, 1 - v}));
    const float grain = 0.95f + 0.1f * noise.at(u, v, 256);
    const vec3 stone = grain * glm::mix(tint, tint * vec3(0.45f, 0.42f, 0.4f), 0.7f * line);
    return {glm::mix(vec3(0.35f), stone, gap), 0.002f * gap, glm::mix(0.8f, 0.15f + 0.2f * bend, gap)};
}

Point brick(const Noise& noise, float u, float v, const vec3& tint) {
    const float row = std::floor(8 * v), x = 4 * u + 0.5f * std::fmod(row, 2.0f);
    const float along = fraction(x), across = fraction(8 * v);
    const float edge = std::min({2 * along, 2 - 2 * along, across, 1 - across});
    const float inside = step(0.04f, 0.12f, edge + 0.05f * noise.at(u, v, 64));
    const float tone = noise.at(fraction(std::floor(x) / 4), row / 8, 16), grain = noise.clouds(u, v, 6);
    const vec3 clay = tint * vec3(0.75f, 0.38f, 0.28f) * (0.6f + 0.5f * tone + 0.4f * grain);
    return {glm::mix(vec3(0.55f, 0.53f, 0.5f) * (0.7f + 0.4f * grain), clay, inside), 0.008f * inside + 0.003f * grain,
            0.75f + 0.2f * grain};
}

Point limestone(const Noise& noise, float u, float v, const vec3& tint) {
    const float grain = noise.clouds(u, v, 7), bed = noise.at(0.0f, v, 32);
    return {tint * vec3(0.85f, 0.79f, 0.68f) * (0.75f + 0.25f * grain + 0.08f * bed), 0.006f * grain,
            0.6f + 0.3f * grain};
}

Point wood(const Noise& noise, float u, float v, const vec3& tint) {
    const float board = std::floor(4 * v);
    const float ring = fraction(6 * fraction(4 * v) + 2 * noise.at(u, fraction(v + 0.13f * board), 8));
    const float fibre = noise.at(fraction(u / 8), v, 256);
    const float gap = step(0.01f, 0.03f, std::min(fraction(4 * v), 1 - fraction(4 * v)));
    return {tint * vec3(0.5f, 0.32f, 0.18f) * (0.65f + 0.3f * ring + 0.25f * fibre) * (0.3f + 0.7f * gap),
            0.003f * gap + 0.001f * fibre, 0.4f + 0.3f * fibre};
}

Point painting(const Noise& noise, float u, float v, const vec3& tint) {
    const float r = noise.clouds(u, v, 4), g = noise.clouds(fraction(u + 0.37f), v, 5),
                b = noise.clouds(u, fraction(v + 0.61f), 6);
    const float weave = noise.at(u, v, 256);
    const vec3 color = tint * vec3(step(0.3f, 0.7f, r), step(0.35f, 0.65f, g), step(0.3f, 0.7f, b));
    return {0.05f + 0.85f * color * (0.8f + 0.2f * weave), 0.002f * weave + 0.004f * r, 0.35f + 0.3f * weave};
}

Point point(HallSurface surface, const Noise& noise, float u, float v, const vec3& tint) {
    switch (surface) {
        case HallSurface::marble:
            return marble(noise, u, v, tint);
        case HallSurface::brick:
            return brick(noise, u, v, tint);
        case HallSurface::limestone:
            return limestone(noise, u, v, tint);
        case HallSurface::wood:
            return wood(noise, u, v, tint);
        case HallSurface::painting:
            break;
    }
    return painting(noise, u, v, tint);
}

std::uint8_t byte(float value) {
    return static_cast<std::uint8_t>(std::clamp(value, 0.0f, 1.0f) * 255 + 0.5f);
}

/// Compresses rows of RGB. Equal texels give equal bytes.
std::string encode_jpeg(int size, const std::function<void(int y, std::uint8_t* row)>& make_row) {
    jpeg_compress_struct info;
    jpeg_error_mgr errors;
    info.err = jpeg_std_error(&errors);
    jpeg_create_compress(&info);
    unsigned char* bytes = nullptr;
    unsigned long count = 0;
    jpeg_mem_dest(&info, &bytes, &count);
    info.image_width = info.image_height = static_cast<JDIMENSION>(size);
    info.input_components = 3;
    info.in_color_space = JCS_RGB;
    jpeg_set_defaults(&info);
    jpeg_set_quality(&info, 92, TRUE);
    info.dct_method = JDCT_ISLOW;
    info.comp_info[0].h_samp_factor = info.comp_info[0].v_samp_factor = 1;  // chroma has full resolution
    jpeg_start_compress(&info, TRUE);
    std::vector<std::uint8_t> row(static_cast<std::size_t>(3 * size));
    for (int y = 0; y < size; ++y) {
        make_row(y, row.data());
        JSAMPROW rows = row.data();
        jpeg_write_scanlines(&info, &rows, 1);
    }
    jpeg_finish_compress(&info);
    jpeg_destroy_compress(&info);
    std::string result(reinterpret_cast<const char*>(bytes), count);
    std::free(bytes);
    return result;
}

}  // namespace

std::string hall_texture(HallSurface surface, HallMap map, std::uint32_t seed, int size) {
    const Noise noise(seed);
    Random random(seed);
    const vec3 tint(0.8 + 0.2 * random(), 0.75 + 0.25 * random(), 0.7 + 0.3 * random());
    const float texel = 1.0f / static_cast<float>(size);
    const auto at = [&](int x, int y) {
        const auto centre = [&](int i) { return (static_cast<float>((i + size) % size) + 0.5f) * texel; };
        Point p = point(surface, noise, centre(x), centre(y), tint);
        // Each texel differs from its neighbours, as in photographs.
        const auto column = static_cast<std::uint32_t>((x + size) % size);
        const auto row = static_cast<std::uint32_t>((y + size) % size);
        const float grain = static_cast<float>(hash(column, row + (seed << 16))) * 0x1p-32f;
        p.color *= 0.94f + 0.12f * grain;
        p.roughness *= 0.97f + 0.06f * grain;
        p.height += 0.1f * texel * grain;
        return p;
    };
    if (map != HallMap::normal) {
        return encode_jpeg(size, [&](int y, std::uint8_t* row) {
            for (int x = 0; x < size; ++x) {
                const Point p = at(x, y);
                const vec3 value = map == HallMap::color ? p.color : vec3(1, p.roughness, 0);
                for (int c = 0; c < 3; ++c) *row++ = byte(value[c]);
            }
        });
    }
    // Three rows of heights, by row number modulo 3.
    std::array<std::vector<float>, 3> heights;
    const auto fill = [&](int y) {
        std::vector<float>& row = heights[static_cast<std::size_t>((y + 3) % 3)];
        row.resize(static_cast<std::size_t>(size));
        for (int x = 0; x < size; ++x) row[static_cast<std::size_t>(x)] = at(x, y).height;
    };
    fill(-1), fill(0);
    return encode_jpeg(size, [&](int y, std::uint8_t* row) {
        fill(y + 1);
        const auto height = [&](int x, int line) {
            return heights[static_cast<std::size_t>((line + 3) % 3)][static_cast<std::size_t>((x + size) % size)];
        };
        const float slope = 0.5f * static_cast<float>(size);
        for (int x = 0; x < size; ++x) {
            const vec3 n = glm::normalize(
                vec3(slope * (height(x - 1, y) - height(x + 1, y)), slope * (height(x, y + 1) - height(x, y - 1)), 1));
            for (int c = 0; c < 3; ++c) *row++ = byte(0.5f * n[c] + 0.5f);
        }
    });
}

}  // namespace halflight::scenes
