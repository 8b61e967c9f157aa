#include "tools/measure/common/flip.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cfloat>
#include <cmath>
#include <vector>

#include "engine/core/chromaticities.h"
#include "engine/core/math.h"

namespace halflight {
namespace {

/// An image with one number per pixel.
struct Plane {
    int width, height;
    std::vector<float> values;

    Plane(int w, int h) : width(w), height(h), values(static_cast<std::size_t>(w) * static_cast<std::size_t>(h)) {}
    float* row(int y) { return values.data() + static_cast<std::size_t>(y) * static_cast<std::size_t>(width); }
    const float* row(int y) const { return const_cast<Plane*>(this)->row(y); }
};

/// Weights from -radius to radius.
using Kernel = std::vector<float>;

int radius_of(const Kernel& kernel) {
    return static_cast<int>(kernel.size() / 2);
}

/// Returns f(-radius) to f(radius), normalized so that positive weights sum to 1 and negative ones to -1.
template <class F>
Kernel kernel_of(int radius, const F& f) {
    std::vector<double> values;
    double above = 0, below = 0;
    for (int i = -radius; i <= radius; ++i) {
        const double v = values.emplace_back(f(i));
        (v > 0 ? above : below) += std::abs(v);
    }
    Kernel kernel;
    for (const double v : values) kernel.push_back(static_cast<float>(v > 0 ? v / above : below > 0 ? v / below : 0));
    return kernel;
}

/// Adds the convolution with a product of kernels in x and y; edge pixels are repeated beyond the plane.
void convolve(const Plane& in, const Kernel& in_x, const Kernel& in_y, float weight, Plane& out) {
    const int w = in.width, h = in.height, rx = radius_of(in_x), ry = radius_of(in_y);
    Plane half(w, h);
    std::vector<float> padded(static_cast<std::size_t>(w + 2 * rx));
    for (int y = 0; y < h; ++y) {
        for (int x = -rx; x < w + rx; ++x)
            padded[static_cast<std::size_t>(x + rx)] = in.row(y)[std::clamp(x, 0, w - 1)];
        float* const to = half.row(y);
        for (int i = 0; i <= 2 * rx; ++i) {
            const float k = in_x[static_cast<std::size_t>(i)];
            const float* const from = padded.data() + i;
            for (int x = 0; x < w; ++x) to[x] += k * from[x];
        }
    }
    for (int y = 0; y < h; ++y) {
        float* const to = out.row(y);
        for (int i = -ry; i <= ry; ++i) {
            const float k = weight * in_y[static_cast<std::size_t>(i + ry)];
            const float* const from = half.row(std::clamp(y + i, 0, h - 1));
            for (int x = 0; x < w; ++x) to[x] += k * from[x];
        }
    }
}

Plane convolved(const Plane& in, const Kernel& in_x, const Kernel& in_y) {
    Plane out(in.width, in.height);
    convolve(in, in_x, in_y, 1, out);
    return out;
}

/// Matrices between linear Rec.709 and XYZ relative to its white, so that white is (1, 1, 1).
const mat3 kToXyz = [] {
    dmat3 m = rgb_to_xyz(kRec709);
    const dvec3 white = m * dvec3(1);
    for (int c = 0; c < 3; ++c) m[c] /= white;
    return mat3(m);
}();
const mat3 kFromXyz = glm::inverse(kToXyz);

/// Returns YCxCz, which is linear in XYZ (Flohr et al. 1993; FLIP, section 4.1).
vec3 opponent(const vec3& rgb) {
    const vec3 xyz = kToXyz * rgb;
    return {116 * xyz.y - 16, 500 * (xyz.x - xyz.y), 200 * (xyz.y - xyz.z)};
}

vec3 rgb_of_opponent(const vec3& c) {
    const float y = (c.x + 16) / 116;
    return kFromXyz * vec3(y + c.y / 500, y, y - c.z / 200);
}

/// Returns CIE 1976 L*a*b* (CIE 15:2004), with chroma scaled by lightness for Hunt's effect (FLIP, section 4.1.2).
vec3 hunt_lab(const vec3& rgb) {
    const vec3 xyz = kToXyz * rgb;
    const auto f = [](float t) {
        constexpr float kDelta = 6.0f / 29;
        return t > kDelta * kDelta * kDelta ? std::cbrt(t) : t / (3 * kDelta * kDelta) + 4.0f / 29;
    };
    const float x = f(xyz.x), y = f(xyz.y), z = f(xyz.z);
    const float lightness = 116 * y - 16;
    return {lightness, 0.01f * lightness * 500 * (x - y), 0.01f * lightness * 200 * (y - z)};
}

/// Returns the HyAB distance (Abasi, Amani Tehran, Fairchild 2020), compressed (FLIP, section 4.1.3).
float color_distance(const vec3& a, const vec3& b) {
    constexpr float kExponent = 0.7f;
    return std::pow(std::abs(a.x - b.x) + glm::length(vec2(a.y - b.y, a.z - b.z)), kExponent);
}

/// Maps distances to [0, 1]: 0.4 of the largest distance, that of green and blue, maps to 0.95 (FLIP, section 4.1.3).
float spread(float distance) {
    constexpr float kKnee = 0.4f, kAtKnee = 0.95f;
    static const float largest = color_distance(hunt_lab({0, 1, 0}), hunt_lab({0, 0, 1}));
    const float knee = kKnee * largest;
    if (distance < knee) return distance / knee * kAtKnee;
    return kAtKnee + (distance - knee) / (largest - knee) * (1 - kAtKnee);
}

/// Filters, which depend on the viewer only.
struct Filters {
    /// Contrast sensitivity: per channel of YCxCz a sum of Gaussians a sqrt(pi / b) exp(-pi^2 r^2 / b), r in degrees
    /// (FLIP, table 1). The weight is a term's share in the sum over all pixels.
    struct Term {
        int channel;
        double a, b;
        Kernel kernel{};
        float weight = 0;
    };
    std::array<Term, 4> sensitivity{{{0, 1, 0.0047}, {1, 1, 0.0053}, {2, 34.1, 0.04}, {2, 13.5, 0.025}}};
    Kernel gaussian, edge, point;  // feature detectors: a Gaussian, its first and its second derivative (section 4.2)

