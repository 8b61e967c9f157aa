// Checks of pages as kernels read them.
#pragma once

#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

#include "engine/paging/pages.h"
#include "shaders/shared/bvh_nodes.h"

namespace halflight::test {

/// Follows all references of a page, like a ray that meets all of its boxes.
class SlotCheck {
  public:
    SlotCheck(const paging::LoadedPage& page, const paging::PageIndex& index)
        : page_(page), index_(index), read_(page.texels.size(), false) {}

    /// Returns what is wrong with the page; empty if nothing is.
    std::string defect() {
        for (const rays::PageNode& root : page_.roots)
            if (stack_below(root, 0) > index_.stack_entries) return "the stack is too small";
        return defect_;
    }

  private:
    /// Returns the maximum stack of a traversal that starts at a node.
    std::uint32_t stack_below(rays::PageNode node, std::uint32_t texel) {
        std::uint32_t children = 0, deepest = 0;
        for (int k = 0; k < 4; ++k) {
            const rays::PageChild child = rays::page_child(node, k);
            if (!child.exists) continue;
            ++children;
            const std::uint32_t at = texel + rays::distance_of(node) + child.offset;
            if (!read(at, child.pairs > 0 ? child.pairs : shared::kBvhPageTexels)) return 0;
            for (std::uint32_t i = 0; i < child.pairs; ++i) check_pair(at + i);
            if (child.pairs > 0) continue;
            rays::PageNode next;
            std::copy_n(page_.texels.begin() + at, next.size(), next.begin());
            deepest = std::max(deepest, stack_below(next, at));
        }
        return deepest + std::max(children, 1u) - 1;
    }

    /// Notes that texels are read. Returns whether they are in the slot and have not been read before.
    bool read(std::uint32_t first, std::uint32_t count) {
        for (std::uint64_t texel = first; texel < std::uint64_t{first} + count; ++texel) {
            if (texel >= read_.size() || read_[texel]) {
                defect_ = "a reference leads out of the page, or two lead to one place";
                return false;
            }
            read_[texel] = true;
        }
        return true;
    }

    void check_pair(std::uint32_t texel) {
        const uvec4& pair = page_.texels[texel];
        std::size_t row = page_.first_rows.empty() ? 0 : page_.first_rows[texel];
        for (int which = 0; which < 2; ++which) {
            const std::uint32_t id = pair[which] & shared::kBvhTriangleMask;
            if (id >= index_.triangles) defect_ = "a triangle is out of range";
            for (const int shift : {0, shared::kBvhPageCornerBits}) {
                const std::size_t corner = (pair[2 + which] >> shift) & shared::kBvhPageCornerMask;
                if ((corner + 1) * sizeof(vec3) > page_.texels.size() * sizeof(uvec4))
                    defect_ = "a corner is out of range";
            }
            const bool single = which == 1 && id == (pair.x & shared::kBvhTriangleMask);
            if (!index_.alpha || single || (pair[which] & shared::kBvhPageAlpha) == 0) continue;
            if (row++ >= page_.rows.triangles.size()) defect_ = "a row is missing";
        }
    }

    const paging::LoadedPage& page_;
    const paging::PageIndex& index_;
    std::vector<bool> read_;
    std::string defect_;
};

}  // namespace halflight::test
