#include "tools/measure/bench/treelets.h"

#include <algorithm>
#include <bit>
#include <utility>

#include "shaders/shared/bvh_nodes.h"

namespace halflight::bench {
namespace {

class Walk {
  public:
    Walk(const rays::PackedScene& packed, std::uint32_t most) : packed_(packed), most_(most) {}

    void block(std::uint32_t head) {
        const std::uint32_t root = shared::kBvhTag | (head + 1);
        if (size(root) <= most_) add(root);
    }

    std::vector<std::pair<std::uint32_t, std::uint32_t>> found;  // triangle and treelet that contains it
    std::size_t count = 0;

  private:
    static bool leaf(std::uint32_t reference) { return (reference & shared::kBvhLeaf) != 0; }
    /// Returns the number of triangle pairs in a leaf.
    static std::uint32_t leaf_size(std::uint32_t reference) { return (reference >> shared::kBvhCountShift) & 7u; }

    uvec4 children(std::uint32_t reference) const {
        const std::size_t node = reference & shared::kBvhIndexMask;
        return packed_.format == rays::NodeFormat::grid ? packed_.nodes[node * shared::kBvhGridTexels + 3]
                                                        : packed_.nodes[node * shared::kBvhFloatTexels + 6];
    }

    /// Returns the number of triangles below, counting two for each pair. If it exceeds most_, adds the children
    /// that are small enough as treelets.
    std::uint32_t size(std::uint32_t reference) {
        if (leaf(reference)) return 2 * leaf_size(reference);
        const uvec4 below = children(reference);
        std::uint32_t sizes[4], sum = 0;
        for (int i = 0; i < 4; ++i) sum += sizes[i] = size(below[i]);
        for (int i = 0; sum > most_ && i < 4; ++i)
            if (sizes[i] > 0 && (sizes[i] <= most_ || leaf(below[i]))) add(below[i]);
        return sum;
    }

    void add(std::uint32_t reference) {
        ++count;
        add_leaves(reference, reference);
    }
    void add_leaves(std::uint32_t reference, std::uint32_t treelet) {
        if (leaf(reference)) {
            for (std::uint32_t i = 0; i < leaf_size(reference); ++i) {
                const std::size_t pair = (reference & shared::kBvhIndexMask) + i;
                const vec4& ids = packed_.pairs[shared::kBvhPairTexels * pair + 3];
                for (int which = 0; which < 2; ++which) {
                    const auto id = std::bit_cast<std::uint32_t>(ids[which]);
                    found.emplace_back(id & shared::kBvhTriangleMask, treelet);
                }
            }
        } else {
            const uvec4 below = children(reference);
            for (int i = 0; i < 4; ++i) add_leaves(below[i], treelet);
        }
    }

    const rays::PackedScene& packed_;
    std::uint32_t most_;
};

}  // namespace

Treelets::Treelets(const rays::PackedScene& packed, std::size_t triangle_count, std::uint32_t most) {
    std::vector<std::uint32_t> heads = packed.instance_head;
    std::ranges::sort(heads);
    heads.erase(std::unique(heads.begin(), heads.end()), heads.end());
    Walk walk(packed, most);
    for (const std::uint32_t head : heads) walk.block(head);
    count_ = walk.count;
    std::ranges::sort(walk.found);
    walk.found.erase(std::unique(walk.found.begin(), walk.found.end()), walk.found.end());
    first_.assign(triangle_count + 1, 0);
    for (const auto& [triangle, reference] : walk.found) {
        ++first_[triangle + 1];
        references_.push_back(reference);
    }
    for (std::size_t i = 1; i < first_.size(); ++i) first_[i] += first_[i - 1];
}

}  // namespace halflight::bench
