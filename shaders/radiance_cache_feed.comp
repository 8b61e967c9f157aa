// Adds the light that paths have found to the cells of their second vertices, on all levels. NaNs, infinities and
// negative radiances are left out.
#include "shaders/shared/path_state.h"
#include "shaders/shared/cache_cells.h"

layout(local_size_x = 64) in;

layout(std430) readonly buffer States { PathState states[]; };
layout(std430) readonly buffer Points { CachePoint points[]; };
layout(std430) buffer Cells { CacheCell cells[]; };
layout(std430) buffer Counts { CacheCounts counts; };
OPTIONAL(HALFLIGHT_PENDING) layout(std430) readonly buffer Occluded { uint occluded[]; };
OPTIONAL(HALFLIGHT_PENDING && HALFLIGHT_SUN) layout(std430) readonly buffer SunOccluded { uint sun_occluded[]; };
OPTIONAL(HALFLIGHT_PENDING && HALFLIGHT_SUN) layout(std430) readonly buffer SunLight { vec4 sun_light[]; };

uniform uint picture;  // number of the picture, as in CacheCell::used

#include "shaders/lib/cache_points.glsl"

// Adds whole units and the remaining fraction of a unit (CacheCell).
void add_to_sum(uint cell, int channel, float radiance) {
    float units = min(radiance, kCacheBrightest) / kCacheUnit;
    float whole = floor(units);
    uint low = uint((units - whole) * 2147483648.0) << 1;
    uint before = atomicAdd(cells[cell].low[channel], low);
    uint high = uint(whole) + (before + low < before ? 1u : 0u);
    if (high > 0u) atomicAdd(cells[cell].high[channel], high);
}

void main() {
    uint path = gl_GlobalInvocationID.x;
    PathState state = states[path];
    if (state.lobe == kLobeNone || (state.reuse & kReusePoint) == 0u) return;
    CachePoint point = points[path];
    vec3 light = found_light(state, point, path);
    if (!good_light(light)) return;
    for (int level = 0; level < kCacheLevels; ++level) {
        uint cell = cell_of(point, level);
        if (cell == kNoCacheCell || cells[cell].key != key_of(point, level)) {  // another key has taken the cell
            atomicAdd(counts.refused, 1u);
            continue;
        }
        cells[cell].used = picture;
        atomicAdd(cells[cell].count, 1u);
        for (int channel = 0; channel < 3; ++channel) add_to_sum(cell, channel, light[channel]);
    }
}
