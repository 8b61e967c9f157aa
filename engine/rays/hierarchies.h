// The hierarchies of a scene, and their updates for animated scenes. No OpenGL is used.
//
// Static triangles of a block (engine/tables/tables.h) form one part, or several if they are many, and each moving
// mesh forms another one. Each part has its own hierarchy; the hierarchies of a block are side by side under one root.
// Parts are built in parallel, and a build takes memory for its part alone.
//
// Hits on triangles that are split between leaves depend slightly on the leaves (shaders/lib/traverse.glsl). A hit that
// rounding puts before its leaf is moved to the ray's entry into it. Therefore a hierarchy must be a function of the
// reference pose and the current pose, not of the poses in between:
//   - A static part is built from its positions, which gives the same result as any earlier build.
//   - A moving part keeps the shape built for the reference pose and is refitted. It is built from its positions if the
//     shape does not fit: another number of triangles, or separated pairs. This also happens if the refit would cost
//     more than kMostRefitCost times the cost of the shape in the reference pose.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "engine/rays/bvh.h"
#include "engine/rays/pairs.h"
#include "engine/tables/tables.h"

namespace halflight::rays {

/// Maximum ratio of expected_cost(). A running fox reaches 1.3; hierarchies built for its poses would save a fifth of
/// that.
inline constexpr double kMostRefitCost = 1.5;

/// Maximum number of triangles in a static part. Blocks with more are cut along the longest axis, at the median of the
/// triangles' centres, until their parts are small enough. Pairs in such parts are not split between leaves: in a city
/// of 4 10^6 triangles that saves a third of the time to build and costs no time to trace.
inline constexpr std::size_t kMostInPart = std::size_t{1} << 20;

/// Triangles of a block that share a hierarchy.
struct Part {
    struct Span {
        std::uint32_t first = 0;  // index into TraceTables::triangles
        std::uint32_t count = 0;
        bool operator==(const Span&) const = default;
    };
    std::uint32_t block = 0;
    bool moves = false;
    bool cut = false;  // shares the block's static triangles with other parts
    // identity of moving parts: whether merged, and the index of the instance or of the shared mesh
    std::pair<bool, std::uint32_t> key{};
    std::vector<Span> spans{};  // spans in ascending order
};

/// Returns the parts in the order of blocks, static parts first, one for each block.
std::vector<Part> parts_of(const TraceTables& tables);
/// Returns the panes of each block that has any.
std::vector<Part> pane_parts_of(const TraceTables& tables);
/// Cuts a static part into parts of at most `most` triangles. Moving parts are not cut.
std::vector<Part> cut(const TraceTables& tables, Part part, std::size_t most = kMostInPart);
/// Returns the triangles of a part, indices into TraceTables::triangles.
std::vector<std::uint32_t> triangles_of(const Part& part);

struct PartTree {
    std::vector<TrianglePair> pairs;  // pairs of indices into triangles_of()
    std::vector<Ring> rings;          // one ring per pair
    Bvh bvh;                          // hierarchy over the rings
    double cost = 0;                  // expected_cost() of moving parts in the pose for which the shape was built
};

/// Builds the tree of a part from its positions. Throws Error if Embree fails.
PartTree build_tree(const TraceTables& tables, const Part& part);

/// Numbers of hierarchies by kind of update.
struct HierarchyCounts {
    std::size_t kept = 0;      // hierarchies left unchanged
    std::size_t refitted = 0;  // hierarchies with the same shape and new boxes
    std::size_t built = 0;
    bool operator==(const HierarchyCounts&) const = default;
};

class Hierarchies {
  public:
    /// Builds all hierarchies, with static parts of at most `most_in_part` triangles. `tables` are those of the
    /// reference pose. Throws Error if Embree fails.
    explicit Hierarchies(const TraceTables& tables, std::size_t most_in_part = kMostInPart);
    /// Updates the hierarchies from their current pose, `last`, to another one. Throws Error if Embree fails.
    void update(const TraceTables& last, const TraceTables& now);

    const std::vector<Part>& parts() const { return parts_; }
    const std::vector<PartTree>& trees() const& { return trees_; }  ///< Returns the tree of each part.
    std::vector<PartTree> trees() && { return std::move(trees_); }
    /// Returns the counts of the last update, or of the constructor.
    const HierarchyCounts& counts() const { return counts_; }
    double seconds() const { return seconds_; }  ///< Returns CPU clock seconds.

  private:
    enum class Fate : std::uint8_t { kept, refitted, built };
    Fate bring(const TraceTables& now, const Part& part, PartTree& tree) const;

    std::size_t most_in_part_;
    std::vector<Part> whole_;        // parts_of() the current pose
    std::vector<std::size_t> ends_;  // per whole part, the end of its parts in parts_
    std::vector<Part> parts_;
    std::vector<PartTree> trees_;
    std::map<std::pair<bool, std::uint32_t>, PartTree> shapes_;  // shapes of the reference pose, by Part::key
    HierarchyCounts counts_;
    double seconds_ = 0;
};

}  // namespace halflight::rays
