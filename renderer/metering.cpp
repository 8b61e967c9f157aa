#include "renderer/metering.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <vector>

#include "engine/settings/data_window.h"
#include "engine/settings/visibility.h"

namespace halflight {

float metered_exposure(const Image& picture, const Optics& optics) {
    constexpr double kFrom = 0.2, kTo = 0.95;       // percentiles of the pixels that count
    constexpr double kGrey = 0.18, kBrightest = 4;  // luminance of the mean, and of the upper percentile at most
    constexpr double kCorner = 0.1;                 // weight of a corner; that of the centre is 1
    struct Weighted {
        double log_luminance;
        double weight;
    };
    std::vector<Weighted> pixels;
    double total = 0;
    const dvec2 eyes = eyes_in_picture(optics);
    for (int y = 0; y < picture.height; ++y)
        for (int x = 0; x < picture.width; ++x) {
            const float* const p = picture.at(x, y);
            const double value = double(luminance(vec3(p[0], p[1], p[2])));
            if (!(value > 0) || !std::isfinite(value)) continue;
            const dvec2 place = eyes * dvec2(x + 0.5, y + 0.5) / dvec2(picture.width, picture.height);
            const dvec2 at = 2.0 * (place - glm::floor(place)) - 1.0;
            double weight = std::pow(kCorner, glm::dot(at, at) / 2);
            if (optics.projection == Projection::panorama) weight *= std::cos(at.y * kPi / 2);
            pixels.push_back({std::log2(value), weight});
            total += weight;
        }
    if (pixels.empty()) return 0;
    std::ranges::sort(pixels, {}, &Weighted::log_luminance);
    double before = 0, sum = 0, weights = 0, bright = pixels.back().log_luminance;
    for (const Weighted& pixel : pixels) {
        // A pixel may lie across a percentile; the part within counts.
        const double inside = std::clamp(before + pixel.weight, kFrom * total, kTo * total) -
                              std::clamp(before, kFrom * total, kTo * total);
        sum += inside * pixel.log_luminance;
        weights += inside;
        if (inside > 0) bright = pixel.log_luminance;
        before += pixel.weight;
    }
    const double stops = std::min(std::log2(kGrey) - sum / weights, std::log2(kBrightest) - bright);
    if (std::abs(stops) < double(kNearStops)) return 0;
    constexpr double kMost = 64;  // range of the setting "exposure"
    return static_cast<float>(std::round(100 * std::clamp(stops, -kMost, kMost)) / 100);
}

std::optional<float> find_exposure(PreparedScene& scene, const ColorConfig& colors, const RenderSettings& settings,
                                   const PilotProgress& progress) {
    const double scale = std::min(1.0, std::sqrt(kMeterPixels / (double(settings.width) * double(settings.height))));
    // Both eyes have whole pixels. Mesa's software driver compiles programs once more for textures with a side that is
    // a power of two, so these sides are those of the picture.
    const auto scaled = [&](int size, double eyes) {
        const auto side = static_cast<unsigned>(size / eyes);
        auto small = static_cast<unsigned>(std::max(std::round(side * scale), 1.0));
        if (std::has_single_bit(side)) small = std::bit_ceil(small);
        while (!std::has_single_bit(side) && std::has_single_bit(small)) ++small;
        return static_cast<int>(eyes * small);
    };
    const dvec2 eyes = eyes_in_picture(settings.camera.optics);
    RenderSettings s;
    s.camera = settings.camera;
    s.width = scaled(settings.width, eyes.x);
    s.height = scaled(settings.height, eyes.y);
    s.samples = kMeterSamples;
    s.bounces = settings.bounces;
    s.clamp = settings.clamp;
    s.show_lamps = settings.show_lamps;
    s.backfaces = settings.backfaces;
    // The choice for the picture, not for the small one: other programs would take as long as the first sample.
    if (!scene.pool())
        s.primary =
            resolved(settings.primary, scene.drawn_triangles(), ivec2(settings.width, settings.height),
                     shown_by_tracing(settings.camera.optics, settings.camera.lens.blurs(), has_overscan(settings)));
    s.kept = settings.kept;
    // So few samples never choose tiles, but native tracing, which needs fewer programs and shares them with the
    // picture.
    s.culling = settings.culling == rays::Culling::off ? rays::Culling::off : rays::Culling::automatic;
    s.pictures = 1;
    s.frame = -1;  // frame number of hardly any picture, so that no sample is shared
    bool cancelled = false;
    Renderer renderer(scene, colors, s);
    const RenderResult result = renderer.render(s, [&](const RenderProgress& p) {
        cancelled = progress && !progress(double(p.samples_done) / kMeterSamples);
        return !cancelled;
    });
    if (cancelled) return std::nullopt;
    return metered_exposure(result.beauty, s.camera.optics);
}

}  // namespace halflight
