#include "api/scene/light_links.h"

#include <algorithm>
#include <map>
#include <set>

#include "api/halflight/object_names.h"
#include "api/scene/node_edits.h"
#include "engine/core/error.h"

namespace halflight {
namespace {

constexpr const char* kEnvironment = "environment";
constexpr const char* kGround = "ground";

std::string where_of(const LightLink& link, const Scene& scene, const std::string& subject) {
    return link.source.empty() ? subject : link.source + ": " + scene.name;
}

class Finder {
  public:
    Finder(const SceneEdits& edits, const Scene& scene, const SceneTree& tree)
        : scene_(scene), tree_(tree), has_ground_(edits.ground) {
        for (std::size_t i = 0; i < scene.instances.size(); ++i) nodes_.push_back(node_of_instance(scene, tree, i));
    }

    /// Returns per instance, and for the ground behind them, whether a link has the object.
    std::vector<bool> objects_of(const LightLink& link, const std::string& where) const {
        if (link.objects.empty()) throw Error(where, "the link of '{}' names no objects", link.light);
        const NamedObjects kinds[] = {nodes_of(tree_), meshes_of(scene_)};
        std::vector<bool> has(scene_.instances.size() + 1, link.objects[0].starts_with('-'));
        for (const std::string& object : link.objects) {
            const bool adds = !object.starts_with('-');
            const std::string name = object.substr(adds ? 0 : 1);
            const bool is_ground = has_ground_ && matches_pattern(name, kGround);
            if (is_ground) has.back() = adds;
            const auto has_name = [&](const NamedObjects& kind) { return !objects_named(kind, name).empty(); };
            if (is_ground && std::ranges::none_of(kinds, has_name)) continue;
            const auto found = find_among(kinds, name, where);
            const std::set<std::size_t> nodes(found[0].begin(), found[0].end());
            std::vector<bool> meshes(scene_.meshes.size());
            for (const std::size_t mesh : found[1]) meshes[mesh] = true;
            bool any = is_ground;
            for (std::size_t i = 0; i < scene_.instances.size(); ++i) {
                if (!meshes[std::size_t(scene_.instances[i].mesh)] && !at_or_above(nodes_[i], nodes)) continue;
                has[i] = adds;
                any = true;
            }
            if (!any) throw Error(where, "'{}' has no surface", name);
        }
        return has;
    }

    /// Calls f(links) for each light of a name.
    template <class F>
    void for_lights(const std::string& name, const std::string& where, FoundLightLinks& links, F f) const {
        if (name == kEnvironment) return f(links.environment);
        const NamedObjects kinds[] = {lights_of(scene_), materials_of(scene_), nodes_of(tree_)};
        const auto found = find_among(kinds, name, where);
        const std::set<std::size_t> lights(found[0].begin(), found[0].end()), nodes(found[2].begin(), found[2].end());
        for (std::size_t i = 0; i < links.lights.size(); ++i)
            if (lights.contains(i) || at_or_above(node_of_light(tree_, i), nodes)) f(links.lights[i]);
        for (const std::size_t i : found[1]) f(links.materials[i]);
        for (std::size_t i = 0; i < links.instances.size(); ++i)
            if (at_or_above(nodes_[i], nodes)) f(links.instances[i]);
    }

  private:
    bool at_or_above(int node, const std::set<std::size_t>& nodes) const {
        for (; node != kNone; node = tree_.nodes[std::size_t(node)].parent)
            if (nodes.contains(std::size_t(node))) return true;
        return false;
    }

    const Scene& scene_;
    const SceneTree& tree_;
    bool has_ground_;
    std::vector<int> nodes_;  // node of each instance
};

}  // namespace

FoundLightLinks find_light_links(const SceneEdits& edits, const Scene& scene, const SceneTree& tree,
                                 const std::string& subject) {
    FoundLightLinks found;
    found.lights.resize(scene.lights.size());
    found.materials.resize(scene.materials.size());
    found.instances.resize(scene.instances.size());
    found.classes.resize(scene.instances.size());
    if (edits.light_links.empty() && edits.shadow_links.empty()) return found;
    const Finder finder(edits, scene, tree);
    struct Link {
        const LightLink& link;
        std::uint64_t LightLinks::*mask;
        std::vector<bool> has;
    };
    std::vector<Link> links;
    const auto add = [&](const std::vector<LightLink>& of, std::uint64_t LightLinks::*mask) {
        std::set<std::string> names;
        for (const LightLink& link : of) {
            const std::string where = where_of(link, scene, subject);
            if (!names.insert(link.light).second) throw Error(where, "there are two links of '{}'", link.light);
            links.push_back({link, mask, finder.objects_of(link, where)});
        }
    };
    add(edits.light_links, &LightLinks::receivers);
    add(edits.shadow_links, &LightLinks::blockers);

    // A class has the objects of which the same links have all or none. Class 0 is in all links.
    std::map<std::vector<bool>, std::uint8_t> classes{{std::vector<bool>(links.size(), true), 0}};
    const auto class_of = [&](std::size_t object) {
        std::vector<bool> in;
        for (const Link& link : links) in.push_back(link.has[object]);
        const auto next = static_cast<std::uint8_t>(std::min(classes.size(), kMostLinkClasses));
        const std::uint8_t own = classes.emplace(std::move(in), next).first->second;
        if (own == kMostLinkClasses)
            throw Error(where_of(links.back().link, scene, subject),
                        "links divide the objects into more than {} classes of objects with the same lights",
                        kMostLinkClasses);
        return own;
    };
    for (std::size_t i = 0; i < scene.instances.size(); ++i) found.classes[i] = class_of(i);
    if (edits.ground) found.ground = class_of(scene.instances.size());

    for (std::size_t k = 0; k < links.size(); ++k) {
        std::uint64_t mask = ~std::uint64_t{0};
        for (const auto& [in, number] : classes)
            if (!in[k]) mask &= ~(std::uint64_t{1} << number);
        const auto limit = [&](LightLinks& of) { of.*links[k].mask &= mask; };
        finder.for_lights(links[k].link.light, where_of(links[k].link, scene, subject), found, limit);
    }
    return found;
}

void set_light_links(const FoundLightLinks& found, Scene& scene) {
    for (std::size_t i = 0; i < found.lights.size(); ++i) scene.lights[i].links = found.lights[i];
    for (std::size_t i = 0; i < found.materials.size(); ++i) scene.materials[i].links = found.materials[i];
    scene.environment.links = found.environment;
}

}  // namespace halflight
