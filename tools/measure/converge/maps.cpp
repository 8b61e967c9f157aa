#include "tools/measure/converge/maps.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "engine/core/math.h"
#include "engine/core/statistics.h"
#include "engine/io/png.h"

namespace halflight::converge {
namespace {

float luminance_at(const Image& image, int x, int y) {
    const float* p = image.at(x, y);
    return luminance(vec3(p[0], p[1], p[2]));
}

/// Returns the image of the values of f(x, y), a vec3.
template <class F>
Image picture_of(int width, int height, const F& f) {
    Image picture(width, height, 3);
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            const vec3 color = f(x, y);
            std::copy_n(&color.x, 3, picture.at(x, y));
        }
    }
    return picture;
}

}  // namespace

Image shrink(const Image& image, int side) {
    const int n = std::max((std::max(image.width, image.height) + side - 1) / side, 1);
    if (n == 1) return image;
    Image small(std::max(image.width / n, 1), std::max(image.height / n, 1), image.channels);
    for (int y = 0; y < small.height; ++y) {
        for (int x = 0; x < small.width; ++x) {
            const int right = std::min((x + 1) * n, image.width), lower = std::min((y + 1) * n, image.height);
            for (int c = 0; c < image.channels; ++c) {
                double sum = 0;
                for (int v = y * n; v < lower; ++v)
                    for (int u = x * n; u < right; ++u) sum += image.at(u, v)[c];
                small.at(x, y)[c] = static_cast<float>(sum / ((right - x * n) * (lower - y * n)));
            }
        }
    }
    return small;
}

Image signed_error_picture(const Image& image, const Image& reference, double scale) {
    constexpr vec3 kBrighter(0.70f, 0.09f, 0.17f), kDarker(0.13f, 0.40f, 0.67f);
    return picture_of(image.width, image.height, [&](int x, int y) {
        const double error = (luminance_at(image, x, y) - luminance_at(reference, x, y)) / scale;
        const auto amount = static_cast<float>(std::min(std::abs(error), 1.0));
        return glm::mix(vec3(1), error > 0 ? kBrighter : kDarker, amount);
    });
}

double error_scale(const Image& image, const Image& reference, double share) {
    std::vector<double> errors;
    for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x)
            errors.push_back(std::abs(double{luminance_at(image, x, y)} - luminance_at(reference, x, y)));
    return std::max(quantile(std::move(errors), share), double{std::numeric_limits<float>::min()});
}

std::string base64(const std::string& bytes) {
    constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string text;
    for (std::size_t i = 0; i < bytes.size(); i += 3) {
        std::uint32_t group = 0;
        for (std::size_t k = 0; k < 3; ++k)
            group = group << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0u);
        for (std::size_t k = 0; k < 4; ++k) text += i + k <= bytes.size() ? kDigits[group >> (18 - 6 * k) & 63] : '=';
    }
    return text;
}

std::string data_uri(const Image& image) {
    return "data:image/png;base64," +
           base64(encode_png("report", image.width, image.height, image.channels, quantize_8bit(image)));
}

}  // namespace halflight::converge
