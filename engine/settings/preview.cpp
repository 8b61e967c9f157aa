#include "engine/settings/preview.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <vector>

#include "engine/core/error.h"
#include "engine/core/names.h"

namespace halflight {
namespace {

constexpr std::array kModes = {
    PreviewMode{"cache", "Cache: end paths in cached radiance", &Preview::cache},
    PreviewMode{"temporal", "Temporal: reuse earlier pictures", &Preview::temporal},
    PreviewMode{"filter", "Filter: denoise the picture", &Preview::filter},
};
constexpr std::string_view kNone = "none";

}  // namespace

std::span<const PreviewMode> known_preview_modes() {
    return kModes;
}

std::string text(const Preview& preview) {
    std::vector<std::string> on;
    for (const PreviewMode& mode : kModes)
        if (preview.*mode.flag) on.emplace_back(mode.name);
    return on.empty() ? std::string(kNone) : fmt::format("{}", fmt::join(on, ","));
}

Preview preview_named(std::string_view list) {
    Preview preview;
    if (list == kNone) return preview;
    for (const std::string& name : split_names(list)) {
        if (name == kNone) throw Error(std::string(list), "'{}' stands alone", kNone);
        const auto mode = std::ranges::find(kModes, name, &PreviewMode::name);
        if (mode == kModes.end())
            throw Error(std::string(list), "'{}' is no preview mode; there are: {}", name, known_previews());
        if (preview.*mode->flag) throw Error(std::string(list), "'{}' is given twice", name);
        preview.*mode->flag = true;
    }
    return preview;
}

std::string known_previews() {
    std::vector<std::string> names;
    for (const PreviewMode& mode : kModes) names.emplace_back(mode.name);
    return fmt::format("{}", fmt::join(names, ", "));
}

}  // namespace halflight
