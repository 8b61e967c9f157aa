// Coherent hierarchical culling as in CHC++ (Mattausch, Bittner, Wimmer 2008, CHC++: Coherent Hierarchical Culling
// Revisited, Computer Graphics Forum 27(2)), of rays instead of pixels. Pure: no OpenGL.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "engine/rays/kinds.h"
#include "engine/rays/raster_tree.h"

namespace halflight::rays {

/// Seconds of the process, all its threads together.
struct RasterStages {
    double bounds = 0;  // shafts of tiles and blocks
    double ask = 0;     // queries
    double mark = 0;    // candidates of tiles
    double trace = 0;
    double end = 0;  // how far tiles still reach
};

/// What a run has cost and saved; sums over runs.
struct RasterStatistics {
    std::size_t runs = 0;
    std::size_t queries = 0;        // issued
    std::size_t multi_queries = 0;  // of them, about more than one node
    std::size_t saved_hidden = 0;   // queries that multi-queries made needless
    std::size_t saved_visible = 0;  // visible leaves that were not due for a re-test
    std::size_t waits = 0;          // for an answer, with nothing else left to do
    std::size_t nodes = 0;          // visited
    std::size_t leaves = 0;         // traced
    std::size_t traces = 0;         // draws of leaves, up to kRasterCandidates each
    double seconds = 0;             // of the CPU, waiting included
    std::size_t pairs = 0;          // of list entry and tile; where measured
    RasterStages stages;            // where measured
};

/// Raster culling of the batches of one kind and depth, summed over all places of the picture.
struct RasterBatch {
    RayKind kind = RayKind::primary;
    std::uint32_t depth = 0;
    RasterStatistics statistics;
};

/// What is remembered of a node. Any bits will do: they can only cost time.
struct CullMemory {
    std::uint32_t since = 0;   // run in which its visibility last changed
    std::uint32_t retest = 0;  // run in which a visible leaf is asked about again
    std::uint32_t visible = 0;
};

struct CullState {
    std::vector<CullMemory> nodes;  // by index into CullTree::nodes; of another size: nothing is remembered
    std::uint32_t run = 0;
    vec3 eye{0};  // where rays start, more or less: decides what is near
};

/// Who traces and who answers.
class CullDevice {
  public:
    virtual ~CullDevice() = default;
    /// Leaves, 1 to shared::kRasterCandidates, near ones first.
    virtual void trace(std::span<const std::uint32_t> leaves) = 0;
    /// Asks whether any ray can meet any of these nodes' boxes before it ends; 1 to kRasterCandidates indices into
    /// CullTree::nodes. The answer may be "yes" for no reason. Questions are numbered from 0.
    virtual void ask(std::span<const std::uint32_t> nodes) = 0;
    /// Nothing, where it is not known yet and `wait` is not set.
    virtual std::optional<bool> answer(std::size_t question, bool wait) = 0;
};

/// Squared, from a point to a box.
float distance_to(const Bounds& box, const vec3& point);

/// Traces every leaf that a ray may meet.
void walk(const CullTree& tree, CullState& state, CullDevice& device, RasterStatistics& statistics);

}  // namespace halflight::rays
