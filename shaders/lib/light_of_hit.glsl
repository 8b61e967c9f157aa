// The light that a ray has hit, and light groups (Scene::light_groups), of which kLightGroups is the number.
// Needs shaders/geometry_tables.glsl and shaders/scene_tables.glsl.
#include "shaders/lib/light_links.glsl"
#include "shaders/shared/light.h"
#include "shaders/shared/ray_structs.h"
#include "shaders/shared/word.h"

const bool kAreaLights = HALFLIGHT_AREA_LIGHTS != 0;
const bool kSortedEmitters = HALFLIGHT_SORTED_EMITTERS != 0;
const uint kLightGroups = uint(HALFLIGHT_LIGHT_GROUPS);  // 0: light is not told apart by group

const bool kLightProfiles = HALFLIGHT_LIGHT_PROFILES != 0;

// Returns the number of texels of the rows of lights. Profiles follow them.
int light_texels() {
    int texels = textureSize(scene_lights);
    if (!kLightProfiles) return texels;
    vec4 last = texelFetch(scene_lights, texels - 1);
    return last.w < 0.0 ? int(word_of_float(last.x)) : texels;
}

// Returns the rank of a triangle among the lights of its block, or kNoLight.
uint light_rank(uint triangle) {
    if (!kSortedEmitters) return texelFetch(light_of_triangle, int(triangle)).x;
    int count = textureSize(light_of_triangle), rank = 0;  // ranks below `rank` are of lower triangles
    for (int step = 1 << findMSB(max(count, 1)); step > 0; step >>= 1) {
        bool lower = rank + step <= count && texelFetch(light_of_triangle, rank + step - 1).x < triangle;
        rank += lower ? step : 0;
    }
    return rank < count && texelFetch(light_of_triangle, rank).x == triangle ? uint(rank) : kNoLight;
}

// Returns the light that was hit, or kNoLight.
uint light_of_hit(Hit hit) {
    if (!kAreaLights) return kNoLight;
    uint rank = light_rank(hit.triangle);
    if (rank == kNoLight) return kNoLight;
    uint first = 0u;
    if (kInstances) first = texelFetch(light_of_triangle, textureSize(scene_triangles) + int(hit.instance)).x;
    return first + rank;
}

// Entry of the environment, or of emission that is no light, in the table of light groups. Entries of lights follow.
const int kEnvironmentEntry = 0, kUnlistedEntry = 1, kFirstLightEntry = 2;

int entry_of_light(uint light) { return kFirstLightEntry + int(light); }
// Returns the entry of the light that a ray meets. is_hit: it meets a surface, else the environment.
int entry_of_met(Hit hit, bool is_hit) {
    uint light = light_of_hit(hit);
    return !is_hit ? kEnvironmentEntry : light == kNoLight ? kUnlistedEntry : entry_of_light(light);
}

// Returns the group of an entry.
uint light_group_entry(int entry) {
    return min(texelFetch(light_groups, entry).x & ((1u << kLightGroupBits) - 1u), kLightGroups - 1u);
}
uint group_of_light(uint light) { return light_group_entry(entry_of_light(light)); }
// Returns the group of the sun that is sampled apart. It has the last row.
uint sun_group() { return group_of_light(uint(light_texels() / kLightStride) - 1u); }
uint group_of_met(Hit hit, bool is_hit) { return light_group_entry(entry_of_met(hit, is_hit)); }

// Returns the set of light links of an entry.
uint link_set_entry(int entry) { return kLightLinks ? texelFetch(light_groups, entry).x >> kLightGroupBits : 0u; }