    explicit Filters(double pixels_per_degree) {
        assert(pixels_per_degree > 0);
        constexpr double kWidest = 0.04;  // b of the widest term, which is cut at three of its standard deviations
        const int radius = static_cast<int>(std::ceil(3 * std::sqrt(kWidest / (2 * kPi * kPi)) * pixels_per_degree));
        double sums[3] = {};
        std::array<double, 4> sum_of{};
        for (std::size_t t = 0; t < sensitivity.size(); ++t) {
            Term& term = sensitivity[t];
            const auto f = [&](int i) { return std::exp(-std::pow(kPi * i / pixels_per_degree, 2) / term.b); };
            term.kernel = kernel_of(radius, f);
            double sum = 0;
            for (int i = -radius; i <= radius; ++i) sum += f(i);
            sum_of[t] = term.a * std::sqrt(kPi / term.b) * sum * sum;
            sums[term.channel] += sum_of[t];
        }
        for (std::size_t t = 0; t < sensitivity.size(); ++t)
            sensitivity[t].weight = static_cast<float>(sum_of[t] / sums[sensitivity[t].channel]);

        constexpr double kFeatureDegrees = 0.082;  // width of the eye's edge detector, degrees
        const double deviation = 0.5 * kFeatureDegrees * pixels_per_degree;
        const int reach = static_cast<int>(std::ceil(3 * deviation));
        const auto g = [&](int i) { return std::exp(-i * i / (2 * deviation * deviation)); };
        gaussian = kernel_of(reach, g);
        edge = kernel_of(reach, [&](int i) { return -i * g(i); });
        point = kernel_of(reach, [&](int i) { return (i * i / (deviation * deviation) - 1) * g(i); });
    }
};

/// A filtered image: perceived colours, and the response to edges and points by pixel.
struct Sight {
    std::vector<vec3> colors;  // colours of hunt_lab()
    std::vector<float> edges, points;
};

/// Returns the length of the response in x and y by pixel.
std::vector<float> feature(const Plane& in, const Kernel& derivative, const Kernel& gaussian) {
    const Plane in_x = convolved(in, derivative, gaussian), in_y = convolved(in, gaussian, derivative);
    std::vector<float> length(in_x.values.size());
    for (std::size_t i = 0; i < length.size(); ++i) length[i] = std::hypot(in_x.values[i], in_y.values[i]);
    return length;
}

Sight see(int width, int height, const std::vector<vec3>& rgb, const Filters& filters) {
    std::array<Plane, 3> channels{Plane(width, height), Plane(width, height), Plane(width, height)};
    std::array<Plane, 3> filtered = channels;
    for (std::size_t i = 0; i < rgb.size(); ++i) {
        const vec3 c = opponent(rgb[i]);
        for (int k = 0; k < 3; ++k) channels[static_cast<std::size_t>(k)].values[i] = c[k];
    }
    for (const Filters::Term& term : filters.sensitivity) {
        const auto c = static_cast<std::size_t>(term.channel);
        convolve(channels[c], term.kernel, term.kernel, term.weight, filtered[c]);
    }
    Sight sight;
    for (std::size_t i = 0; i < rgb.size(); ++i) {
        const vec3 c(filtered[0].values[i], filtered[1].values[i], filtered[2].values[i]);
        sight.colors.push_back(hunt_lab(glm::clamp(rgb_of_opponent(c), 0.0f, 1.0f)));
    }
    Plane& grey = channels[0];
    for (float& y : grey.values) y = (y + 16) / 116;
    sight.edges = feature(grey, filters.edge, filters.gaussian);
    sight.points = feature(grey, filters.point, filters.gaussian);
    return sight;
}

/// Returns the colour difference, raised by the difference of features (FLIP, section 4.3).
float difference(const Sight& a, const Sight& b, std::size_t pixel) {
    const float color = spread(color_distance(a.colors[pixel], b.colors[pixel]));
    const float features =
        std::max(std::abs(a.edges[pixel] - b.edges[pixel]), std::abs(a.points[pixel] - b.points[pixel]));
    return std::pow(color, std::max(1 - std::sqrt(features / std::sqrt(2.0f)), 0.0f));
}

/// Returns linear Rec.709 of every pixel; NaN and negative values become 0.
std::vector<vec3> colors_of(const Image& image) {
    const auto channels = static_cast<std::size_t>(image.channels);
    assert(image.channels != 2);
    std::vector<vec3> colors(image.pixels.size() / channels);
    for (std::size_t i = 0; i < colors.size(); ++i) {
        for (int k = 0; k < 3; ++k) {
            const float v = image.pixels[i * channels + (channels >= 3 ? static_cast<std::size_t>(k) : 0)];
            colors[i][k] = v > 0 ? v : 0;
        }
    }
    return colors;
}

/// Raises the map to at least the difference at an exposure. curve: exposure and tone curve.
template <class Curve>
void raise(const std::vector<vec3>& a, const std::vector<vec3>& b, const Filters& filters, const Curve& curve,
           Image& map) {
    const auto displayed = [&](std::vector<vec3> colors) {
        for (vec3& c : colors)
            for (int k = 0; k < 3; ++k) c[k] = std::clamp(curve(c[k]), 0.0f, 1.0f);
        return see(map.width, map.height, colors, filters);
    };
    const Sight seen_a = displayed(a), seen_b = displayed(b);
    for (std::size_t i = 0; i < map.pixels.size(); ++i)
        map.pixels[i] = std::max(map.pixels[i], difference(seen_a, seen_b, i));
}

// Tone curve of Narkowicz 2016, ACES Filmic Tone Mapping Curve: (a x^2 + b x) / (c x^2 + d x + e) of 0.6 x.
constexpr double kA = 0.6 * 0.6 * 2.51, kB = 0.6 * 0.03, kC = 0.6 * 0.6 * 2.43, kD = 0.6 * 0.59, kE = 0.14;

float aces(double x) {
    return std::isinf(x) ? static_cast<float>(kA / kC)
                         : static_cast<float>(x * (kA * x + kB) / (x * (kC * x + kD) + kE));
}

/// Returns the x that the curve maps to y, by its quadratic equation.
double aces_inverse(double y) {
    const double a = kA - y * kC, b = kB - y * kD, c = -y * kE;
    return (-b + std::sqrt(b * b - 4 * a * c)) / (2 * a);
}

}  // namespace

Image flip_map(const Image& image, const Image& reference, double pixels_per_degree) {
    assert(image.width == reference.width && image.height == reference.height);
    Image map(image.width, image.height, 1);
    raise(
        colors_of(image), colors_of(reference), Filters(pixels_per_degree), [](float v) { return v; }, map);
    return map;
}

ExposureRange flip_exposures(const Image& reference) {
    constexpr double kTarget = 0.85;
    std::vector<float> luminances;
    for (const vec3& c : colors_of(reference)) luminances.push_back(luminance(glm::min(c, vec3(FLT_MAX))));
    if (luminances.empty()) return {};
    const double largest = *std::ranges::max_element(luminances);
    if (!(largest > 0)) return {};
    const auto middle = luminances.begin() + static_cast<std::ptrdiff_t>(luminances.size() / 2);
    std::ranges::nth_element(luminances, middle);
    const double median = std::max<double>(*middle, std::ldexp(largest, -23));
    ExposureRange range;
    range.first = std::log2(aces_inverse(kTarget) / largest);
    range.last = std::log2(aces_inverse(kTarget) / median);
    range.count = std::max(2, static_cast<int>(std::ceil(range.last - range.first)));
    return range;
}

Image hdr_flip_map(const Image& image, const Image& reference, double pixels_per_degree) {
    assert(image.width == reference.width && image.height == reference.height);
    const ExposureRange range = flip_exposures(reference);
    const Filters filters(pixels_per_degree);
    const std::vector<vec3> a = colors_of(image), b = colors_of(reference);
    Image map(image.width, image.height, 1);
    for (int i = 0; i < range.count; ++i) {
        const double gain = std::exp2(std::lerp(range.first, range.last, i / (range.count - 1.0)));
        raise(
            a, b, filters, [&](float v) { return aces(gain * v); }, map);
    }
    return map;
}

}  // namespace halflight
