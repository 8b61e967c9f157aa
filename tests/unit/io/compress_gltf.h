// Compresses geometry of glTF files with the encoders of the libraries that decode it.
#pragma once

#include <string>

#include "tests/unit/io/gltf_builder.h"

namespace halflight {

/// Adds a mesh of a wavy grid of n x n quads with NORMAL and TEXCOORD_0, indexed by 16-bit numbers, and its node;
/// returns the primitive. Positions lie in [0, n] x [0, n] x [-1, 1].
Json& add_grid(GltfBuilder& builder, int n);

/// Compresses the buffer view of an accessor by meshoptimizer: triangles, or indices, or elements with a stride of a
/// multiple of 4 bytes. The view then belongs to buffer 1, a fallback that add_meshopt_buffers() adds. Returns the
/// extension's object. `data` replaces the elements that are encoded, for filters.
Json& compress_by_meshopt(GltfBuilder& builder, int accessor, const char* mode, const std::string& data = "",
                          const char* extension = "EXT_meshopt_compression");
void add_meshopt_buffers(GltfBuilder& builder);

struct DracoEncoding {
    bool edgebreaker = true;
    int speed = 5;  // 0: smallest, 10: fastest
    int bits = 14;  // bits per number after quantisation; 0: not quantised
    bool metadata = false;
    bool share = false;  // equal values of an attribute are stored once, so that vertices split at seams
    int unused = 0;      // attributes of four numbers that the primitive does not use
};

/// Compresses all attributes of an indexed primitive of triangles, and its indices. Removes them from their buffer
/// views. Attributes have ids from 7 downwards, in the order of their names.
void compress_by_draco(GltfBuilder& builder, Json& primitive, const DracoEncoding& encoding = {});

/// Returns the message of loading a file for which the memory budget has these bytes left once its JSON is read.
std::string refusal_with_memory(const std::filesystem::path& path, std::size_t bytes);

}  // namespace halflight
