#include "engine/io/gltf/light_profiles.h"

#include <algorithm>
#include <limits>
#include <map>
#include <string_view>
#include <utility>

#include "engine/core/memory_ledger.h"
#include "engine/io/gltf/rules.h"
#include "engine/io/gltf/uri.h"
#include "engine/io/ies.h"

namespace halflight {
namespace {

constexpr const char* kExtension = "EXT_lights_ies";

std::string element_of_profile(std::size_t index) {
    return fmt::format("extensions.{}.lights[{}]", kExtension, index);
}

bool is_file(const std::string& uri) {
    return !uri.empty() && uri_scheme(uri) != "data";
}

std::size_t bytes_of(const LightProfile& profile) {
    return sizeof(LightProfile) +
           sizeof(float) * (profile.vertical.capacity() + profile.horizontal.capacity() + profile.shares.capacity());
}

/// Reads the profile of an element of the list.
LightProfile read_profile(GltfDocument& document, const nlohmann::json& from, const std::string& element) {
    const std::string uri = from.value("uri", "");
    const bool in_view = from.contains("bufferView");
    const ByteSource bytes =
        in_view ? document.view_bytes(from["bufferView"].get<int>()) : document.open_uri(uri, element);
    if (bytes.size() > kMostIesBytes) document.fail(element, "has {} bytes, more than {}", bytes.size(), kMostIesBytes);
    // A value has two bytes of text. The table has at most four times as many by symmetry, or kMostIesValues of types A
    // and B. There are tables of float64 and float32, which grow by factors of two, and two copies stay.
    const std::size_t text = bytes.size(), values = std::max(4 * std::min(text / 2, kMostIesValues), kMostIesValues);
    MemoryLedger::process().check(text + values * (2 * sizeof(double) + 4 * sizeof(float)),
                                  fmt::format("{}: {}", document.file, element), "light profile");
    std::string buffer;
    return read_ies(fmt::format("{}: {}", document.file, element), bytes.read(0, bytes.size(), buffer));
}

/// Returns the element of the list that a node refers to.
const GltfProfileElement& profile_of(const GltfDocument& document, const tinygltf::Value& reference) {
    return document.profiles[static_cast<std::size_t>(reference.Get("light").GetNumberAsInt())];
}

}  // namespace

void read_light_profiles(const nlohmann::json& list, GltfDocument& document) {
    std::map<std::pair<int, std::string_view>, std::size_t> first;  // element that has read a buffer view or URI
    std::size_t bytes = 0;
    document.profiles.resize(list.size());
    for (std::size_t i = 0; i < list.size(); ++i) {
        if (!is_used(document.uses, kLightProfileList, i)) continue;
        const nlohmann::json& from = list[i];
        const std::string element = element_of_profile(i);
        const std::string uri = from.value("uri", "");
        const bool in_view = from.contains("bufferView");
        if (in_view == !uri.empty()) document.fail(element, "needs either a URI or a bufferView");
        if (in_view && !from.contains("mimeType")) document.warnings.fault("has no mimeType", element);
        GltfProfileElement& profile = document.profiles[i];
        profile.name = from.value("name", is_file(uri) ? percent_decode(uri) : element);
        const auto key = in_view ? std::pair(from["bufferView"].get<int>(), std::string_view())
                                 : std::pair(kNone, std::string_view(from["uri"].get_ref<const std::string&>()));
        if (const auto [known, added] = first.emplace(key, i); !added) {
            profile.profile = document.profiles[known->second].profile;
            continue;
        }
        LightProfile table = read_profile(document, from, element);
        table.name = profile.name;
        if (table.candela == 0) document.warnings.add("has no light: all its intensities are 0", element);
        bytes += 2 * bytes_of(table);  // the scene has a copy
        profile.profile = static_cast<int>(document.light_profiles.size());
        document.light_profiles.push_back(std::move(table));
        document.profile_memory = {MemoryLedger::process(), MemoryPart::scene, bytes};
    }
}

const tinygltf::Value* find_profile_light(const tinygltf::Node& node) {
    return find_extension(node.extensions, kExtension);
}

std::string name_of_profile(const GltfDocument& document, const tinygltf::Value& reference) {
    return profile_of(document, reference).name;
}

PunctualLight convert_profile_light(GltfDocument& document, const tinygltf::Value& reference, std::size_t node) {
    PunctualLight light;
    light.profile = profile_of(document, reference).profile;
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
