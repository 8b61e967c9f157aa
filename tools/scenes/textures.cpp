#include "tools/scenes/textures.h"

#include <stb/stb_image_write.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <vector>

#include "tools/scenes/exact.h"

namespace halflight::scenes {
namespace {

/// Returns a PNG of `shade(u, v)` at the centre of each texel, v from the top row down; values in [0, 1].
std::string png(int width, int height, int channels, const std::function<dvec4(double, double)>& shade) {
    std::vector<std::uint8_t> pixels;
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const dvec4 value = shade((x + 0.5) / width, (y + 0.5) / height);
            for (int c = 0; c < channels; ++c)
                pixels.push_back(static_cast<std::uint8_t>(std::clamp(value[c], 0.0, 1.0) * 255 + 0.5));
        }
    std::string bytes;
    stbi_write_png_to_func(
        [](void* target, void* data, int size) {
            static_cast<std::string*>(target)->append(static_cast<const char*>(data), static_cast<std::size_t>(size));
        },
        &bytes, width, height, channels, pixels.data(), width * channels);
    return bytes;
}

double smooth(double low, double high, double x) {
    const double t = std::clamp((x - low) / (high - low), 0.0, 1.0);
    return t * t * (3 - 2 * t);
}

/// Returns value noise in [0, 1] on a lattice of `period` cells per repeat.
double noise(double u, double v, int period, std::uint32_t seed) {
    const double x = u * period, y = v * period;
    const double fx = std::floor(x), fy = std::floor(y);
    const auto corner = [&](int i, int j) {
        const auto wrap = [&](double k) { return static_cast<std::uint32_t>(k - period * std::floor(k / period)); };
        return hash(wrap(fx + i), hash(wrap(fy + j), seed)) * 0x1p-32;
    };
    const double s = smooth(0, 1, x - fx), t = smooth(0, 1, y - fy);
    return glm::mix(glm::mix(corner(0, 0), corner(1, 0), s), glm::mix(corner(0, 1), corner(1, 1), s), t);
}

/// Returns a sum of octaves of noise, each twice as fine and half as strong, in [0, 1].
double clouds(double u, double v, int period, int octaves, std::uint32_t seed) {
    double sum = 0, weight = 0.5, total = 0;
    for (int i = 0; i < octaves; ++i, weight /= 2, period *= 2) {
        sum += weight * noise(u, v, period, seed + static_cast<std::uint32_t>(i));
        total += weight;
    }
    return sum / total;
}

/// Returns the normal map of a height field; `steepness` is height per texture width.
std::string normals(int size, double steepness, const std::function<double(double, double)>& height) {
    const double step = 1.0 / size;
    return png(size, size, 3, [&](double u, double v) {
        const double du = (height(u + step, v) - height(u - step, v)) / (2 * step);
        const double dv = (height(u, v + step) - height(u, v - step)) / (2 * step);
        const dvec3 n = glm::normalize(dvec3(-du * steepness, dv * steepness, 1));
        return dvec4(n * 0.5 + 0.5, 1);
    });
}

double fraction(double x) {
    return x - std::floor(x);
}

/// Returns the distance to the nearest edge of the unit cell, in cells.
double to_edge(double x) {
    return 0.5 - std::abs(fraction(x) - 0.5);
}

}  // namespace

TextureSet marble_tiles() {
    constexpr double kGrout = 0.011;  // half width of the grout, tiles
    const auto gap = [](double u, double v) { return std::min(to_edge(2 * u), to_edge(2 * v)); };
    TextureSet set;
    set.color = png(512, 512, 3, [&](double u, double v) {
        const int i = static_cast<int>(std::floor(2 * u)), j = static_cast<int>(std::floor(2 * v));
        const auto tile = static_cast<std::uint32_t>(2 * i + j);
        const double bend = clouds(u, v, 3, 5, 10 + tile) - 0.5;
        const double vein = std::abs(sine(2 * kPi * (u + v + 1.6 * bend) + tile));
        const double line = (1 - smooth(0.0, 0.30, vein)) * (0.3 + 0.7 * clouds(u, v, 5, 2, 30 + tile));
        const bool dark = (i + j) % 2 != 0;
        const dvec3 stone = dark ? glm::mix(dvec3(0.36, 0.30, 0.27), dvec3(0.55, 0.47, 0.41), 0.7 * line)
                                 : glm::mix(dvec3(0.88, 0.85, 0.79), dvec3(0.70, 0.66, 0.60), line);
        const dvec3 tinted = stone * (0.94 + 0.12 * clouds(u, v, 8, 3, 20 + tile));
        return dvec4(glm::mix(dvec3(0.42, 0.40, 0.37), tinted, smooth(kGrout * 0.8, kGrout * 1.4, gap(u, v))), 1);
    });
    set.normal = normals(512, 0.006, [&](double u, double v) { return smooth(kGrout * 0.4, kGrout * 2.4, gap(u, v)); });
    set.roughness = png(256, 256, 3, [&](double u, double v) {
        const double polished = 0.20 + 0.12 * clouds(u, v, 6, 3, 40);
        return dvec4(1, glm::mix(0.85, polished, smooth(kGrout, kGrout * 1.6, gap(u, v))), 0, 1);
    });
    return set;
}

