#include "api/scene/light_groups.h"

#include <algorithm>
#include <cctype>
#include <set>

#include "api/halflight/object_names.h"
#include "api/scene/node_edits.h"
#include "engine/core/error.h"

namespace halflight {
namespace {

constexpr const char* kRest = "rest";
constexpr const char* kEnvironmentName = "environment";
// Names of channels in OpenEXR end at 255 bytes. Those of a group are longer than its own name, by
// "ViewLayer.Combined_", the view, the channel and the number of own_name().
constexpr std::size_t kMostName = 200;  // bytes

void check_count(std::size_t groups, const std::string& subject) {
    if (groups > kMostLightGroups)
        throw Error(subject, "makes {} light groups, with '{}'; at most {} are possible", groups, kRest,
                    kMostLightGroups);
}

/// Returns whether a character may be part of a layer's name. Lists of layers are separated by commas, layers and
/// channels by dots; spaces are trouble in scripts.
bool suits_layer(char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '-' ||
           static_cast<unsigned char>(c) >= 0x80;
}

/// Returns the name of a group of one light: the object's name, cut to kMostName bytes, in characters that layers may
/// have. A number is added if the name is taken.
std::string own_name(const std::string& object, const char* kind, std::set<std::string>& taken) {
    std::string name = object.empty() ? kind : object;
    std::ranges::replace_if(
        name, [](char c) { return !suits_layer(c); }, '_');
    if (name.size() > kMostName) {
        std::size_t end = kMostName;
        while (end > 0 && (static_cast<unsigned char>(name[end]) & 0xc0) == 0x80) --end;  // within a UTF-8 character
        name.resize(end);
    }
    std::string unique = name;
    for (int i = 2; !taken.insert(unique).second; ++i) unique = fmt::format("{}_{}", name, i);
    return unique;
}

}  // namespace

void check_light_group_name(const std::string& name, const std::string& subject) {
    if (name == kRest) throw Error(subject, "'{}' is the group of all lights that no other group names", kRest);
    if (name.empty() || !std::ranges::all_of(name, suits_layer))
        throw Error(subject, "'{}' cannot name a light group: names have letters, digits, _ and -", name);
    if (name.size() > kMostName)
        throw Error(subject, "'{}' cannot name a light group: names have at most {} bytes", name, kMostName);
}

FoundLightGroups find_light_groups(const SceneEdits& edits, const Scene& scene, const SceneTree& tree,
                                   const std::string& subject) {
    FoundLightGroups found{std::vector(scene.lights.size(), kNoLightGroup),
                           std::vector(scene.materials.size(), kNoLightGroup),
                           std::vector(scene.instances.size(), kNoLightGroup)};
    if (edits.light_groups.empty()) return found;
    if (edits.each_light) throw Error(subject, "light groups are both 'each' and named ones");
    check_count(edits.light_groups.size() + 1, subject);
    const NamedObjects kinds[] = {lights_of(scene), materials_of(scene), nodes_of(tree)};
    std::vector<std::uint32_t> nodes(tree.nodes.size(), kNoLightGroup);
    std::set<std::string> names;
    for (std::uint32_t group = 0; group < edits.light_groups.size(); ++group) {
        const LightGroup& own = edits.light_groups[group];
        const std::string where = own.source.empty() ? subject : own.source + ": " + scene.name;
        check_light_group_name(own.name, where);
        if (own.lights.empty()) throw Error(where, "light group '{}' names no lights", own.name);
        if (!names.insert(own.name).second) throw Error(where, "there are two light groups '{}'", own.name);
        const auto take = [&](std::uint32_t& of) { of = std::min(of, group); };
        for (const std::string& name : own.lights) {
            if (name == kEnvironmentName) {
                take(found.environment);
                continue;
            }
            const auto objects = find_among(kinds, name, where);
            for (const std::size_t i : objects[0]) take(found.lights[i]);
            for (const std::size_t i : objects[1]) take(found.materials[i]);
            for (const std::size_t i : objects[2]) take(nodes[i]);
        }
    }
    const auto at_or_above = [&](int node) {
        std::uint32_t group = kNoLightGroup;
        for (; node != kNone; node = tree.nodes[static_cast<std::size_t>(node)].parent)
            group = std::min(group, nodes[static_cast<std::size_t>(node)]);
        return group;
    };
    for (std::size_t i = 0; i < found.lights.size(); ++i)
        found.lights[i] = std::min(found.lights[i], at_or_above(node_of_light(tree, i)));
    for (std::size_t i = 0; i < found.instances.size(); ++i)
        found.instances[i] = at_or_above(node_of_instance(scene, tree, i));
    return found;
}

void set_light_groups(const SceneEdits& edits, const FoundLightGroups& found, Scene& scene) {
    std::vector<std::string> names;
    for (const LightGroup& group : edits.light_groups) names.push_back(group.name);
    if (!names.empty()) names.emplace_back(kRest);
    set_light_groups({std::move(names), found, {}}, scene);
}

SeparateLights separate_lights(const Scene& scene, const std::set<std::size_t>& driven, const std::string& subject) {
    SeparateLights separate;
    std::set<std::string> taken{kRest, kEnvironmentName};
    const auto next = [&](std::string name) {
        separate.names.push_back(std::move(name));
        return static_cast<std::uint32_t>(separate.names.size() - 1);
    };
    for (const PunctualLight& light : scene.lights)
        separate.groups.lights.push_back(next(own_name(light.name, "light", taken)));
    for (std::size_t i = 0; i < scene.materials.size(); ++i) {
        const Material& m = scene.materials[i];
        const bool emits = !m.unlit && (m.emission != vec3(0) || driven.contains(i));
        separate.groups.materials.push_back(emits ? next(own_name(m.name, "material", taken)) : kNoLightGroup);
    }
    for (const Material& m : scene.materials) separate.surfaces.push_back(m.name);
    if (!scene.environment.black()) separate.groups.environment = next(kEnvironmentName);
    next(kRest);
    check_count(separate.names.size(), subject);
    return separate;
}

void set_light_groups(const SeparateLights& lights, Scene& scene) {
    const FoundLightGroups& groups = lights.groups;
    const auto named = [](const std::string& name, const Material& m) { return name == m.name; };
    if (scene.materials.size() < lights.surfaces.size() ||
        !std::equal(lights.surfaces.begin(), lights.surfaces.end(), scene.materials.begin(), named))
        throw Error(scene.name,
                    "with a light group for each light, surfaces of added lights cannot go dark or begin to "
                    "shine from frame to frame");
    for (std::size_t i = 0; i < groups.lights.size(); ++i) scene.lights[i].light_group = groups.lights[i];
    for (std::size_t i = 0; i < groups.materials.size(); ++i) scene.materials[i].light_group = groups.materials[i];
    scene.environment.light_group = groups.environment;
    scene.light_groups = lights.names;
}

std::vector<std::string> dark_light_groups(const Scene& scene, const std::set<std::size_t>& driven) {
    std::set<std::uint32_t> lit;
    for (const PunctualLight& light : scene.lights) lit.insert(light.light_group);
    if (!scene.environment.black()) lit.insert(scene.environment.light_group);
    for (const Instance& instance : scene.instances) {
        for (const std::uint32_t m : scene.meshes[instance.mesh].triangle_material) {
            const Material& material = scene.materials[m];
            if (material.emission != vec3(0) || driven.contains(m))
                lit.insert(std::min(instance.light_group, material.light_group));
        }
    }
    std::vector<std::string> dark;
    for (std::uint32_t group = 0; group + 1 < scene.light_groups.size(); ++group)
        if (!lit.contains(group)) dark.push_back(scene.light_groups[group]);
    return dark;
}

}  // namespace halflight
