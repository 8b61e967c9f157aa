// Traces the rays of a tile through its list. Hits of earlier draws are read back, and only nearer ones are written.
// Draws are separated by a barrier, and a ray has one fragment in each.
#include "shaders/trace_scene.glsl"
#include "shaders/lib/batch_answers.glsl"
#include "shaders/lib/batch_paths.glsl"
#include "shaders/lib/batch_rays.glsl"
#include "shaders/lib/raster_texels.glsl"
#include "shaders/lib/raster_search.glsl"

flat in uint list_size;
flat in uint first_entry;

void main() {
    // A tile may have texels without an entry. There is no discard, which costs a quarter of the time on software
    // drivers.
    uint entry = entry_of_texel(uvec2(gl_FragCoord.xy));
    bool idle = entry >= entry_count();
    uint path = path_of(idle ? 0u : entry);
    Ray ray = load_ray(path);
    Sampler random = alpha_sampler(path);
    Hit known = no_hit();
    if (!kAnyHit) known = hits[path];
    bool over = idle || (kAnyHit ? occluded[path] != kFree
                                 : floatBitsToUint(known.t) > uint(kBvhFar));  // a NaN counts as over
    Hit hit = search(ray, first_entry, over ? 0u : list_size, known, random, kAnyHit);
    bool same = floatBitsToUint(hit.t) == floatBitsToUint(known.t) && hit.triangle == known.triangle &&
                hit.instance == known.instance;
    if (kAnyHit ? hit.triangle != kMiss : !over && !same) store_answer(path, hit);
}
