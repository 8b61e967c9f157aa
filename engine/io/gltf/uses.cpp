#include "engine/io/gltf/uses.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

#include "engine/io/gltf/rules.h"

namespace halflight {
namespace {

using Json = nlohmann::json;

/// Returns the rules by which objects of a type refer to others.
std::map<std::string, std::vector<GltfRule>, std::less<>> find_links() {
    using enum GltfKind;
    GltfRules links = gltf_rules();
    for (auto& [type, rules] : links)
        std::erase_if(rules, [](const GltfRule& rule) {
            const bool refers = rule.kind == index || rule.kind == indices || rule.kind == index_map ||
                                rule.kind == index_maps || rule.kind == index_lists || rule.kind == object ||
                                rule.kind == objects;
            return !refers || rule.of == "variant mappings";
        });
    return links;
}

/// Returns the type of the objects of each list.
const std::map<std::string, std::string, std::less<>>& types() {
    static const std::map<std::string, std::string, std::less<>> types = [] {
        std::map<std::string, std::string, std::less<>> all{
            {"lights", "light"}, {kLightProfileList, "light profile"}, {kImageLightList, "image light"}};
        for (const GltfRule& rule : gltf_rules().at("root"))
            if (rule.kind == GltfKind::objects) all[rule.key] = rule.of;
        return all;
    }();
    return types;
}

/// A walk along the references of objects.
class Walk {
  public:
    explicit Walk(const Json& root) {
        for (const auto& [list, type] : types()) {
            const Json::json_pointer place =
                type == "light"           ? Json::json_pointer("/extensions/KHR_lights_punctual/lights")
                : type == "light profile" ? Json::json_pointer("/extensions/EXT_lights_ies/lights")
                : type == "image light"   ? Json::json_pointer("/extensions/EXT_lights_image_based/lights")
                                          : Json::json_pointer() / list;
            if (!root.contains(place)) continue;
            lists_[list] = &root.at(place);
            uses_[list].resize(root.at(place).size());
        }
    }

    void reach(const std::string& list, std::size_t index) {
        std::vector<bool>& marks = uses_[list];
        if (index >= marks.size() || marks[index]) return;
        marks[index] = true;
        todo_.emplace_back(&*lists_.find(list), index);
    }

    void reach_all(std::string_view wanted = "") {
        for (const auto& [list, objects] : lists_)
            if (wanted.empty() || list == wanted)
                for (std::size_t i = 0; i < objects->size(); ++i) reach(list, i);
    }

    void follow() {
        while (!todo_.empty()) {
            const auto [list, index] = todo_.back();
            todo_.pop_back();
            object((*list->second)[index], types().find(list->first)->second);
        }
    }

    /// Uses the nodes above joints that no scene shows, which move the joints.
    void reach_ancestors() {
        const auto found = lists_.find("nodes");
        if (found == lists_.end()) return;
        const std::vector<bool>& used = uses_["nodes"];
        std::vector<std::vector<std::size_t>> parents(used.size());
        std::vector<std::size_t> todo;
        for (std::size_t i = 0; i < used.size(); ++i)
            if (const auto children = (*found->second)[i].find("children"); children != (*found->second)[i].end())
                for (const std::size_t child : *children) parents[child].push_back(i);
        for (std::size_t i = 0; i < used.size(); ++i)
            if (used[i] && std::ranges::none_of(parents[i], [&](std::size_t p) { return used[p]; })) todo.push_back(i);
        while (!todo.empty()) {
            const std::size_t node = todo.back();
            todo.pop_back();
            for (const std::size_t parent : parents[node]) {
                if (used[parent]) continue;
                reach("nodes", parent);
                todo.push_back(parent);
            }
        }
        follow();
    }

    GltfUses take() { return std::move(uses_); }

  private:
    void object(const Json& value, const std::string& type) {
        static const auto kLinks = find_links();
        for (const GltfRule& rule : kLinks.find(type)->second) {
            const auto found = value.find(rule.key);
            if (found != value.end()) follow(*found, rule);
        }
    }

    void follow(const Json& value, const GltfRule& rule) {
        if (rule.kind == GltfKind::object) return object(value, rule.of);
        if (rule.kind == GltfKind::index) return reach(rule.of, value.get<std::size_t>());
        for (const Json& each : value) {
            if (rule.kind == GltfKind::objects)
                object(each, rule.of);
            else if (rule.kind == GltfKind::index_maps || rule.kind == GltfKind::index_lists)
                for (const Json& index : each) reach(rule.of, index.get<std::size_t>());
            else
                reach(rule.of, each.get<std::size_t>());
        }
    }

    std::map<std::string, const Json*, std::less<>> lists_;
    GltfUses uses_;
    std::vector<std::pair<const std::pair<const std::string, const Json*>*, std::size_t>> todo_;
};

}  // namespace

GltfUses find_uses(const Json& root, const Json& animations) {
    Walk walk(root);
    const auto scenes = root.find("scenes");
    if (scenes != root.end() && !scenes->empty()) {
        walk.reach("scenes", root.value("scene", std::size_t{0}));
    } else {
        walk.reach_all("nodes");
    }
    if (!root.contains("nodes")) walk.reach_all();
    for (const Json& animation : animations) {
        if (!animation.is_object() || !animation.contains("samplers")) continue;
        for (const Json& sampler : animation["samplers"])
            for (const char* const key : {"input", "output"})
                if (sampler.is_object() && sampler.contains(key) && sampler[key].is_number())
                    if (const double index = sampler[key].get<double>(); index >= 0 && index < 0x1p31)
                        walk.reach("accessors", static_cast<std::size_t>(index));
    }
    walk.follow();
    walk.reach_ancestors();
    return walk.take();
}

}  // namespace halflight
