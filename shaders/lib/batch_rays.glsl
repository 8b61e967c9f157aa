// The rays of a batch by path, and the random numbers of their alpha tests. This file binds both.
#include "shaders/lib/alpha_sampler.glsl"
#include "shaders/lib/ray_texels.glsl"

OPTIONAL(HALFLIGHT_ALPHA) layout(std140) uniform FrameBlock { Frame frame; };
uniform uint alpha_salt;
uniform uint rays_of_path;  // consecutive rays of a path
uniform uint paths;         // number of groups after which paths repeat, > 0

// Returns the sampler of a ray, which is not read without HALFLIGHT_ALPHA.
Sampler alpha_sampler(uint ray) {
    if (HALFLIGHT_ALPHA == 0) return Sampler(0u, 0u);
    uint group = ray / rays_of_path;
    uint number = ray % rays_of_path + group / paths;
    return alpha_sampler_of_path(frame, group % paths, alpha_salt + (number << 16));
}
