// Preview alone: a world-space cache of the light that paths find at their second vertices, in which later paths end.
//
// A hash grid, of cells by place, by the axis that the normal is closest to, and as long as their distance from the
// camera asks for (Binder et al. 2018 and 2019, path space filtering by hashing; Boissé et al. 2023, GI-1.0, keeps such
// cells across frames). They hold what a surface of albedo 1 reflects diffusely there, at three lengths; the albedo is
// the surface's own. Paths bring what they find beyond the second vertex to its cells and take their mean from there;
// where the shortest one is mature, seven of eight end. Too narrow beams (mirrors, corners, first surfaces close by)
// take none.
//
// A bias: of surfaces that differ within a cell, light that leaks through walls thinner than one, edges of shadows.
#pragma once

#include "engine/settings/preview.h"
#include "passes/light/continuation.h"

namespace halflight {

/// What renderers of one scene with one number of bounces may share, on one thread. Pictures depend on all that were
/// made with it before, and on bands; never on who traces or on the order in which paths are worked on: sums are
/// integers, and of several keys that ask for a cell the largest gets it.
class RadianceCache {
  public:
    RadianceCache();

    /// To be called when anything but the camera has changed: light, material, geometry, bounces.
    void clear();
    /// Counts anew what finds no cell; every 64th time frees what the last 192 pictures have not used.
    void begin_picture(gpu::ProgramCache& programs);

    std::uint32_t picture() const { return picture_; }                      ///< the one that has begun last, from 1
    gpu::Buffer& cells() { return cells_; }                                 ///< CacheCell
    gpu::Buffer& counts() { return counts_; }                               ///< CacheCounts
    std::size_t bytes() const { return cells_.bytes() + counts_.bytes(); }  ///< in device memory
    CacheStatistics statistics() const;                                     ///< waits for the device

  private:
    gpu::Buffer cells_;
    gpu::Buffer counts_;
    std::uint32_t picture_ = 0;
};

/// Lets the continuation of `paths` use the cache: CachePoints for every path in `points`, and `cells`.
void use_radiance_cache(graph::Graph& graph, const SceneView& view, RadianceCache& cache, PathBuffers& paths);

/// After the continuation of paths that use it: brings what they have found to its cells, and adds what these hold to
/// the states of the paths. Marks what it changes as outputs.
void add_radiance_cache(graph::Graph& graph, const SceneView& view, RadianceCache& cache,
                        const Continuation& continuation, PathBuffers& paths);

}  // namespace halflight
