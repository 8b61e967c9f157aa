// Coherent hierarchical culling of rays, after CHC++ (Mattausch, Bittner, Wimmer 2008, CHC++: Coherent Hierarchical
// Culling Revisited, Computer Graphics Forum 27(2)). No OpenGL is used.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "engine/rays/kinds.h"
#include "engine/rays/raster_tree.h"

namespace halflight::rays {

/// Seconds of CPU time, summed over the process's threads.
struct RasterStages {
    double bounds = 0;  // making shafts of tiles and blocks
    double ask = 0;     // issuing occlusion queries
    double mark = 0;    // making lists of tiles
    double trace = 0;
    double end = 0;  // finding the reach of tiles after tracing
};

/// Costs and savings, summed over runs.
struct RasterStatistics {
    std::size_t runs = 0;
    std::size_t queries = 0;        // queries issued
    std::size_t multi_queries = 0;  // queries for more than one node
    std::size_t saved_hidden = 0;   // queries saved by multi-queries
    std::size_t saved_visible = 0;  // visible leaves that were not due for a re-test
    std::size_t waits = 0;          // waits for an answer without other work
    std::size_t nodes = 0;          // nodes visited
    std::size_t leaves = 0;         // leaves traced
    std::size_t traces = 0;         // draws of leaves, up to kRasterCandidates leaves each
    double seconds = 0;             // seconds of the CPU clock, including waits
    std::size_t pairs = 0;          // pairs of list entry and tile, if measured
    RasterStages stages;            // times of stages, if measured
};

/// Raster culling of the batches of one kind and depth, summed over all places of the picture.
struct RasterBatch {
    RayKind kind = RayKind::primary;
    std::uint32_t depth = 0;
    RasterStatistics statistics;
};

/// Visibility state of a node. Arbitrary bits are safe; they only cost time.
struct CullMemory {
    std::uint32_t since = 0;   // run in which the visibility last changed
    std::uint32_t retest = 0;  // run in which a visible leaf is queried again
    std::uint32_t visible = 0;
};

struct CullState {
    std::vector<CullMemory> nodes;  // parallel to CullTree::nodes; ignored if the sizes differ
    std::uint32_t run = 0;
    vec3 eye{0};  // mean origin of the rays, which determines front-to-back order
};

/// Interface of a device that traces leaves and answers queries.
class CullDevice {
  public:
    virtual ~CullDevice() = default;
    /// Traces 1 to shared::kRasterCandidates leaves, sorted front to back.
    virtual void trace(std::span<const std::uint32_t> leaves) = 0;
    /// Issues a query: can any ray meet any of these nodes' boxes before it ends? Takes 1 to kRasterCandidates indices
    /// into CullTree::nodes. The answer may be a false "yes". Queries are numbered from 0.
    virtual void ask(std::span<const std::uint32_t> nodes) = 0;
    /// Returns the answer; nothing while it is unknown, unless `wait` is set.
    virtual std::optional<bool> answer(std::size_t question, bool wait) = 0;
};

/// Returns the squared distance from a point to a box.
float distance_to(const Bounds& box, const vec3& point);

/// Traverses the tree front to back and traces every leaf that a ray may meet.
void walk(const CullTree& tree, CullState& state, CullDevice& device, RasterStatistics& statistics);

}  // namespace halflight::rays
