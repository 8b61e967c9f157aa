// Names of the objects of a scene, by which edits find them.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/scene/scene.h"
#include "engine/scene/scene_tree.h"

namespace halflight {

/// The objects of one kind. The names refer to the scene or tree that they were made of.
struct NamedObjects {
    const char* kind;  // "light", "material", "node", "mesh"
    std::vector<std::string_view> names;
    std::vector<bool> left_out{};  // objects that no name finds; empty: none
    bool finds(std::size_t index) const { return left_out.empty() || !left_out[index]; }
};

NamedObjects lights_of(std::span<const PunctualLight> lights);
/// Lists Scene::lights before the surfaces that edits add. Materials and meshes that edits add are left out.
NamedObjects lights_of(const Scene& scene);
NamedObjects materials_of(const Scene& scene);
NamedObjects meshes_of(const Scene& scene);
NamedObjects nodes_of(const SceneTree& tree);

/// Returns whether a pattern with * (any characters) and ? (one character) matches the whole name.
bool matches_pattern(std::string_view pattern, std::string_view name);

/// Returns the objects that a name means (NamedEdit). Throws Error about `subject` if there are none, and if
/// several objects have the name.
std::vector<std::size_t> find_objects(const NamedObjects& objects, std::string_view name, const std::string& subject);
/// Returns all objects that have the name, or else match the pattern; none if there are none.
std::vector<std::size_t> objects_named(const NamedObjects& objects, std::string_view name);

/// Returns the objects of each kind that a name means: all of that name, or else those that match the pattern.
/// "KIND:NAME" selects a kind, and may have a number as NAME. Throws Error about `subject` if there are none.
std::vector<std::vector<std::size_t>> find_among(std::span<const NamedObjects> kinds, const std::string& name,
                                                 const std::string& subject);

/// Returns for each object the text by which find_objects() finds it alone: its name if that is unique, else its
/// number.
std::vector<std::string> references_to(const NamedObjects& objects);

}  // namespace halflight
