// Nodes of pages (shaders/shared/bvh.h). No OpenGL is used.
#pragma once

#include <array>
#include <cstdint>

#include "engine/core/math.h"
#include "engine/rays/bvh.h"
#include "shaders/shared/bvh.h"

namespace halflight::rays {

using PageNode = std::array<uvec4, shared::kBvhPageTexels>;

/// Encodes a node whose children have the given references. Decoded boxes contain the boxes of the children, exactly in
/// float arithmetic. Missing children have the reference kBvhNoChild and an empty box.
PageNode encode_page_node(const BvhNode& node, const std::array<std::uint32_t, 4>& references);

/// Returns the box of a child as kernels decode it. An empty box may have any lower end above its upper end.
Bounds decode_page_box(const PageNode& node, int child);

}  // namespace halflight::rays
