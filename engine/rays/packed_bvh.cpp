#include "engine/rays/packed_bvh.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <chrono>
#include <cmath>

#include "engine/core/error.h"
#include "shaders/shared/bvh.h"

namespace halflight::rays {
namespace {

using shared::kBvhIndexMask;
using shared::kBvhTag;

// Positions and the boxes around them pass through at most 16 roundings of 2^-24 on their way to a decision: 6 of the
// triangle test (Woop, Benthin, Wald 2013), 3 of the ray's origin on the grid, 1 of the slab, the rest of the packing.
constexpr double kSlack = 0x1p-20;
// Rays in block space are off by four roundings of |M| (|o| + t |d|) + |M| |translation|, which seen from the world is
// their condition times as much, and each of the two lengths is at most twice the reach; so are the block's own 16.
constexpr double kInstanceSlack = 0x1p-18;
// Grid boxes whose area is that much greater cost more than their smaller nodes gain.
constexpr double kMaxLooseness = 1.3;

struct Grid {
    vec3 base{0};
    vec3 cell{1};
};

/// Cells are never so small that coordinates of 2^41 lose their meaning on the grid.
Grid grid_over(const Bounds& bounds) {
    if (bounds.empty()) return {};
    const vec3 extent = bounds.extent();
    const float least = std::max(std::max({extent.x, extent.y, extent.z}) * 0x1p-20f, 0x1p-60f);
    // One cell is left unused, for the rounding of the cell size itself.
    return {bounds.lower, glm::max(extent, vec3(least)) / (shared::kGridCells - 1.0f)};
}

std::uint32_t cell_below(double position, double base, double cell) {
    return static_cast<std::uint32_t>(
        std::clamp(std::floor((position - base) / cell), 0.0, double{shared::kGridCells}));
}
std::uint32_t cell_above(double position, double base, double cell) {
    return static_cast<std::uint32_t>(std::clamp(std::ceil((position - base) / cell), 0.0, double{shared::kGridCells}));
}

double half_area(const dvec3& e) {
    return e.x * e.y + e.y * e.z + e.z * e.x;
}

std::uint32_t index_word(std::size_t index, const char* what) {
    if (index > kBvhIndexMask) throw Error("rays", "more than 2^25 {}", what);
    return kBvhTag | static_cast<std::uint32_t>(index);
}

vec3 corner_of(const TraceTables& tables, std::uint32_t triangle, int corner) {
    return tables.positions[tables.triangles[triangle][corner]];
}

/// Outside of the box by one rounding, so that float arithmetic on the way to it makes no difference.
Bounds widened(const dvec3& lower, const dvec3& upper) {
    const vec3 l(lower), u(upper);
    return {l - glm::abs(l) * 0x1p-22f, u + glm::abs(u) * 0x1p-22f};
}

Bounds world_box(const BlockInstance& instance, const Bounds& box) {
    if (instance.identity) return box;
    // Arvo 1990, Transforming Axis-Aligned Bounding Boxes.
    dvec3 lower(instance.block_to_world[3]), upper = lower;
    for (int c = 0; c < 3; ++c) {
        const dvec3 a = dvec3(instance.block_to_world[c]) * double{box.lower[c]};
        const dvec3 b = dvec3(instance.block_to_world[c]) * double{box.upper[c]};
        lower += glm::min(a, b);
        upper += glm::max(a, b);
    }
    return widened(lower, upper);
}

/// |M| |M^-1| in the maximum norm.
double condition_of(const BlockInstance& instance) {
    double forward = 0, backward = 0;
    for (int row = 0; row < 3; ++row) {
        double f = 0, b = 0;
        for (int c = 0; c < 3; ++c) {
            f += std::abs(double{instance.block_to_world[c][row]});
            b += std::abs(double{instance.world_to_block[c][row]});
        }
        forward = std::max(forward, f);
        backward = std::max(backward, b);
    }
    return forward * backward;
}

/// Mean over all boxes of the area on the grid by the exact area; a box without area counts as 4 at most.
double looseness_of(const std::vector<Bvh>& hierarchies, const std::vector<Grid>& grids) {
    double sum = 0;
    std::size_t count = 0;
    for (std::size_t i = 0; i < hierarchies.size(); ++i) {
        for (const BvhNode& node : hierarchies[i].nodes) {
            for (const BvhChild& child : node.children) {
                if (child.bounds.empty()) continue;
                dvec3 snapped;
                for (int a = 0; a < 3; ++a) {
                    const double base = grids[i].base[a], cell = grids[i].cell[a];
                    snapped[a] = cell * (cell_above(child.bounds.upper[a], base, cell) -
                                         cell_below(child.bounds.lower[a], base, cell));
                }
                const double exact = half_area(dvec3(child.bounds.upper) - dvec3(child.bounds.lower));
                sum += half_area(snapped) < 4 * exact ? half_area(snapped) / exact : 4.0;
                ++count;
            }
        }
    }
    return count == 0 ? 1.0 : sum / static_cast<double>(count);
}

class Packer {
  public:
    explicit Packer(const TraceTables& tables) : tables_(tables) {
        packed_.two_level = tables.instances.size() > 1 ||
                            (!tables.instances.empty() && (tables.keep_top_level || !tables.instances[0].identity));
        if (packed_.two_level) add_top_level();
        std::vector<BuiltBlock> built(tables.blocks.size());
        tbb::parallel_for(std::size_t{0}, built.size(),
                          [&](std::size_t i) { built[i] = build_block(tables.blocks[i]); });
        for (std::size_t i = 0; i < built.size(); ++i) add_block(tables.blocks[i], std::move(built[i]));
        if (hierarchies_.empty()) add_nothing();
        packed_.looseness = looseness_of(hierarchies_, grids_);
    }

