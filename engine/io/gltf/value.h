// Access to extensions, which tinygltf keeps as untyped values. schema.h has checked their types.
#pragma once

#include <tiny_gltf.h>

#include <string>

#include "engine/core/math.h"

namespace halflight {

/// Returns the object `key` of `extensions`, or null.
inline const tinygltf::Value* find_extension(const tinygltf::ExtensionMap& extensions, const std::string& key) {
    const auto found = extensions.find(key);
    return found == extensions.end() ? nullptr : &found->second;
}

inline double number(const tinygltf::Value& object, const std::string& key, double otherwise) {
    return object.Has(key) ? object.Get(key).GetNumberAsDouble() : otherwise;
}

inline int integer(const tinygltf::Value& object, const std::string& key, int otherwise) {
    return object.Has(key) ? object.Get(key).GetNumberAsInt() : otherwise;
}

/// Reads a dvec2, dvec3 or dvec4.
template <class V>
V vector(const tinygltf::Value& object, const std::string& key, V otherwise) {
    if (!object.Has(key)) return otherwise;
    const tinygltf::Value& array = object.Get(key);
    for (int i = 0; i < V::length(); ++i) otherwise[i] = array.Get(i).GetNumberAsDouble();
    return otherwise;
}

}  // namespace halflight
