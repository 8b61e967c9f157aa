// tinygltf's model of a glTF file: the objects of glTF 2.0, section 5, as plain values.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

// Files are opened, and images decoded, by this project: it reads parts of buffers, and accepts more formats.
#define TINYGLTF_NO_FS
#define TINYGLTF_NO_EXTERNAL_IMAGE
#define TINYGLTF_NO_STB_IMAGE
#define TINYGLTF_NO_STB_IMAGE_WRITE
// Another name of the namespace lets programs with a tinygltf of their own, of any version, link this library.
#define tinygltf halflight_tinygltf
#include <tiny_gltf.h>
#undef tinygltf

namespace halflight {

namespace tinygltf = ::halflight_tinygltf;

/// Converts a file that has passed check_gltf(), without its buffers, images, materials and animations. Throws Error
/// that names `file` if tinygltf refuses the rest.
tinygltf::Model to_model(nlohmann::json root, const std::string& file);

/// Returns the object `key` of `extensions`, or null.
inline const tinygltf::Value* find_extension(const tinygltf::ExtensionMap& extensions, const char* key) {
    const auto found = extensions.find(key);
    return found == extensions.end() ? nullptr : &found->second;
}

}  // namespace halflight
