// What of a picture is looked at, and how data that is no colour is shown.
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
/// AOVs whose sum is the picture.
inline constexpr std::array<std::string_view, 5> kComponents = {"emission", "direct_diffuse", "direct_glossy",
                                                                "indirect_diffuse", "indirect_glossy"};

struct Look {
    std::string view = kFinal;                                     // one of views()
    std::array<bool, 5> components{true, true, true, true, true};  // of kComponents, that the final picture is made of
    bool operator==(const Look&) const = default;
    bool is_sum() const;  ///< the final picture without some component
};

/// "final", "error" and the names of known_aovs().
std::vector<std::string> views();
/// AOVs that the picture must have to be looked at so.
std::vector<std::string> aovs_of(const Look& look);
/// One line for people.
std::string description(const std::string& view);

/// Of a colour scale, which is magma's.
struct Scale {
    float top = 1;  // of the values; what is above looks like it
    std::string unit;
    float bottom = 0;  // likewise what is below; > 0: the scale is logarithmic
};

/// An image of 3 channels at least, as it goes to the display.
struct Seen {
    Image image;
    bool encoded = false;  // for the display; otherwise linear Rec.709, which exposure and view transform come upon
    std::optional<Scale> scale{};  // of what is shown by colours that stand for numbers
};

/// Of a result whose AOVs have these names; those of the look must be among them. Radiance and albedo are colour. Of
/// data: normals and motion as colour around grey; position as colour between the corners of what is seen; ids as a
/// colour each; depth, error, counts and, by its logarithm, variance on a scale up to a round number (1, 2 or 5)
/// not below their 99th percentile. The error is the standard error of the pixel's mean, of luminance, divided by
/// sqrt(value^2 + 0.01), as relMSE has it.
Seen seen(const Look& look, const std::vector<std::string>& aovs, const RenderResult& result);

/// Of what is seen: preview modes of the whole picture are not in its components, nor in other layers.
const std::vector<std::string>& biases_of(const Look& look, const RenderStats& stats);

/// What the picture's relMSE (engine/core/metrics.h) would be if it were the mean of independent samples with the
/// variance that they seem to have; errors are relative to the median of the 3 x 3 pixels around each, since a pixel
/// with a rare bright sample would take its own error for small. An estimate: samples are stratified, and light that
/// none of them has met is not in it. None without the AOV "variance", or of fewer than kLeastSamples.
std::optional<double> estimated_relmse(const std::vector<std::string>& aovs, const RenderResult& result);
inline constexpr int kLeastSamples = 4;

}  // namespace halflight::view
