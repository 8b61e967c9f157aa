#include "api/halflight/aov_names.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "engine/settings/layers.h"

namespace halflight {
namespace {

/// Starts of channel names; the letter after the last dot stays. Empty: the layer keeps its names.
struct Row {
    std::string_view layer, blender, arnold;
};
// docs/colour-and-layers.md has the same table.
constexpr Row kNames[] = {
    {"rgba", "ViewLayer.Combined.", ""},
    {"emission", "ViewLayer.Emit.", "emission."},
    {"direct_diffuse", "ViewLayer.DiffDir.", "diffuse_direct."},
    {"direct_glossy", "ViewLayer.GlossDir.", "specular_direct."},
    {"indirect_diffuse", "ViewLayer.DiffInd.", "diffuse_indirect."},
    {"indirect_glossy", "ViewLayer.GlossInd.", "specular_indirect."},
    {"albedo", "ViewLayer.Denoising Albedo.", "albedo."},
    {"normal", "ViewLayer.Normal.", "N."},
    {"position", "ViewLayer.Position.", "P."},
    {"depth", "ViewLayer.Depth.", ""},
    {"noisy", "ViewLayer.Noisy Image.", ""},
};
constexpr std::array<std::string_view, 3> kWords = {"halflight", "blender", "arnold"};

}  // namespace

std::optional<AovNames> aov_names_named(std::string_view word) {
    const auto found = std::ranges::find(kWords, word);
    if (found == kWords.end()) return std::nullopt;
    return static_cast<AovNames>(found - kWords.begin());
}

std::vector<std::string> renamed(AovNames names, std::string_view layer, const std::vector<std::string>& channels) {
    if (names == AovNames::halflight) return channels;
    const bool blender = names == AovNames::blender;
    std::string start;
    if (const auto row = std::ranges::find(kNames, layer, &Row::layer); row != std::end(kNames))
        start = blender ? row->blender : row->arnold;
    else if (layer.starts_with(kLightGroupLayer))
        start = fmt::format("{}{}.", blender ? "ViewLayer.Combined_" : "RGBA_", layer.substr(kLightGroupLayer.size()));
    if (start.empty()) return channels;
    std::vector<std::string> made;
    for (const std::string& channel : channels) made.push_back(start + channel.substr(channel.rfind('.') + 1));
    return made;
}

}  // namespace halflight
