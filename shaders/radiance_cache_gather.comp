// Adds the diffuse light of second vertices to their paths. It comes from the shortest cell with enough samples, else
// from the longest one, else from the path itself.
#include "shaders/shared/path_state.h"
#include "shaders/shared/cache_cells.h"

layout(local_size_x = 64) in;

layout(std430) buffer States { PathState states[]; };
layout(std430) readonly buffer Points { CachePoint points[]; };
layout(std430) buffer Cells { CacheCell cells[]; };
OPTIONAL(HALFLIGHT_PENDING) layout(std430) readonly buffer Occluded { uint occluded[]; };
OPTIONAL(HALFLIGHT_PENDING && HALFLIGHT_SUN) layout(std430) readonly buffer SunOccluded { uint sun_occluded[]; };
OPTIONAL(HALFLIGHT_PENDING && HALFLIGHT_SUN) layout(std430) readonly buffer SunLight { vec4 sun_light[]; };

uniform uint picture;  // number of the picture, as in CacheCell::used

#include "shaders/lib/cache_lookup.glsl"
#include "shaders/lib/cache_points.glsl"

void main() {
    uint path = gl_GlobalInvocationID.x;
    PathState state = states[path];
    if (state.lobe == kLobeNone || (state.reuse & kReuseCell) == 0u) return;
    CachePoint point = points[path];
    bool has_found = (state.reuse & kReusePoint) != 0u;
    vec3 light = has_found ? found_light(state, point, path) : vec3(0.0);

    uint best = kNoCacheCell;
    bool enough = false;
    for (uint level = 0u; level < point.levels; ++level) {
        uint cell = cell_of(point, int(level));
        bool usable = !enough && cell != kNoCacheCell;
        uint key = usable ? cell_key(cell) : 0u;
        uint count = usable ? cell_count(cell) : 0u;
        if (usable && key == key_of(point, int(level)) && count > 0u) {
            best = cell;
            enough = count >= kCacheTaken;
        }
    }
    // Invalid light stays with its path, to be counted.
    if (best != kNoCacheCell && (!has_found || good_light(light))) {
        light = cache_mean(best);
        cells[best].used = picture;
    }
    states[path].indirect = state.indirect + point.weight * light;
}
