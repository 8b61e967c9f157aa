// Selection of the layer that the viewer shows, and false colours for data layers.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "renderer/render.h"

namespace halflight::view {

inline constexpr const char* kFinal = "final";
inline constexpr const char* kError = "error";
inline constexpr const char* kLuminance = "luminance";  // false colours of the final picture
/// AOVs whose sum is the picture.
inline constexpr std::array<std::string_view, 5> kComponents = {"emission", "direct_diffuse", "direct_glossy",
                                                                "indirect_diffuse", "indirect_glossy"};

struct LayerView {
    std::string layer = kFinal;                                    // name of the view, from layer_view_names()
    std::array<bool, 5> components{true, true, true, true, true};  // whether the final picture has each of kComponents
    bool operator==(const LayerView&) const = default;
    bool is_sum() const;  ///< Returns whether this is the final picture without some component.
};

/// Returns "final", "error", the names of known_aovs(), and "luminance".
std::vector<std::string> layer_view_names();
/// Returns the AOVs that a picture must have for this view.
std::vector<std::string> required_aovs(const LayerView& layer_view);
/// Returns a description of one line for the user.
std::string description(const std::string& view);

/// Colour scale (magma) of a data layer.
struct Scale {
    float top = 1;  // value of the lightest colour; larger values look the same
    std::string unit;
    float bottom = 0;  // value of the darkest colour; smaller values look the same. > 0: logarithmic scale
};

/// An image for the display, with 3 or more channels.
struct DisplayImage {
    Image image;
    // display-encoded; otherwise linear Rec.709, to which exposure and view transform are applied
    bool encoded = false;
    std::optional<Scale> scale{};  // colour scale; none unless colours stand for numbers
};

/// Returns the image of a view. `aovs` are the names of the result's AOVs and must contain required_aovs(). Radiance
/// and albedo are shown as colours, data as false colours:
///
///     normal, motion    offset from grey
///     position          place in the bounding box of the visible positions
///     ids               one colour per id
///     all others        magma scale, logarithmic for the variance
///
/// A scale ends at the 99th percentile, rounded up to 1, 2 or 5 times a power of ten. "error" is the standard error of
/// the pixel's mean luminance divided by sqrt(value^2 + 0.01), as in relMSE.
DisplayImage display_image(const LayerView& layer_view, const std::vector<std::string>& aovs,
                           const RenderResult& result);

/// Returns the result with the picture and the layers of a view only, for a file.
RenderResult shown_result(const LayerView& layer_view, const std::vector<std::string>& aovs,
                          const RenderResult& result);

/// Returns the biases of the displayed layer. Biases of preview modes that change the whole picture do not apply to its
/// components and to other layers.
const std::vector<std::string>& biases_of(const LayerView& layer_view, const RenderStats& stats);
/// Returns the lines that name biases on the picture. Those of preview modes share the first line.
std::vector<std::string> bias_lines(const std::vector<std::string>& biases);

/// Estimates the picture's relMSE (engine/core/metrics.h) from the variance of its samples, taken as independent.
/// Errors are relative to the median of the 3x3 pixels around each pixel, because a rare bright sample would make its
/// own relative error look small. The estimate ignores that samples are stratified, and light that no sample has met.
/// Returns nothing without the AOV "variance" or with fewer than kMinSamples samples.
std::optional<double> estimated_relmse(const std::vector<std::string>& aovs, const RenderResult& result);
/// Estimates the relMSE of a window whose pixels have this number of samples.
std::optional<double> estimated_relmse(const std::vector<std::string>& aovs, const RenderResult& result, int samples,
                                       const PixelWindow& window);
inline constexpr int kMinSamples = 4;

}  // namespace halflight::view
