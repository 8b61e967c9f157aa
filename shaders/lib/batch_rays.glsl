// The rays of a batch by path, and the keys of their alpha tests. This file binds both.
#include "shaders/lib/alpha_key.glsl"
#include "shaders/lib/ray_texels.glsl"

OPTIONAL(HALFLIGHT_ALPHA) layout(std140) uniform FrameBlock { Frame frame; };
uniform uint alpha_salt;
uniform uint rays_of_path;  // consecutive rays of a path
uniform uint paths;         // number of groups after which paths repeat, > 0

// Returns the key of a ray, which is not read without HALFLIGHT_ALPHA.
uint alpha_key(uint ray) {
    if (HALFLIGHT_ALPHA == 0) return 0u;
    uint group = ray / rays_of_path;
    uint number = ray % rays_of_path + group / paths;
    return alpha_key_of_path(frame, group % paths, alpha_salt + (number << 16));
}
