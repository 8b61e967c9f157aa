#include "engine/io/gltf/area_lights.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>

#include "engine/core/memory_ledger.h"
#include "engine/io/gltf/nodes.h"
#include "engine/io/gltf/uses.h"
#include "engine/scene/area_light_shape.h"

namespace halflight {
namespace {

using Json = nlohmann::json;

constexpr const char* kExtension = "EXT_lights_area";
constexpr double kMostFloat = std::numeric_limits<float>::max();

/// Adds an object to a list of the file. Returns its index.
std::size_t add(Json& root, const char* list, Json object) {
    root[list].push_back(std::move(object));
    return root[list].size() - 1;
}

/// Adds an accessor of positions, in a buffer of its own. Returns its index.
std::size_t add_positions(Json& root, const std::vector<vec3>& positions) {
    vec3 least(0), most(0);
    for (const vec3& p : positions) least = glm::min(least, p), most = glm::max(most, p);
    std::string bytes(positions.size() * sizeof(vec3), '\0'), uri = "data:application/octet-stream,";
    std::memcpy(bytes.data(), positions.data(), bytes.size());
    for (const char c : bytes) uri += fmt::format("%{:02X}", static_cast<unsigned char>(c));
    const std::size_t buffer = add(root, "buffers", {{"byteLength", bytes.size()}, {"uri", std::move(uri)}});
    const std::size_t view = add(root, "bufferViews", {{"buffer", buffer}, {"byteLength", bytes.size()}});
    return add(root, "accessors",
               {{"bufferView", view},
                {"componentType", 5126},
                {"count", positions.size()},
                {"type", "VEC3"},
                {"min", {least.x, least.y, least.z}},
                {"max", {most.x, most.y, most.z}}});
}

/// Returns a material that emits and does not reflect.
Json emitting(const std::string& name, const Json& color, double intensity) {
    return {{"name", name},
            {"emissiveFactor", color},
            {"pbrMetallicRoughness", {{"baseColorFactor", {0, 0, 0, 1}}, {"metallicFactor", 0}}},
            {"extensions",
             {{"KHR_materials_emissive_strength", {{"emissiveStrength", intensity}}},
              {"KHR_materials_specular", {{"specularFactor", 0}}}}}};
}

/// Returns the material of a light.
Json material_of(const Json& light, const std::string& name, const std::string& element, GltfDocument& document) {
    Json color = light.value("color", Json{1, 1, 1});
    const double given = light.value("intensity", 1000.0), intensity = std::clamp(given, 0.0, kMostFloat);
    bool inside = given == intensity;
    for (Json& channel : color) {
        const double c = channel;
        inside = inside && c >= 0 && c <= 1;
        channel = std::clamp(c, 0.0, 1.0);
    }
    if (!inside)
        document.value_fault("intensity is negative or too large, or color is outside [0, 1]; they are clamped",
                             element);
    return emitting(name, color, intensity);
}

/// Returns a length of a light, in units of its node.
double length_of(double length, const char* what, const std::string& element, const GltfDocument& document) {
    constexpr double kMostLength = 1e18;  // its square is within float32
    if (!(length > 0 && length <= kMostLength))
        document.fail(element, "{} is {}, not positive and at most {}", what, length, kMostLength);
    return length;
}

/// The mesh of a light, and its size in units of its nodes.
struct Shown {
    std::size_t mesh = 0;
    double width = 0, height = 0;
};

/// Makes the meshes of lights.
class Maker {
  public:
    Maker(Json& root, GltfDocument& document) : root_(root), document_(document) {}

