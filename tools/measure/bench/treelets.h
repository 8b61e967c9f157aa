// Subtrees of a scene's hierarchies, by the triangles that they contain.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "engine/rays/packed_bvh.h"

namespace halflight::bench {

/// The largest subtrees with at most `most` triangles each; a leaf with more is a treelet, too.
class Treelets {
  public:
    Treelets(const rays::PackedScene& packed, std::size_t triangle_count, std::uint32_t most);

    /// Returns references (shaders/shared/bvh_nodes.h) of the treelets that contain a part of table triangle
    /// `triangle`.
    std::span<const std::uint32_t> of(std::uint32_t triangle) const {
        return std::span(references_).subspan(first_[triangle], first_[triangle + 1] - first_[triangle]);
    }
    std::size_t count() const { return count_; }

  private:
    std::vector<std::uint32_t> first_;  // by triangle, first index into references_; one more entry than triangles
    std::vector<std::uint32_t> references_;
    std::size_t count_ = 0;
};

}  // namespace halflight::bench
