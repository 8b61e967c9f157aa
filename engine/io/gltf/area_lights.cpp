#include "engine/io/gltf/area_lights.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>

#include "engine/core/memory_ledger.h"
#include "engine/io/gltf/nodes.h"
#include "engine/io/gltf/rules.h"

namespace halflight {
namespace {

using Json = nlohmann::json;

constexpr const char* kExtension = "EXT_lights_area";
constexpr int kSides = 64;       // of a disc; its edge is within 0.1 % of the radius
constexpr float kDepth = 1e-3f;  // of the body behind a light, in units of its size

/// Corners of triangles of a thin prism behind the plane of X and Y.
struct Prism {
    std::vector<vec3> front{}, body{};  // the face to -Z, and all others
};

/// Returns the prism of a square of side 1 or of a disc of diameter 1. Surfaces emit on both sides, so the other faces
/// keep the light that the front emits backwards.
Prism prism_of(bool disc) {
    std::vector<vec3> ring{{-0.5f, -0.5f, 0}, {-0.5f, 0.5f, 0}, {0.5f, 0.5f, 0}, {0.5f, -0.5f, 0}};
    if (disc) {
        const double angle = 2 * kPi / kSides, radius = std::sqrt(kPi / 4 / (kSides / 2.0 * std::sin(angle)));
        ring.clear();
        for (int i = 0; i < kSides; ++i)
            ring.emplace_back(radius * std::cos(i * angle), -radius * std::sin(i * angle), 0);
    }
    Prism prism;
    const vec3 depth(0, 0, kDepth);
    for (std::size_t i = 0; i < ring.size(); ++i) {
        const vec3 a = ring[i], b = ring[(i + 1) % ring.size()];
        prism.front.insert(prism.front.end(), {vec3(0), a, b});
        prism.body.insert(prism.body.end(), {depth, b + depth, a + depth, a, a + depth, b, b, a + depth, b + depth});
    }
    return prism;
}

/// Adds an object to a list of the file. Returns its index.
std::size_t add(Json& root, const char* list, Json object) {
    root[list].push_back(std::move(object));
    return root[list].size() - 1;
}

/// Adds an accessor of positions, in a buffer of its own. Returns its index.
std::size_t add_positions(Json& root, const std::vector<vec3>& positions) {
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
                {"min", {-0.5, -0.5, 0}},
                {"max", {0.5, 0.5, kDepth}}});
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
    double intensity = light.value("intensity", 1000.0);
    bool inside = intensity >= 0 && std::isfinite(intensity);
    if (!inside) intensity = 0;
    for (Json& channel : color) {
        const double c = channel;
        inside = inside && c >= 0 && c <= 1;
        channel = std::clamp(c, 0.0, 1.0);
    }
    if (!inside) document.value_fault("intensity is negative, or color is outside [0, 1]; they are clamped", element);
    return emitting(name, color, intensity);
}

/// Returns a length of a light, in units of its node.
double length_of(const Json& from, const char* key, const std::string& element, const GltfDocument& document) {
    const double length = from.value(key, 1.0);
    if (!(length > 0 && std::isfinite(length))) document.fail(element, "{} is {}, not positive", key, length);
    return length;
}

}  // namespace

std::vector<std::size_t> add_area_lights(Json& root, GltfDocument& document) {
    const Json::json_pointer list("/extensions/EXT_lights_area/lights"), reference("/extensions/EXT_lights_area/light");
    std::vector<std::size_t> children;
    if (!root.contains(list) || !root.contains("nodes")) return children;
    const Json lights = root[list];
    Json& nodes = root["nodes"];
    const std::size_t count = nodes.size();
    const auto lamps = static_cast<std::size_t>(
        std::ranges::count_if(nodes, [&](const Json& node) { return node.contains(reference); }));
    constexpr std::size_t kLamp = 8192;  // bytes of the node, material and mesh of a light, as JSON and converted
    MemoryLedger::process().check(kLamp * lamps, document.file, fmt::format("{} area lights", lamps));
    std::map<std::size_t, std::pair<std::size_t, Json>> meshes;  // mesh and scale, by light
    std::map<bool, std::pair<std::size_t, std::size_t>> shapes;  // accessors of front and body, by type
    std::optional<std::size_t> black;                            // material of bodies
    const auto mesh_of = [&](const Json& light, std::size_t index) {
        const std::string element = fmt::format("extensions.{}.lights[{}]", kExtension, index);
        const std::string type = light.value("type", light.value("shape", "rect"));
        if (type != "rect" && type != "disk") document.fail(element, "type '{}' is unknown", type);
        const bool disc = type == "disk";
        const double size = length_of(light, "size", element, document);
        const double aspect =
            disc ? 1 : length_of(light.value("rect", Json::object()), "aspect", element + ".rect", document);
        if (!shapes.contains(disc)) {
            const Prism prism = prism_of(disc);
            const std::size_t front = add_positions(root, prism.front);
            shapes[disc] = {front, add_positions(root, prism.body)};
        }
        if (!black) black = add(root, "materials", emitting("back of area lights", {0, 0, 0}, 0));
        const std::string name = light.value("name", fmt::format("area light {}", index));
        const std::size_t material = add(root, "materials", material_of(light, name, element, document));
        const auto part = [](std::size_t positions, std::size_t of) {
            return Json{{"attributes", {{"POSITION", positions}}}, {"material", of}};
        };
        const Json parts = {part(shapes[disc].first, material), part(shapes[disc].second, *black)};
        return std::pair(add(root, "meshes", {{"name", name}, {"primitives", parts}}), Json{size * aspect, size, size});
    };
    for (std::size_t i = 0; i < count; ++i) {
        if (!nodes[i].contains(reference)) continue;
        const std::size_t light = nodes[i][reference];
        if (!meshes.contains(light)) meshes[light] = mesh_of(lights[light], light);
        children.push_back(nodes.size());
        nodes[i]["children"].push_back(nodes.size());
        nodes.push_back({{"mesh", meshes[light].first}, {"scale", meshes[light].second}});
    }
    return children;
}

void scale_area_lights(const std::vector<std::size_t>& children, GltfDocument& document) {
    if (children.empty()) return;
    GltfWarnings before = document.warnings;
    const GltfNodes nodes = resolve_nodes(document);
    document.warnings = std::move(before);
    for (const std::size_t child : children) {
        const dmat4& world = nodes.world[static_cast<std::size_t>(nodes.parents[child])];
        const dvec3 lengths(glm::length(world[0]), glm::length(world[1]), glm::length(world[2]));
        const double most = std::max({lengths.x, lengths.y, lengths.z});
        std::vector<double>& scale = document.model.nodes[child].scale;
        for (int axis = 0; axis < 3; ++axis)
            if (lengths[axis] > 0 && lengths[axis] != most)
                scale[static_cast<std::size_t>(axis)] *= most / lengths[axis];
    }
}

}  // namespace halflight
