// World-space radiance cache of the preview: what arrives at the second vertices of paths, shared by all that meet the
// same cell of a hash grid (passes/light/radiance_cache.h).
#ifndef HALFLIGHT_SHARED_RADIANCE_CACHE_H
#define HALFLIGHT_SHARED_RADIANCE_CACHE_H

#include "shaders/shared/portable.h"

HALFLIGHT_SHARED_BEGIN

// A power of two, and not more than what 128 MiB hold.
HALFLIGHT_SHARED_CONST uint kCacheCells = 1u << 18;
// Cells that a key may be in, from the one its hash names on.
HALFLIGHT_SHARED_CONST uint kCacheProbes = 8u;
// Grids, each of cells twice as long as those of the one before: young ones of few samples have a mean, too.
HALFLIGHT_SHARED_CONST int kCacheLevels = 3;
HALFLIGHT_SHARED_CONST uint kNoCacheCell = 0xffffffffu;

// Samples in a cell: from so many on its mean is taken rather than that of a longer cell;
HALFLIGHT_SHARED_CONST uint kCacheTaken = 16u;
// paths end there;
HALFLIGHT_SHARED_CONST uint kCacheMature = 32u;
// and none goes on to bring it more.
HALFLIGHT_SHARED_CONST uint kCacheFull = 4096u;

// Radiance in fixed point, so that sums do not depend on the order of their terms: kCacheUnit * (high + low / 2^32).
// Brighter than kCacheBrightest is taken as that: 2^20 samples of it do not overflow, 16 times those of the 16 shortest
// cells, when all are full, that are in a longest one.
HALFLIGHT_SHARED_CONST float kCacheUnit = 16.0f;
HALFLIGHT_SHARED_CONST float kCacheBrightest = 65535.0f;

// A cell; free where `count` is 0.
struct CacheCell {
    uint key;     // a hash of level, place and direction, > 0; of a free one: who asks for it
    uint count;   // of samples
    uint used;    // RadianceCache::picture() of the last picture that took something from it or brought something
    uint low[3];  // sums of what a diffuse surface of albedo 1 reflects: radiance, r g b
    uint high[3];
};
HALFLIGHT_SHARED_SIZE(CacheCell, 36)
// By words, as a texture buffer has it.
HALFLIGHT_SHARED_CONST int kCacheCellWords = 9;
HALFLIGHT_SHARED_CONST int kCacheKeyWord = 0;
HALFLIGHT_SHARED_CONST int kCacheCountWord = 1;
HALFLIGHT_SHARED_CONST int kCacheLowWord = 3;
HALFLIGHT_SHARED_CONST int kCacheHighWord = 6;

// Bits of PathState::reuse beside kReusePoint and kReuseRest (reuse.h), which have the same meaning with cells in place
// of the group: the path takes its share from a cell.
HALFLIGHT_SHARED_CONST uint kReuseCell = 4u;

// The second vertex of a path, at the path's index.
struct CachePoint {
    vec3 light;    // radiance found so far, as of CacheCell's sums
    uint levels;   // > 0: the path lies in too narrow a beam for cells of further ones
    vec3 pending;  // more of it, if the last light sample is visible
    uint key0;     // by level
    vec3 weight;   // of that radiance in the pixel
    uint key1;
    uint key2;
    uint cell0;  // index, kNoCacheCell: none
    uint cell1;
    uint cell2;
};
HALFLIGHT_SHARED_SIZE(CachePoint, 64)

// What went on in a picture.
struct CacheCounts {
    uint refused;  // samples that found no cell, for all probes were taken
};
HALFLIGHT_SHARED_SIZE(CacheCounts, 4)

HALFLIGHT_SHARED_END

#endif
