// Cells of the radiance cache. Include after `buffer ... { CacheCell cells[]; }`. Variants: HALFLIGHT_CACHE_ASKED
// (cells can be requested), HALFLIGHT_CACHE_TAKEN (cells are read only, as texels: storage blocks are scarce).
#include "shaders/lib/sobol.glsl"
#include "shaders/shared/cache_cells.h"

const bool kCellTexels = HALFLIGHT_CACHE_TAKEN != 0;
uniform usamplerBuffer cell_words;  // R32UI: kCacheCellWords words per cell

uint cell_word(uint cell, int word) { return texelFetch(cell_words, int(cell) * kCacheCellWords + word).x; }
uint cell_key(uint cell) { return kCellTexels ? cell_word(cell, kCacheKeyWord) : cells[cell].key; }
uint cell_count(uint cell) { return kCellTexels ? cell_word(cell, kCacheCountWord) : cells[cell].count; }
uint cell_low(uint cell, int i) { return kCellTexels ? cell_word(cell, kCacheLowWord + i) : cells[cell].low[i]; }
uint cell_high(uint cell, int i) { return kCellTexels ? cell_word(cell, kCacheHighWord + i) : cells[cell].high[i]; }

// A cell's length, before it is rounded up to a power of two, over the cell's distance from the camera.
const float kCacheAngle = 1.0 / 16.0;

// Returns the finest level; cells are 2^level long.
int cache_level(float distance_to_camera) {
    return int(ceil(log2(clamp(distance_to_camera, 1e-12, 1e12) * kCacheAngle)));
}

// Returns the length exactly, which exp2() need not do.
float cache_length(int level) { return uintBitsToFloat(uint(level + 127) << 23); }

// Returns how many levels have cells narrower than the beam of a ray: the area over which neighbours sampled like it
// would be spread (Bekaert et al. 2003, A Custom Designed Density Estimation Method for Light Transport). Mueller et
// al. 2021, Real-time Neural Radiance Caching, eq. 3, end paths by it. pdf: per solid angle; cosine: at the hit.
int cache_levels(int finest, float way, float pdf, float cosine) {
    float spread = way * way / (pdf * max(cosine, 1e-6));
    int levels = 0;
    for (int l = 0; l < kCacheLevels; ++l) {
        float side = cache_length(finest + l);
        levels += spread >= side * side ? 1 : 0;
    }
    return levels;
}

struct CacheKey {
    uint first;  // first probed cell
    uint key;
};

// Returns the key of a position and of the axis closest to the normal (Binder et al. 2018, Fast Path Space Filtering by
// Jittered Spatial Hashing). There is no jitter, because the first bounce scatters the visible edges of cells.
// Positions are relative to TraceTables::origin. Objects that other lights light have cells of their own (link_class).
CacheKey cache_key(vec3 position, vec3 normal, uint link_class, int level) {
    ivec3 cell = ivec3(floor(clamp(position / cache_length(level), vec3(-1e9), vec3(1e9))));
    vec3 size = abs(normal);
    uint axis = size.x >= size.y && size.x >= size.z ? 0u : size.y >= size.z ? 1u : 2u;
    uint side = normal[axis] < 0.0 ? 1u : 0u;
    uint hash = hash_u32(uint(level) * 6u + axis * 2u + side);
    if (HALFLIGHT_LIGHT_LINKS != 0) hash = hash_combine(hash, link_class);
    hash = hash_combine(hash_combine(hash_combine(hash, uint(cell.x)), uint(cell.y)), uint(cell.z));
    uint key = hash_combine(hash_combine(hash_combine(hash_u32(hash ^ 0x9e3779b9u), uint(cell.x)), uint(cell.y)), uint(cell.z));
    return CacheKey(hash, max(key, 1u));
}

// The cell of a key or, if it has none, a cell that is free for it.
struct CacheFind {
    uint cell;   // index of the key's cell; kNoCacheCell: none
    uint free;   // index of a free cell; kNoCacheCell: none
    uint count;  // number of samples in the cell
};

// Finds a key's cell. No cell is fed meanwhile, so that all searches agree. The search ends at a free cell. If cells
// before it have been freed, a key gets another cell, and its old one is not found any more.
CacheFind find_cell(CacheKey k) {
    CacheFind found = CacheFind(kNoCacheCell, kNoCacheCell, 0u);
    for (uint probe = 0u; probe < kCacheProbes && min(found.cell, found.free) == kNoCacheCell; ++probe) {
        uint cell = (k.first + probe) & (kCacheCells - 1u);
        uint count = cell_count(cell);
        bool is_own = count > 0u && cell_key(cell) == k.key;
        found.cell = is_own ? cell : found.cell;
        found.count = is_own ? count : found.count;
        found.free = count == 0u ? cell : found.free;
    }
    return found;
}

// Returns a point without cells and light.
CachePoint cache_point(int levels, vec3 weight) {
    return CachePoint(vec3(0.0), uint(levels), vec3(0.0), 0u, weight, 0u, 0u, kNoCacheCell, kNoCacheCell, kNoCacheCell);
}

// Requests an unused cell. The largest of several keys gets it, in any order.
#if HALFLIGHT_CACHE_ASKED
void request_cell(uint cell, uint key) { atomicMax(cells[cell].key, key); }
#else
void request_cell(uint cell, uint key) {}
#endif

// Share of paths that continue at a mature cell, to feed it.
const float kCacheFed = 1.0 / 8.0;

// Finds the point's cells. Returns true if the shortest one is mature and `choice` (uniform) lets the path end.
// Otherwise the path feeds cells of all levels and requests those that are missing. Keys that do not get a cell request
// another one with the next sample.
bool find_cells(vec3 position, vec3 normal, uint link_class, int finest, float choice, inout CachePoint point) {
    CacheKey key = cache_key(position, normal, link_class, finest);
    CacheFind found = find_cell(key);
    point.key0 = key.key;
    point.cell0 = found.cell;
    if (found.count >= kCacheFull || (found.count >= kCacheMature && choice >= kCacheFed)) return true;
    for (int level = 0; level < kCacheLevels; ++level) {
        key = cache_key(position, normal, link_class, finest + level);
        found = find_cell(key);
        if (found.cell == kNoCacheCell && found.free != kNoCacheCell) request_cell(found.free, key.key);
        uint cell = found.cell != kNoCacheCell ? found.cell : found.free;
        if (level == 0) point.key0 = key.key, point.cell0 = cell;
        if (level == 1) point.key1 = key.key, point.cell1 = cell;
        if (level == 2) point.key2 = key.key, point.cell2 = cell;
    }
    return false;
}

// Returns the shortest cell of the `levels` finest ones that has enough samples; kNoCacheCell if none has.
uint known_cell(vec3 position, vec3 normal, uint link_class, int finest, int levels) {
    uint known = kNoCacheCell;
    for (int level = 0; level < levels && known == kNoCacheCell; ++level) {
        CacheFind found = find_cell(cache_key(position, normal, link_class, finest + level));
        known = found.count >= kCacheTaken ? found.cell : kNoCacheCell;
    }
    return known;
}

const float kCacheLow = 2.3283064365386963e-10;  // 1 / 2^32

// Returns the mean of a cell that has samples.
vec3 cache_mean(uint cell) {
    vec3 low = vec3(cell_low(cell, 0), cell_low(cell, 1), cell_low(cell, 2));
    vec3 high = vec3(cell_high(cell, 0), cell_high(cell, 1), cell_high(cell, 2));
    return (high + low * kCacheLow) * (kCacheUnit / float(max(cell_count(cell), 1u)));
}
