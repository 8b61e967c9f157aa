// The tracer of shaders/trace.comp with perfect culling, an upper bound of the gain of culling. Each ray is given the
// subtree that contains its hit and traverses nothing else. Rays without a hit traverse nothing.
#include "shaders/trace_scene.glsl"
#include "shaders/lib/batch_answers.glsl"
#include "shaders/lib/batch_paths.glsl"
#include "shaders/lib/ray_texels.glsl"
#define HALFLIGHT_STACK_MORE 1
#include "shaders/lib/traverse.glsl"

layout(local_size_x = 64) in;

uniform usamplerBuffer entries;  // RG32UI: reference, and reference within the block of an instance

void main() {
    uint slot = gl_GlobalInvocationID.x;
    if (kListed && slot >= entry_count()) return;
    uint path = path_of(slot);
    Ray ray = load_ray(path);
    uvec2 entry = texelFetch(entries, int(path)).xy;
    bool in_block = kTwoLevel && entry.x >= (kBvhTag | kBvhInstance);
    stack[0] = in_block ? entry.y : entry.x;
    stack_near[0] = in_block ? kBvhFar : floatBitsToInt(ray.t_min);
    stack[1] = kStackInstance | entry.x;
    stack_near[1] = floatBitsToInt(ray.t_min);
    bool searches = entry.x != 0u && ray.t_max >= ray.t_min;
    store_answer(path, traverse_from(ray, searches ? (in_block ? 2 : 1) : 0, no_hit(), Sampler(0u, 0u), kAnyHit));
}