    double looseness() const { return packed_.looseness; }

    PackedScene pack(NodeFormat format) {
        packed_.format = format;
        std::vector<std::uint32_t> heads;
        std::size_t index = 0;
        std::uint32_t deepest_block = 0;
        for (std::size_t i = 0; i < hierarchies_.size(); ++i) {
            heads.push_back(index_word(index, "nodes") & kBvhIndexMask);
            index += 1 + hierarchies_[i].nodes.size();
            packed_.node_count += hierarchies_[i].nodes.size();
            if (!top_level(i)) deepest_block = std::max(deepest_block, hierarchies_[i].stack_entries);
        }
        index_word(index, "nodes");
        packed_.stack_entries = std::max(deepest_block, 1u);
        if (packed_.two_level) packed_.stack_entries += hierarchies_[0].stack_entries + 1;  // and kStackLeaveBlock
        for (const BlockInstance& instance : tables_.instances) {
            packed_.instance_head.push_back(heads[instance.block + (packed_.two_level ? 1u : 0u)]);
        }
        for (std::size_t i = 0; i < hierarchies_.size(); ++i) pack_hierarchy(i, heads[i]);
        packed_.build_seconds = std::chrono::duration<double>(Clock::now() - start_).count();
        return std::move(packed_);
    }

  private:
    using Clock = std::chrono::steady_clock;

    bool top_level(std::size_t i) const { return packed_.two_level && i == 0; }

    void add_top_level() {
        std::vector<Bounds> boxes;
        Bounds all;
        double condition = 1;
        for (const BlockInstance& instance : tables_.instances) {
            boxes.push_back(world_box(instance, tables_.blocks[instance.block].bounds));
            all.add(boxes.back());
            condition = std::max(condition, condition_of(instance));
        }
        hierarchies_.push_back(build_bvh(boxes));
        grids_.push_back(grid_over(all));
        slacks_.push_back(static_cast<float>(kInstanceSlack * condition));
        first_pair_.push_back(0);
    }

    struct BuiltBlock {
        Bvh hierarchy;  // over the rings
        std::vector<Ring> rings;
        std::vector<vec4> ids;  // last texel of each pair
    };

    BuiltBlock build_block(const Block& block) const {
        std::vector<Corners> triangles(block.triangle_count);
        for (std::uint32_t i = 0; i < block.triangle_count; ++i) {
            for (int k = 0; k < 3; ++k) {
                triangles[i][static_cast<std::size_t>(k)] = corner_of(tables_, block.first_triangle + i, k);
            }
        }
        BuiltBlock built;
        for (const TrianglePair& pair : pair_triangles(triangles)) {
            built.rings.push_back(ring_of(pair, triangles));
            built.ids.push_back(ids_of(pair, block.first_triangle));
        }
        built.hierarchy = build_pair_bvh(built.rings);
        return built;
    }

    vec4 ids_of(const TrianglePair& pair, std::uint32_t first_triangle) const {
        uvec3 words(kBvhTag);
        for (int which = 0; which < 2; ++which) {
            const std::uint32_t triangle = first_triangle + pair.triangles[static_cast<std::size_t>(which)];
            const bool alpha = (tables_.triangles[triangle].w & kTriangleAlpha) != 0;
            words[which] |= (alpha ? shared::kBvhAlphaTested : 0u) | triangle;
            const auto corners = corners_in_pair(pair, which);
            const auto place_of = [&](std::uint8_t corner) {
                return static_cast<std::uint32_t>(std::ranges::find(corners, corner) - corners.begin());
            };
            words.z |= (place_of(1) | place_of(2) << 2) << (which * shared::kBvhOrderShift);
        }
        return {std::bit_cast<float>(words.x), std::bit_cast<float>(words.y), std::bit_cast<float>(words.z), 0};
    }

