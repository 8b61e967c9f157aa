// World-space radiance cache of the preview: light at the second vertices of paths. All vertices in one cell of a hash
// grid share it (passes/light/radiance_cache.h).
#pragma once

#include "shaders/shared/portable.h"

HALFLIGHT_SHARED_BEGIN

// Number of cells: a power of two, limited by buffers of 128 MiB.
HALFLIGHT_SHARED_CONST uint kCacheCells = 1u << 18;
// Number of cells probed for a key, starting at its hash.
HALFLIGHT_SHARED_CONST uint kCacheProbes = 8u;
// Number of grids, each with cells twice as long as the one before; coarse cells have a mean already when fine ones
// have few samples.
HALFLIGHT_SHARED_CONST int kCacheLevels = 3;
HALFLIGHT_SHARED_CONST uint kNoCacheCell = 0xffffffffu;

// Samples in a cell from which on its mean is preferred to that of a longer cell.
HALFLIGHT_SHARED_CONST uint kCacheTaken = 16u;
// Samples in a cell from which on paths end there.
HALFLIGHT_SHARED_CONST uint kCacheMature = 32u;
// Samples in a cell from which on no path continues to add more.
HALFLIGHT_SHARED_CONST uint kCacheFull = 4096u;

// Radiance in fixed point, so that sums do not depend on the order of their terms: kCacheUnit * (high + low / 2^32).
// Values are clamped to kCacheBrightest. The sum of 2^20 such samples does not overflow, and neither do 16 times the
// sums of the 16 shortest full cells in a longest one.
HALFLIGHT_SHARED_CONST float kCacheUnit = 16.0f;
HALFLIGHT_SHARED_CONST float kCacheBrightest = 65535.0f;

// A cell of the hash grid; unused if `count` is 0.
struct CacheCell {
    uint key;     // a hash of level, position and direction, > 0; in an unused cell: the key that requests it
    uint count;   // number of samples
    uint used;    // RadianceCache::picture() of the last picture that read or fed the cell
    uint low[3];  // sums of the light reflected by a diffuse surface of albedo 1: radiance, r g b
    uint high[3];
};
HALFLIGHT_SHARED_SIZE(CacheCell, 36)
// Indices of words, for a texture buffer.
HALFLIGHT_SHARED_CONST int kCacheCellWords = 9;
HALFLIGHT_SHARED_CONST int kCacheKeyWord = 0;
HALFLIGHT_SHARED_CONST int kCacheCountWord = 1;
HALFLIGHT_SHARED_CONST int kCacheLowWord = 3;
HALFLIGHT_SHARED_CONST int kCacheHighWord = 6;

// Bits of PathState::reuse in addition to kReusePoint and kReuseRest (reuse_groups.h), where cells take the place of
// the group. This bit: the path takes its share from a cell.
HALFLIGHT_SHARED_CONST uint kReuseCell = 4u;

// The second vertex of a path, at the path's index.
struct CachePoint {
    vec3 light;    // radiance found so far, as in CacheCell's sums
    uint levels;   // > 0: the path's beam is too narrow for cells of further levels
    vec3 pending;  // additional radiance if the last light sample is visible
    uint key0;     // keys of the cells, one per level
    vec3 weight;   // weight of the radiance in the pixel
    uint key1;
    uint key2;
    uint cell0;  // indices of the cells; kNoCacheCell: none
    uint cell1;
    uint cell2;
};
HALFLIGHT_SHARED_SIZE(CachePoint, 64)

// Counters of a picture.
struct CacheCounts {
    uint refused;  // samples without a cell, because all probes were occupied
};
HALFLIGHT_SHARED_SIZE(CacheCounts, 4)

HALFLIGHT_SHARED_END
