#include "engine/io/gltf/extras.h"

#include <string>

#include "engine/core/error.h"
#include "engine/io/gltf/document.h"

namespace halflight {
namespace {

using Json = nlohmann::json;

std::optional<FrameRate> frame_rate(const Json& value) {
    if (!value.is_number()) return std::nullopt;
    try {
        // These digits distinguish rates like 23.976, and a float has no more.
        return parse_frame_rate("", fmt::format("{:.7g}", value.get<double>()));
    } catch (const Error&) {
        return std::nullopt;
    }
}

}  // namespace

std::optional<FrameRate> frame_rate_in_extras(const Json& root, GltfWarnings& warnings) {
    const double shown = root.contains("scene") && root["scene"].is_number() ? root["scene"].get<double>() : 0;
    const std::size_t scene = shown >= 0 && shown < 0x1p31 ? static_cast<std::size_t>(shown) : 0;
    const std::pair<Json::json_pointer, std::string> places[] = {
        {Json::json_pointer(fmt::format("/scenes/{}/extras", scene)), fmt::format("scenes[{}].extras", scene)},
        {Json::json_pointer("/asset/extras"), "asset.extras"},
    };
    for (const auto& [pointer, element] : places) {
        for (const char* const key : {"fps", "frame_rate"}) {
            if (!root.contains(pointer / key)) continue;
            if (const auto rate = frame_rate(root.at(pointer / key))) return rate;
            warnings.add(fmt::format("{} is no number of frames per second from 0.001 to 1000000; it is ignored", key),
                         element);
        }
    }
    return std::nullopt;
}

}  // namespace halflight
