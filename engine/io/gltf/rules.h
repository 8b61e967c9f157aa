// The properties that a loader reads of glTF's objects, as a table; gltf_schema.h holds files against it.
#pragma once

#include <cstddef>
#include <map>
#include <string_view>
#include <vector>

namespace halflight {

/// What a property has to be.
enum class GltfKind {
    flag,
    number,
    natural,  // 0 to 2^31 - 1, or 2^53 where `of` is "size"
    text,
    texts,       // array
    numbers,     // array of `length` numbers, any number of them where length is 0
    index,       // into the list `of`
    indices,     // array
    index_map,   // object of indices
    index_maps,  // array of them
    object,      // of type `of`
    objects,     // array
};

struct GltfRule {
    const char* key;
    GltfKind kind;
    const char* of = "";  // list or type, see GltfKind
    std::size_t length = 0;
    bool required = false;
};

/// By type of object; glTF 2.0, section 5, and the extensions' schemas.
const std::map<std::string_view, std::vector<GltfRule>>& gltf_rules();

}  // namespace halflight