TextureSet stone_blocks() {
    // Courses have blocks of different lengths and offsets.
    const auto block = [](double u, double v) {
        const double row = std::floor(3 * fraction(v));
        const double column = 2 * fraction(u) + 0.37 * row;
        return dvec3(std::floor(column) - 2 * std::floor(column / 2), row,
                     std::min(to_edge(column) * 1.5, to_edge(3 * v)));
    };
    const auto height = [&](double u, double v) {
        return smooth(0.006, 0.045, block(u, v).z) + 0.16 * clouds(u, v, 24, 3, 60);
    };
    TextureSet set;
    set.color = png(512, 512, 3, [&](double u, double v) {
        const dvec3 b = block(u, v);
        const double tone = hash(static_cast<std::uint32_t>(b.x), static_cast<std::uint32_t>(b.y) + 70) * 0x1p-32;
        const dvec3 stone = glm::mix(dvec3(0.80, 0.72, 0.60), dvec3(0.86, 0.80, 0.70), tone);
        const double grain = 0.90 + 0.16 * clouds(u, v, 16, 4, 50);
        return dvec4(glm::mix(dvec3(0.62, 0.56, 0.47), stone * grain, smooth(0.008, 0.03, b.z)), 1);
    });
    set.normal = normals(512, 0.012, height);
    return set;
}

TextureSet limestone() {
    TextureSet set;
    set.color = png(256, 256, 3, [](double u, double v) {
        const double grain = clouds(u, v, 8, 5, 80), bed = clouds(u, 0.3 * v, 5, 3, 90);
        return dvec4(dvec3(0.87, 0.82, 0.73) * (0.86 + 0.14 * grain + 0.08 * bed), 1);
    });
    return set;
}

TextureSet planks() {
    TextureSet set;
    set.color = png(256, 256, 3, [](double u, double v) {
        const auto board = static_cast<std::uint32_t>(4 * v);
        const double ring = fraction(9 * (fraction(4 * v) + 0.25 * clouds(u, v, 3, 3, 100 + board)) + 0.7 * board);
        const double fibre = noise(0.12 * u, v, 128, 110) * 0.5 + noise(u, v, 16, 111) * 0.5;
        const double tone = 0.80 + 0.14 * ring + 0.14 * fibre + 0.05 * (board % 2);
        return dvec4(dvec3(0.56, 0.39, 0.25) * tone * (0.35 + 0.65 * smooth(0.01, 0.035, to_edge(4 * v))), 1);
    });
    return set;
}

TextureSet checker() {
    TextureSet set;
    set.color = png(128, 128, 3, [](double u, double v) {
        const int i = static_cast<int>(8 * u), j = static_cast<int>(8 * v);
        const dvec3 light(0.92, 0.90, 0.85), dark(0.16 + 0.07 * i, 0.28, 0.62 - 0.05 * j);
        return dvec4((i + j) % 2 == 0 ? light : dark, 1);
    });
    return set;
}

TextureSet banner(const dvec3& cloth, const dvec3& motif) {
    TextureSet set;
    set.color = png(128, 256, 3, [&](double u, double v) {
        const double x = 2 * u - 1, y = 4 * v - 1.9;  // a square field with the sun at its centre
        const double r = std::sqrt(x * x + y * y);
        const double edge = std::min({u, 1 - u, 2 * v, 2 - 2 * v});
        const bool border = (edge > 0.055 && edge < 0.105) || (edge > 0.125 && edge < 0.14);
        bool sun = r < 0.22 || (r > 0.27 && r < 0.30);
        for (int k = 0; k < 16; ++k) {  // rays, alternately long and short, narrower outwards
            const dvec2 t = cos_sin_degrees(22.5 * k);
            const double along = x * t.x + y * t.y, across = std::abs(x * t.y - y * t.x);
            const double reach = k % 2 == 0 ? 0.62 : 0.46;
            sun = sun || (along > 0.30 && along < reach && across < 0.07 * (reach - along) / (reach - 0.30));
        }
        const double stripe = fraction(4 * v) < 0.5 ? 1.0 : 0.0;
        const bool lozenge =
            v > 0.80 && v < 0.92 && std::abs(fraction(6 * u) - 0.5) + std::abs((v - 0.86) / 0.12) < 0.42;
        const double weave = 0.90 + 0.10 * noise(u, v, 128, 130) + 0.02 * stripe;
        return dvec4((border || sun || lozenge ? motif : cloth) * weave, 1);
    });
    return set;
}

TextureSet leaves() {
    TextureSet set;
    set.color = png(128, 128, 4, [](double u, double v) {
        const double x = u - 0.5, y = 1 - v;  // the stem grows from the bottom
        dvec4 color(0.25, 0.36, 0.14, 0);     // leaf-coloured also where transparent, to avoid a fringe by filtering
        if (std::abs(x - 0.03 * sine(6 * y)) < 0.012 && y < 0.9) color = {0.33, 0.27, 0.15, 1};
        for (int k = 0; k < 9; ++k) {
            const dvec2 root(0.03 * sine(6 * (0.08 + 0.09 * k)), 0.08 + 0.09 * k);
            const dvec2 t = cos_sin_degrees(k == 8 ? 90 : k % 2 == 0 ? 38 + 2 * k : 142 - 2 * k);
            const double length = k == 8 ? 0.18 : 0.44 - 0.026 * k;
            const dvec2 p(x - root.x, y - root.y);
            const double along = (p.x * t.x + p.y * t.y) / length, across = (p.y * t.x - p.x * t.y) / length;
            if (along < 0 || along > 1) continue;
            const double width = 0.62 * std::sqrt(along) * (1 - along);
            if (std::abs(across) > width) continue;
            const double rib =
                smooth(0.0, 0.03, std::abs(across)) * (0.8 + 0.2 * to_edge(7 * (along - std::abs(across))) * 2);
            color = dvec4(glm::mix(dvec3(0.62, 0.70, 0.38), dvec3(0.22 + 0.012 * k, 0.42, 0.13), rib), 1);
        }
        return color;
    });
    return set;
}

}  // namespace halflight::scenes
