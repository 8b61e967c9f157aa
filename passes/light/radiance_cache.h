// World-space radiance cache for the preview: it stores the light that paths find at their second vertices, and later
// paths end in it.
//
// The cache is a hash grid (Binder et al. 2018 and 2019, path space filtering by hashing; Boissé et al. 2023, GI-1.0,
// keeps such cells across frames). The key of a cell is its position, the axis closest to the normal, and its edge
// length, which grows with the distance from the camera. Cells hold the diffusely reflected light of a surface of
// albedo 1, at three edge lengths; each surface multiplies by its albedo. Paths add the light found beyond the second
// vertex to its cells and use the mean of these cells. If the shortest cell is mature, seven of eight paths end.
// Narrow beams (mirrors, corners, close first surfaces) do not use the cache.
//
// The cache is biased where surfaces differ within a cell, where light leaks through walls thinner than a cell, and at
// the edges of shadows.
#pragma once

#include "engine/settings/preview.h"
#include "passes/steps/light_answers.h"
#include "passes/steps/paths.h"

namespace halflight {

/// The cells of the cache. Renderers of one scene with one number of bounces may share it on one thread. Pictures
/// depend on all earlier pictures made with the cache, and on bands. They do not depend on the tracing method or the
/// order of paths. Sums are integers, and the largest of several keys wins a cell.
class RadianceCache {
  public:
    RadianceCache();
    /// Describes a cache for graphs that are compiled and never run. Needs no context.
    explicit RadianceCache(gpu::Buffer::Unmade unmade) : cells_("", 0, unmade), counts_("", 0, unmade) {}

    /// Empties the cache. It must be called when anything but the camera changes: light, material, geometry, bounces.
    void clear();
    /// Starts a picture: resets the count of paths without a cell. Every 64th call frees the cells that the last 192
    /// pictures have not used.
    void begin_picture(gpu::ProgramCache& programs);

    std::uint32_t picture() const { return picture_; }                      ///< Returns the current picture, from 1.
    gpu::Buffer& cells() { return cells_; }                                 ///< Returns a buffer of CacheCell.
    gpu::Buffer& counts() { return counts_; }                               ///< Returns a buffer of CacheCounts.
    std::size_t bytes() const { return cells_.bytes() + counts_.bytes(); }  ///< Returns the device memory, bytes.
    CacheStatistics statistics() const;                                     ///< Waits for the device.

  private:
    gpu::Buffer cells_;
    gpu::Buffer counts_;
    std::uint32_t picture_ = 0;
};

/// Makes the continuation of `paths` use the cache: sets `points` (a CachePoint per path) and `cells`.
void use_radiance_cache(graph::Graph& graph, const SceneView& view, RadianceCache& cache, PathBuffers& paths);

/// Adds, after the continuation of `paths`, their light to the cells, and the light of the cells to their states. Marks
/// the changed buffers of the cache as outputs.
void add_radiance_cache(graph::Graph& graph, const SceneView& view, RadianceCache& cache,
                        const Continuation& continuation, PathBuffers& paths);

}  // namespace halflight
