// Primitives compressed by Draco (KHR_draco_mesh_compression, bitstream version 2.2).
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "engine/io/gltf/accessor.h"

namespace halflight {

/// Largest sizes of a primitive, from headers.
struct GltfPrimitiveSize {
    std::size_t vertices = 0;
    std::size_t triangles = 0;
    std::size_t decoding_bytes = 0;  // working memory of a decoder
};

/// Returns the sizes of a primitive; none if it is not compressed. The counts of the data apply, not those of the
/// accessors. Throws Error about `element` for damaged headers and for counts that data of its length cannot have.
std::optional<GltfPrimitiveSize> measure_draco(const GltfDocument& document, const tinygltf::Primitive& primitive,
                                               const std::string& element);

struct GltfDracoMesh {
    std::vector<std::uint32_t> indices;  // three per triangle
    GltfDecodedAccessors accessors;      // elements of the accessors that the compressed data replaces
    bool has_other_counts = false;       // the data has fewer or more elements than the accessors
    std::vector<std::string> missing;    // attributes that neither the data nor the accessors have
    std::vector<std::string> beside;     // attributes that the data lacks against its list; those of accessors apply
};

/// Returns whether an attribute has elements in the compressed data, according to its list, or in its accessor. Those
/// of primitives that are not compressed have.
bool has_elements(const GltfDocument& document, const tinygltf::Primitive& primitive, const std::string& attribute);

/// Decodes a primitive; none if it is not compressed. Throws what measure_draco() throws, and Error for damaged data
/// and for data that does not fit into the memory budget.
std::optional<GltfDracoMesh> decode_draco(const GltfDocument& document, const tinygltf::Primitive& primitive,
                                          const std::string& element);

}  // namespace halflight
