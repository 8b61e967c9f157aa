// The hierarchies of a scene, and what becomes of them while it moves. No OpenGL.
//
// Triangles of a block (engine/tables/tables.h) that keep their places are one part, each mesh that moves another one.
// Parts have hierarchies of their own, which lie side by side under one root where a block has several.
//
// Hits depend a little on leaves: a hit that rounding has put before the box of its leaf counts as being where the ray
// enters it (shaders/lib/traverse.glsl). So what becomes of a part must follow from the reference pose and the pose
// alone, never from the poses between:
//   - what does not move is built from where it is, which gives the same as what was built before for the same places;
//   - what moves has the shape that was built for the reference pose, refitted; where that does not fit (another number
//     of triangles, pairs that came apart) or would cost kMostRefitCost times what it did there, it is built from where
//     it is.
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

/// By expected_cost(). A fox that runs comes to 1.3; hierarchies built for its poses would spare a fifth of that.
inline constexpr double kMostRefitCost = 1.5;

/// Triangles of a block that share a hierarchy.
struct Part {
    struct Span {
        std::uint32_t first = 0;  // index into TraceTables::triangles
        std::uint32_t count = 0;
    };
    std::uint32_t block = 0;
    bool moves = false;
    std::pair<bool, std::uint32_t> key;  // of what moves: merged and the instance, or the shared mesh
    std::vector<Span> spans;             // ascending
};

/// In the order of blocks; what keeps its places before what moves.
std::vector<Part> parts_of(const TraceTables& tables);
/// Triangles of a part, indices into TraceTables::triangles.
std::vector<std::uint32_t> triangles_of(const Part& part);

struct PartTree {
    std::vector<TrianglePair> pairs;  // of places in triangles_of()
    std::vector<Ring> rings;          // of the pairs
    Bvh bvh;                          // over the rings
    double cost = 0;                  // expected_cost() of the pose that the shape was built for; of what moves
};

/// What became of the hierarchies of parts.
struct HierarchyCounts {
    std::size_t kept = 0;      // nothing in them has changed
    std::size_t refitted = 0;  // the boxes have
    std::size_t built = 0;
    bool operator==(const HierarchyCounts&) const = default;
};

class Hierarchies {
  public:
    /// Builds all of them. tables: of the reference pose. Throws Error where Embree does.
    explicit Hierarchies(const TraceTables& tables);
    /// Brings them from the pose that they are of, `last`, to another one. Throws the same.
    void update(const TraceTables& last, const TraceTables& now);

    const std::vector<Part>& parts() const { return parts_; }
    const std::vector<PartTree>& trees() const { return trees_; }  ///< of parts()
    // Of the last update, or of the constructor:
    const HierarchyCounts& counts() const { return counts_; }
    double seconds() const { return seconds_; }  ///< CPU clock

  private:
    enum class Fate : std::uint8_t { kept, refitted, built };
    Fate bring(const TraceTables& now, const Part& part, PartTree& tree) const;

    std::vector<Part> parts_;
    std::vector<PartTree> trees_;
    std::map<std::pair<bool, std::uint32_t>, PartTree> shapes_;  // of the reference pose, by Part::key
    HierarchyCounts counts_;
    double seconds_ = 0;
};

}  // namespace halflight::rays