    void add_block(const Block& block, BuiltBlock built) {
        hierarchies_.push_back(std::move(built.hierarchy));
        grids_.push_back(grid_over(block.bounds));
        slacks_.push_back(static_cast<float>(kSlack));
        const std::size_t slot = packed_.pairs.size() / shared::kBvhPairTexels;
        index_word(slot + hierarchies_.back().primitives.size(), "pairs of triangles");
        first_pair_.push_back(static_cast<std::uint32_t>(slot));
        for (const std::uint32_t primitive : hierarchies_.back().primitives) {
            const Ring& ring = built.rings[primitive];
            for (int a = 0; a < 3; ++a) packed_.pairs.emplace_back(ring[0][a], ring[1][a], ring[2][a], ring[3][a]);
            packed_.pairs.push_back(built.ids[primitive]);
        }
    }

    /// A scene without triangles: a root without children.
    void add_nothing() {
        hierarchies_.emplace_back().nodes.emplace_back();
        grids_.emplace_back();
        slacks_.push_back(static_cast<float>(kSlack));
        first_pair_.push_back(0);
    }

    std::uint32_t reference_to(const BvhChild& child, std::size_t hierarchy, std::uint32_t head) const {
        if (child.bounds.empty()) return shared::kBvhNoChild;
        if (!child.leaf()) return kBvhTag | (head + 1 + child.first);
        if (top_level(hierarchy)) return kBvhTag | shared::kBvhInstance | hierarchies_[0].primitives[child.first];
        return kBvhTag | shared::kBvhLeaf | (child.count << shared::kBvhCountShift) |
               (first_pair_[hierarchy] + child.first);
    }

    void pack_hierarchy(std::size_t i, std::uint32_t head) {
        const Grid& grid = grids_[i];
        const auto bits = [](float f) { return std::bit_cast<std::uint32_t>(f); };
        const bool on_grid = packed_.format == NodeFormat::grid;
        packed_.nodes.emplace_back(bits(grid.base.x), bits(grid.base.y), bits(grid.base.z), bits(slacks_[i]));
        packed_.nodes.emplace_back(bits(grid.cell.x), bits(grid.cell.y), bits(grid.cell.z), 0u);
        const std::size_t stride = on_grid ? shared::kBvhGridTexels : shared::kBvhFloatTexels;
        packed_.nodes.resize((head + 1) * stride);
        for (const BvhNode& node : hierarchies_[i].nodes) {
            std::vector<uvec4> texels(stride, uvec4(0));
            for (int k = 0; k < 4; ++k) {
                const BvhChild& child = node.children[static_cast<std::size_t>(k)];
                for (int a = 0; a < 3; ++a) {
                    if (on_grid) {
                        put_cells(texels[static_cast<std::size_t>(a)], k, child.bounds, grid, a);
                    } else {
                        texels[static_cast<std::size_t>(2 * a)][k] = bits(child.bounds.lower[a]);
                        texels[static_cast<std::size_t>(2 * a + 1)][k] = bits(child.bounds.upper[a]);
                    }
                }
                texels[on_grid ? 3 : 6][k] = reference_to(child, i, head);
            }
            packed_.nodes.insert(packed_.nodes.end(), texels.begin(), texels.end());
        }
    }

    static void put_cells(uvec4& texel, int k, const Bounds& box, const Grid& grid, int a) {
        const std::uint32_t lower = box.empty() ? 65535u : cell_below(box.lower[a], grid.base[a], grid.cell[a]);
        const std::uint32_t upper = box.empty() ? 0u : cell_above(box.upper[a], grid.base[a], grid.cell[a]);
        texel[k / 2] |= lower << (16 * (k % 2));
        texel[2 + k / 2] |= upper << (16 * (k % 2));
    }

    const Clock::time_point start_ = Clock::now();
    const TraceTables& tables_;
    PackedScene packed_;
    std::vector<Bvh> hierarchies_;  // the top level first, if there is one, then one per block
    std::vector<Grid> grids_;
    std::vector<float> slacks_;
    std::vector<std::uint32_t> first_pair_;  // slot in packed_.pairs
};

}  // namespace

PackedScene pack_scene(const TraceTables& tables) {
    Packer packer(tables);
    return packer.pack(packer.looseness() <= kMaxLooseness ? NodeFormat::grid : NodeFormat::floating);
}

PackedScene pack_scene(const TraceTables& tables, NodeFormat format) {
    return Packer(tables).pack(format);
}

}  // namespace halflight::rays
