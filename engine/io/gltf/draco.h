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

/// Returns the sizes of a primitive; none where it is not compressed. Throws Error about `element` for damaged headers
/// and for counts above those of the primitive's accessors.
std::optional<GltfPrimitiveSize> measure_draco(const GltfDocument& document, const tinygltf::Primitive& primitive,
                                               const std::string& element);

struct GltfDracoMesh {
    std::vector<std::uint32_t> indices;  // three per triangle
    GltfDecodedAccessors accessors;      // elements of the accessors that the compressed data replaces
    bool has_other_counts = false;       // the data has fewer elements than the accessors
};

/// Decodes a primitive; none where it is not compressed. Throws what measure_draco() throws, and Error for damaged data
/// and for data that does not fit into the memory budget.
std::optional<GltfDracoMesh> decode_draco(const GltfDocument& document, const tinygltf::Primitive& primitive,
                                          const std::string& element);

}  // namespace halflight
