// Traces a batch of rays.
#include "shaders/trace_scene.glsl"
#include "shaders/lib/batch_answers.glsl"
#include "shaders/lib/batch_paths.glsl"
#include "shaders/lib/batch_rays.glsl"
#include "shaders/lib/traverse.glsl"

layout(local_size_x = 64) in;

void main() {
    uint entry = gl_GlobalInvocationID.x;
    if (kListed && entry >= entry_count()) return;
    uint path = path_of(entry);
    store_answer(path, traverse(load_ray(path), alpha_sampler(path), kAnyHit));
}
