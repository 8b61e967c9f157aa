// Sums up what each first surface receives from the points of its group (SHADING.md, Path reuse). Each work group has
// one block of 16x16 pixels, with groups of HALFLIGHT_GROUP_SIZE.
#include "shaders/shared/frame_block.h"
#include "shaders/shared/path_state.h"
#include "shaders/shared/ray_structs.h"
#include "shaders/shared/reuse_groups.h"
#include "shaders/geometry_tables.glsl"  // tables of triangle lights
#include "shaders/scene_tables.glsl"

layout(local_size_x = 256) in;

const uint kGroupSize = uint(HALFLIGHT_GROUP_SIZE);  // pixels that share their paths

layout(std430) readonly buffer PrimaryRays { Ray primary_rays[]; };
uniform usamplerBuffer blocked;  // R32UI: answers to the connection rays
layout(std430) readonly buffer Densities { float densities[]; };
layout(std430) writeonly buffer Received { DirectLight received[]; };

layout(std140) uniform FrameBlock { Frame frame; };

#include "shaders/lib/reuse.glsl"
#include "shaders/lib/reuse_points.glsl"
#include "shaders/lib/surface_record.glsl"

shared vec3 given[256];  // light of each point over its density with which the group finds it; 0: nothing

// Returns 1 or 0; NaN, which the accumulation counts, if there was no answer.
float visible(uint entry) {
    uint answer = texelFetch(blocked, int(entry)).x;
    return answer == kFree ? 1.0 : answer == kOccluded ? 0.0 : not_a_number();
}

// Sums up the light that the path of this invocation receives, and stores it. part: that of given_light().
void receive(uint path, uint part, float density, SurfacePoint from, Bsdf b, uint grouping) {
    vec3 light = given_light(path, part);
    bool bad = !all_finite(light);
    bool gives = light != vec3(0.0) && !bad && density != 0.0;
    given[gl_LocalInvocationIndex] = gives ? light / (point_texel(path, 2).w * density) : vec3(0.0);
    barrier();

    vec3 wo = -primary_rays[path].direction;
    vec3 diffuse = vec3(0.0);
    vec3 glossy = vec3(0.0);
    // Bits of steps to members whose points give light. A loop without iterations costs nothing, unlike a branch.
    uint finders = 0u;
    for (uint i = 0u; i < kGroupSize; ++i)
        finders |= given[(path ^ member_step(i, grouping)) & 255u] != vec3(0.0) ? 1u << i : 0u;
    for (; finders != 0u; finders &= finders - 1u) {
        uint i = uint(findLSB(finders));
        uint finder = path ^ member_step(i, grouping);
        uint entry = finder * kGroupSize + i;
        ReusePoint y = load_point(finder);
        Sight sight = sight_of(y, from.position, finder == path);
        BsdfValue f = shared_value(b, wo, sight.direction);
        float share = base_share(unpack_layers(y.layers), -sight.direction);
        vec3 incoming = given[finder & 255u] * visible(entry) * sight.geometry * share;
        bool receives = densities[entry] != 0.0;
        diffuse += receives ? f.diffuse * incoming : vec3(0.0);
        glossy += receives ? f.glossy * incoming : vec3(0.0);
    }
    // Invalid light stays with the path that brought it, to be counted once.
    diffuse += bad ? light : vec3(0.0);
    received[path + part * gl_NumWorkGroups.x * 256u] =
        DirectLight(from.is_surface ? diffuse : vec3(0.0), 0.0, from.is_surface ? glossy : vec3(0.0), 0.0);
}

void main() {
    uint path = gl_GlobalInvocationID.x;
    float density = 0.0;
    for (uint i = 0u; i < kGroupSize; ++i) {
        uint entry = path * kGroupSize + i;
        density += densities[entry] == 0.0 ? 0.0 : densities[entry] * visible(entry);
    }
    SurfacePoint from = load_surface_point(path);
    Bsdf b = load_bsdf(path);
    uint grouping = sample_grouping(frame.seed, frame.sample_index);
    receive(path, kAllLight, density, from, b, grouping);
    if (kLightGroups > 0u) {
        for (uint part = 1u; part <= kLightGroups; ++part) {
            barrier();  // all invocations have read `given`
            receive(path, part, density, from, b, grouping);
        }
    }
}