    Shown make(const Json& light, std::size_t index) {
        const std::string element = fmt::format("extensions.{}.lights[{}]", kExtension, index);
        const std::string type = light.value("type", light.value("shape", "rect"));
        if (type != "rect" && type != "disk") document_.fail(element, "type '{}' is neither 'rect' nor 'disk'", type);
        const bool disc = type == "disk";
        Shown shown;
        shown.width = shown.height = length_of(light.value("size", 1.0), "size", element, document_);
        if (!disc) {
            const double aspect = light.value(Json::json_pointer("/rect/aspect"), 1.0);
            shown.width =
                length_of(aspect > 0 ? aspect * shown.height : aspect, "width by 'aspect'", element, document_);
        }
        if (!shapes_.contains(disc)) {
            const AreaLightShape shape = area_light_shape(disc);
            const std::size_t front = add_positions(root_, shape.front);
            shapes_[disc] = {front, add_positions(root_, shape.body)};
        }
        if (!black_) black_ = add(root_, "materials", emitting("back of area lights", {0, 0, 0}, 0));
        const std::string named = light.value("name", ""),
                          name = named.empty() ? fmt::format("area light {}", index) : named;
        const std::size_t material = add(root_, "materials", material_of(light, name, element, document_));
        const auto part = [](std::size_t positions, std::size_t of) {
            return Json{{"attributes", {{"POSITION", positions}}}, {"material", of}};
        };
        const Json parts = {part(shapes_[disc].first, material), part(shapes_[disc].second, *black_)};
        shown.mesh = add(root_, "meshes", {{"name", name}, {"primitives", parts}});
        return shown;
    }

  private:
    Json& root_;
    GltfDocument& document_;
    std::map<bool, std::pair<std::size_t, std::size_t>> shapes_;  // accessors of front and body; key: it is a disc
    std::optional<std::size_t> black_;                            // material of bodies
};

}  // namespace

std::vector<AreaLightNode> add_area_lights(Json& root, GltfDocument& document) {
    const Json::json_pointer list("/extensions/EXT_lights_area/lights"), reference("/extensions/EXT_lights_area/light");
    std::vector<AreaLightNode> all;
    if (!root.contains(list) || !root.contains("nodes")) return all;
    const GltfUses uses = find_uses(root, document.animations);
    Json& nodes = root["nodes"];
    const std::size_t count = nodes.size();
    std::map<std::size_t, std::vector<std::size_t>> users;  // nodes, by light
    std::size_t lamps = 0;
    for (std::size_t i = 0; i < count; ++i) {
        if (!is_used(uses, "nodes", i) || !nodes[i].contains(reference)) continue;
        users[nodes[i][reference].get<std::size_t>()].push_back(i);
        ++lamps;
    }
    constexpr std::size_t kNode = 2048, kLight = 65536;  // bytes as JSON, in the model and in the scene, rounded up
    MemoryLedger::process().check(kNode * lamps + kLight * users.size(), document.file,
                                  fmt::format("{} area lights", lamps));
    Maker maker(root, document);
    for (const auto& [light, of] : users) {
        const Shown shown = maker.make(root[list][light], light);
        for (const std::size_t node : of) {
            Json& from = nodes[node];
            for (const char* const other : {"KHR_lights_punctual", "EXT_lights_ies"})
                if (from["extensions"].erase(std::string(other)) > 0)
                    document.warnings.add(
                        fmt::format("is a light twice; that of {} is used, not that of {}", kExtension, other),
                        fmt::format("nodes[{}]", node));
            all.push_back({nodes.size(), node, shown.width, shown.height});
            from["children"].push_back(nodes.size());
            nodes.push_back(Json{{"mesh", shown.mesh}});  // without a name: edits name the node above
        }
    }
    return all;
}

void size_area_lights(const std::vector<AreaLightNode>& lights, GltfDocument& document) {
    if (lights.empty()) return;
    GltfWarnings before = document.warnings;
    const GltfNodes nodes = resolve_nodes(document);
    document.warnings = std::move(before);
    for (const AreaLightNode& light : lights) {
        const dmat3 world(nodes.world[light.node]);
        const double most = std::max({glm::length(world[0]), glm::length(world[1]), glm::length(world[2])});
        // The axes of lamps with profiles: -Z is the direction, and X is made orthogonal to it.
        const dvec3 z = glm::normalize(world[2]), x = glm::normalize(world[0] - glm::dot(world[0], z) * z);
        dmat3 local = glm::inverse(world) * dmat3(x, glm::cross(z, x), z) * most;
        if (!within_float_range(dmat4(local))) local = dmat3(1);
        local[0] *= light.width, local[1] *= light.height, local[2] *= light.height;
        std::vector<double>& matrix = document.model.nodes[light.child].matrix;
        matrix.assign(16, 0);
        for (int column = 0; column < 3; ++column)
            for (int row = 0; row < 3; ++row) matrix[static_cast<std::size_t>(4 * column + row)] = local[column][row];
        matrix[15] = 1;
    }
}

}  // namespace halflight
