// Inspection of a picture: values at a pixel, and the distribution of luminance. Uses no window.
#pragma once

#include <array>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "engine/scene/scene.h"
#include "tools/view/request.h"

namespace halflight::view {

/// Known values of a pixel.
struct Probe {
    ivec2 pixel{0};                // pixel of the whole picture
    vec3 value{0};                 // linear radiance
    int samples = 0;               // samples of the pixel
    std::optional<float> error{};  // standard error of the mean luminance
    std::optional<float> depth{};  // distance along the camera's axis, world units; none: no surface
    std::optional<vec3> position{}, normal{}, albedo{};
    struct Surface {
        std::uint32_t instance, primitive, material;
    };
    std::optional<Surface> surface{};  // ids; none: no surface, or they are not known
};

/// Returns what two pictures tell about a pixel of a picture of `size` pixels. The value comes from `newest`. The
/// layers come from `complete`, which may be older or null; they are left out if it shows another view. Returns
/// nothing outside of the picture.
std::optional<Probe> probe(const Picture& newest, const Picture* complete, const ivec2& size, const ivec2& pixel);
/// Returns names and values for the user. Names of node and material come from the scene.
std::vector<std::pair<std::string, std::string>> lines_of(const Probe& probe, const Scene& scene);

nlohmann::ordered_json json_of(const Probe& probe);

/// Distribution of luminance over exposure values.
struct Histogram {
    static constexpr int kBins = 96;
    static constexpr float kLowest = -12, kHighest = 12;  // log2 of the luminance at the ends
    std::array<float, kBins> shares{};  // shares of the pixels; the first and the last bin hold all beyond
    float black = 0;                    // share of pixels with luminance 0
    float above = 0;                    // share of pixels brighter than 1 after exposure
    float mean = 0;                     // mean luminance
    float maximum = 0;                  // maximum luminance
};
/// Returns the distribution of a linear picture. stops: exposure.
Histogram histogram(const Image& beauty, float stops);
nlohmann::ordered_json json_of(const Histogram& histogram);

}  // namespace halflight::view
