// Second vertices of paths, for the kernels that feed the radiance cache and those that read it. Include after the
// blocks `points[]`, `occluded[]`, `sun_occluded[]` and `sun_light[]`; without HALFLIGHT_PENDING, only `points[]` is
// read.
#include "shaders/lib/occlusion.glsl"
#include "shaders/lib/sun_light.glsl"
#include "shaders/shared/path_state.h"
#include "shaders/shared/cache_cells.h"
#include "shaders/shared/reuse_groups.h"

// Returns the complete CachePoint::light of a path that feeds the cache.
vec3 found_light(PathState state, CachePoint point, uint path) {
    vec3 light = point.light;
    bool answers = HALFLIGHT_PENDING != 0 && state.pending_light != 0u;
    if (answers) light += answered_light(point.pending, occluded[path]);
    if (kSun && answers) light += answered_light(sun_light[given_sun_light(path)].rgb, sun_occluded[path]);
    return light;
}

bool good_light(vec3 light) { return all_finite(light) && all(greaterThanEqual(light, vec3(0.0))); }

uint cell_of(CachePoint point, int level) { return level == 0 ? point.cell0 : level == 1 ? point.cell1 : point.cell2; }
uint key_of(CachePoint point, int level) { return level == 0 ? point.key0 : level == 1 ? point.key1 : point.key2; }
