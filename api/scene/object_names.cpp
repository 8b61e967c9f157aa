#include "api/halflight/object_names.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <map>
#include <optional>

#include "api/scene/added_surfaces.h"
#include "engine/core/error.h"
#include "engine/core/suggestion.h"

namespace halflight {
namespace {

template <class Objects>
NamedObjects named(const char* kind, const Objects& objects) {
    NamedObjects all{kind, {}};
    for (const auto& object : objects) all.names.emplace_back(object.name);
    return all;
}

bool is_number(std::string_view name) {
    return !name.empty() && name.find_first_not_of("0123456789") == std::string_view::npos;
}

bool is_pattern(std::string_view name) {
    return name.find_first_of("*?") != std::string_view::npos;
}

template <class Matches>
std::vector<std::size_t> indices_where(const NamedObjects& objects, const Matches& matches) {
    std::vector<std::size_t> found;
    for (std::size_t i = 0; i < objects.names.size(); ++i)
        if (objects.finds(i) && matches(objects.names[i])) found.push_back(i);
    return found;
}

}  // namespace

NamedObjects lights_of(std::span<const PunctualLight> lights) {
    return named("light", lights);
}

NamedObjects lights_of(const Scene& scene) {
    NamedObjects lights = lights_of(scene.lights);
    for (std::size_t i = own_parts(scene).instances; i < scene.instances.size(); ++i)
        if (!scene.instances[i].catcher) lights.names.emplace_back(scene.instances[i].name);
    return lights;
}

NamedObjects materials_of(const Scene& scene) {
    return named("material", std::span(scene.materials).first(own_parts(scene).materials));
}

NamedObjects meshes_of(const Scene& scene) {
    return named("mesh", std::span(scene.meshes).first(own_parts(scene).meshes));
}

NamedObjects nodes_of(const SceneTree& tree) {
    NamedObjects nodes = named("node", tree.nodes);
    for (const SceneNode& node : tree.nodes) nodes.left_out.push_back(!node.in_scene);
    return nodes;
}

bool matches_pattern(std::string_view pattern, std::string_view name) {
    constexpr std::size_t kNo = std::string_view::npos;
    std::size_t p = 0, n = 0, star = kNo, taken = 0;  // `taken`: end of what the last star takes
    while (n < name.size()) {
        if (p < pattern.size() && pattern[p] == '*') {
            star = p++, taken = n;
        } else if (p < pattern.size() && (pattern[p] == '?' || pattern[p] == name[n])) {
            ++p, ++n;
        } else if (star != kNo) {
            p = star + 1, n = ++taken;
        } else {
            return false;
        }
    }
    return pattern.find_first_not_of('*', p) == kNo;
}

std::vector<std::size_t> objects_named(const NamedObjects& objects, std::string_view name) {
    auto found = indices_where(objects, [&](std::string_view other) { return !name.empty() && other == name; });
    if (found.empty() && is_pattern(name))
        found = indices_where(objects, [&](std::string_view other) { return matches_pattern(name, other); });
    return found;
}

std::vector<std::size_t> find_objects(const NamedObjects& objects, std::string_view name, const std::string& subject) {
    const std::size_t count = objects.names.size();
    if (is_number(name)) {
        std::size_t index = 0;
        const auto error = std::from_chars(name.data(), name.data() + name.size(), index).ec;
        if (error != std::errc() || index >= count)
            throw Error(subject, "there is no {} {}; the scene has {}, numbered from 0", objects.kind, name, count);
        return {index};
    }
    std::vector<std::size_t> found = objects_named(objects, name);
    const bool exact = !found.empty() && objects.names[found[0]] == name;
    if (exact && found.size() > 1) {
        constexpr std::size_t kMost = 8;
        std::vector<std::string> numbers;
        for (std::size_t i = 0; i < std::min(found.size(), kMost); ++i) numbers.push_back(std::to_string(found[i]));
        if (found.size() > kMost) numbers.emplace_back("...");
        throw Error(subject, "'{}' is the name of {} {}s; use a number: {}", name, found.size(), objects.kind,
                    fmt::join(numbers, ", "));
    }
    if (!found.empty()) return found;
    if (is_pattern(name)) throw Error(subject, "no {} matches '{}'", objects.kind, name);
    std::vector<std::string> names;
    for (std::size_t i = 0; i < count; ++i)
        if (objects.finds(i)) names.emplace_back(objects.names[i]);
    std::string hint = did_you_mean(name, names);
    if (hint.empty()) hint = count == 0 ? "; the scene has none" : "; `halflight info SCENE --names` lists the names";
    throw Error(subject, "there is no {} '{}'{}", objects.kind, name, hint);
}

std::vector<std::vector<std::size_t>> find_among(std::span<const NamedObjects> kinds, const std::string& name,
                                                 const std::string& subject) {
    std::vector<std::vector<std::size_t>> found;
    bool any = false;
    for (const NamedObjects& kind : kinds) {
        const std::string prefix = fmt::format("{}:", kind.kind);
        std::vector<std::size_t> objects = objects_named(kind, name);
        if (name.starts_with(prefix)) {
            const std::string rest = name.substr(prefix.size());
            objects = objects_named(kind, rest);
            if (objects.empty()) objects = find_objects(kind, rest, subject);  // a number, or an error
        }
        any = any || !objects.empty();
        found.push_back(std::move(objects));
    }
    if (any) return found;
    std::vector<std::string> words, choices;
    NamedObjects all{"", {}};
    for (const NamedObjects& kind : kinds) {
        words.emplace_back(kind.kind);
        choices.push_back(fmt::format("{}:{}", kind.kind, name));
        for (std::size_t i = 0; i < kind.names.size(); ++i)
            if (kind.finds(i)) all.names.push_back(kind.names[i]);
    }
    const auto listed = [](std::vector<std::string> items) {
        const std::string last = items.back();
        items.pop_back();
        return fmt::format("{} or {}", fmt::join(items, ", "), last);
    };
    if (is_number(name)) throw Error(subject, "'{}' needs a kind: {}", name, listed(choices));
    const std::string kind = listed(words);
    all.kind = kind.c_str();
    find_objects(all, name, subject);  // throws
    return found;
}

std::vector<std::string> references_to(const NamedObjects& objects) {
    std::map<std::string_view, std::size_t> counts;
    for (std::size_t i = 0; i < objects.names.size(); ++i)
        if (objects.finds(i)) ++counts[objects.names[i]];
    std::vector<std::string> references;
    for (std::size_t i = 0; i < objects.names.size(); ++i) {
        const std::string_view name = objects.names[i];
        const bool plain = std::ranges::none_of(name, [](unsigned char c) { return std::iscntrl(c) != 0; });
        const bool unique = !name.empty() && !is_number(name) && plain && objects.finds(i) && counts[name] == 1;
        references.push_back(unique ? std::string(name) : std::to_string(i));
    }
    return references;
}

}  // namespace halflight
