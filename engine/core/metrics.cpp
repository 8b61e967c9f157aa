#include "engine/core/metrics.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <functional>
#include <numeric>
#include <vector>

namespace halflight {
namespace {

double squared_error(double value, double reference) {
    return (value - reference) * (value - reference);
}

template <class Error>
Image map_of(const Image& image, const Image& reference, const Error& error) {
    assert(image.width == reference.width && image.height == reference.height && image.channels == reference.channels);
    Image map(image.width, image.height, 1);
    const auto channels = static_cast<std::size_t>(image.channels);
    for (std::size_t p = 0; p < map.pixels.size(); ++p) {
        double sum = 0;
        for (std::size_t i = p * channels; i < (p + 1) * channels; ++i)
            sum += error(image.pixels[i], reference.pixels[i]);
        map.pixels[p] = static_cast<float>(sum / image.channels);
    }
    return map;
}

}  // namespace

double relative_mse(std::span<const double> values, std::span<const double> reference, double left_out) {
    assert(values.size() == reference.size());
    std::vector<double> errors(values.size());
    std::ranges::transform(values, reference, errors.begin(), relative_squared_error);
    const auto dropped = static_cast<std::size_t>(left_out * static_cast<double>(errors.size()));
    const auto end = errors.end() - static_cast<std::ptrdiff_t>(dropped);
    if (dropped > 0) std::nth_element(errors.begin(), end, errors.end());
    return errors.begin() == end
               ? 0
               : std::accumulate(errors.begin(), end, 0.0) / static_cast<double>(end - errors.begin());
}

Image squared_error_map(const Image& image, const Image& reference) {
    return map_of(image, reference, squared_error);
}

Image relative_squared_error_map(const Image& image, const Image& reference) {
    return map_of(image, reference, relative_squared_error);
}

double mean_of(const Image& map) {
    if (map.pixels.empty()) return 0;
    return std::accumulate(map.pixels.begin(), map.pixels.end(), 0.0) / static_cast<double>(map.pixels.size());
}

double worst_share(std::span<const float> map, double worst) {
    const auto wanted = static_cast<std::size_t>(std::ceil(worst * static_cast<double>(map.size())));
    std::vector<float> sorted(map.begin(), map.end());
    const auto end = sorted.begin() + static_cast<std::ptrdiff_t>(std::min(wanted, sorted.size()));
    std::nth_element(sorted.begin(), end, sorted.end(), std::greater<>());
    const double all = std::accumulate(sorted.begin(), sorted.end(), 0.0);
    return all > 0 ? std::accumulate(sorted.begin(), end, 0.0) / all : 0;
}

}  // namespace halflight
