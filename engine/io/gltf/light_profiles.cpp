#include "engine/io/gltf/light_profiles.h"

#include <algorithm>
#include <limits>

#include "engine/io/gltf/rules.h"
#include "engine/io/gltf/uri.h"
#include "engine/io/ies.h"

namespace halflight {
namespace {

constexpr const char* kExtension = "EXT_lights_ies";

std::string element_of_profile(std::size_t index) {
    return fmt::format("extensions.{}.lights[{}]", kExtension, index);
}

/// Reads the profile of an element of the list.
LightProfile read_profile(GltfDocument& document, const nlohmann::json& from, std::size_t index) {
    const std::string element = element_of_profile(index);
    const std::string uri = from.value("uri", "");
    const bool in_view = from.contains("bufferView");
    if (in_view == !uri.empty()) document.fail(element, "needs either a URI or a bufferView");
    if (in_view && !from.contains("mimeType")) document.warnings.fault("has no mimeType", element);
    const ByteSource bytes =
        in_view ? document.view_bytes(from["bufferView"].get<int>()) : document.open_uri(uri, element);
    if (bytes.size() > kMostIesBytes) document.fail(element, "has {} bytes, more than {}", bytes.size(), kMostIesBytes);
    std::string buffer;
    LightProfile profile = read_ies(fmt::format("{}: {}", document.file, element), bytes.read(0, bytes.size(), buffer));
    const bool is_file = !in_view && uri_scheme(uri) != "data";
    profile.name = from.value("name", is_file ? percent_decode(uri) : element);
    return profile;
}

}  // namespace

void read_light_profiles(const nlohmann::json& list, GltfDocument& document) {
    // Profiles that nothing uses get a dark one, since others keep their places.
    const LightProfile dark{
        .name = "unused", .vertical = {0, static_cast<float>(kPi)}, .horizontal = {0}, .shares = {0, 0}};
    document.light_profiles.assign(list.size(), dark);
    for (std::size_t i = 0; i < list.size(); ++i)
        if (is_used(document.uses, kLightProfileList, i))
            document.light_profiles[i] = read_profile(document, list[i], i);
}

const tinygltf::Value* find_profile_light(const tinygltf::Node& node) {
    return find_extension(node.extensions, kExtension);
}

PunctualLight convert_profile_light(GltfDocument& document, const tinygltf::Value& reference, std::size_t node) {
    PunctualLight light;
    light.profile = reference.Get("light").GetNumberAsInt();
    const LightProfile& profile = document.light_profiles[static_cast<std::size_t>(light.profile)];
    const double multiplier = reference.Has("multiplier") ? reference.Get("multiplier").GetNumberAsDouble() : 1;
    bool inside = multiplier >= 0;
    for (int i = 0; i < 3; ++i) {
        const double color = reference.Has("color") ? reference.Get("color").Get(i).GetNumberAsDouble() : 1;
        inside = inside && color >= 0 && color <= 1;
        light.intensity[i] =
            static_cast<float>(std::clamp(profile.candela * std::max(multiplier, 0.0) * std::clamp(color, 0.0, 1.0),
                                          0.0, double(std::numeric_limits<float>::max())));
    }
    if (!inside)
        document.value_fault("multiplier is negative, or color is outside [0, 1]; they are clamped",
                             fmt::format("nodes[{}].extensions.{}", node, kExtension));
    return light;
}

}  // namespace halflight
