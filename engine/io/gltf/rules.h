// The table of properties that the loader reads from glTF objects. schema.h checks files against it.
#pragma once

#include <cstddef>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace halflight {

/// JSON type of a property.
enum class GltfKind {
    anything,
    flag,
    number,
    natural,  // 0 to 2^31 - 1, or 2^53 if `of` is "size"
    text,
    texts,        // array of text
    numbers,      // array of `length` numbers; of any length if `length` is 0
    index,        // index into the list `of`
    indices,      // array of such indices
    index_map,    // object whose values are such indices
    index_maps,   // array of objects whose values are such indices
    index_lists,  // array of arrays of such indices
    naturals,     // object whose values are natural
    object,       // object of type `of`
    objects,      // array of such objects
};

struct GltfRule {
    std::string key;
    GltfKind kind;
    std::string of = "";  // list or type, see GltfKind
    std::size_t length = 0;
    bool required = false;
    bool dropped = false;  // whether a fault removes the object, or the element of its array, with a warning
};

/// Names of the lists of other extensions of lights than KHR_lights_punctual. Their key, "lights", is that of another
/// list.
inline constexpr const char* kLightProfileList = "light profiles";
inline constexpr const char* kAreaLightList = "area lights";
inline constexpr const char* kImageLightList = "image lights";

/// Rules of an object, by its type.
using GltfRules = std::map<std::string, std::vector<GltfRule>, std::less<>>;
/// Returns the rules of all types (glTF 2.0, section 5, and the extensions' schemas). The rules of materials come from
/// gltf_material_keys(), and those of the numeric properties of lights from light_properties().
const GltfRules& gltf_rules();

/// Returns a valid object, as JSON, for types of which it may take the place of null, or of an object with faults that
/// nothing uses.
const std::map<std::string, std::string, std::less<>>& gltf_stubs();

/// Returns the names of the supported extensions: those of the objects "extensions" in the rules, and those that need
/// no rule.
const std::set<std::string>& gltf_extensions();

/// Returns why a picture does not depend on an extension, so that files may require it; null: it does, or it is
/// unknown.
const char* gltf_extension_without_effect(const std::string& name);

}  // namespace halflight
