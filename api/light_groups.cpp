#include "api/light_groups.h"

#include <algorithm>
#include <cctype>
#include <set>

#include "api/halflight/object_names.h"
#include "api/node_edits.h"
#include "engine/core/error.h"

namespace halflight {
namespace {

constexpr const char* kRest = "rest";
constexpr const char* kEnvironmentName = "environment";

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

/// Throws Error where the name of a group cannot name a layer.
void check_name(const std::string& name, const std::string& subject) {
    if (name == kRest) throw Error(subject, "'{}' is the group of all lights that no other group names", kRest);
    if (name.empty() || !std::ranges::all_of(name, suits_layer))
        throw Error(subject, "'{}' cannot name a light group: names have letters, digits, _ and -", name);
}

/// Returns the name of a group of one light: that of the object, as far as it can name a layer and is not taken yet.
std::string own_name(const std::string& object, const char* kind, std::set<std::string>& taken) {
    std::string name = object.empty() ? kind : object;
    std::ranges::replace_if(
        name, [](char c) { return !suits_layer(c); }, '_');
    std::string unique = name;
    for (int i = 2; !taken.insert(unique).second; ++i) unique = fmt::format("{}_{}", name, i);
    return unique;
}

/// Gives each light a group of its own.
void separate(Scene& scene, const std::string& subject) {
    std::set<std::string> taken{kRest};
    const auto add = [&](const std::string& name, const char* kind, std::uint32_t& group) {
        group = static_cast<std::uint32_t>(scene.light_groups.size());
        scene.light_groups.push_back(own_name(name, kind, taken));
    };
    for (PunctualLight& light : scene.lights) add(light.name, "light", light.light_group);
    for (Material& material : scene.materials)
        if (material.emission != vec3(0) && !material.unlit) add(material.name, "material", material.light_group);
    if (!scene.environment.black()) add(kEnvironmentName, kEnvironmentName, scene.environment.light_group);
    scene.light_groups.emplace_back(kRest);
    check_count(scene.light_groups.size(), subject);
}

}  // namespace

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
        check_name(own.name, where);
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

void set_light_groups(const SceneEdits& edits, const FoundLightGroups& found, Scene& scene,
                      const std::string& subject) {
    for (std::size_t i = 0; i < found.lights.size(); ++i) scene.lights[i].light_group = found.lights[i];
    for (std::size_t i = 0; i < found.materials.size(); ++i) scene.materials[i].light_group = found.materials[i];
    scene.environment.light_group = found.environment;
    scene.light_groups.clear();
    if (edits.each_light) return separate(scene, subject);
    for (const LightGroup& group : edits.light_groups) scene.light_groups.push_back(group.name);
    if (!scene.light_groups.empty()) scene.light_groups.emplace_back(kRest);
}

}  // namespace halflight
