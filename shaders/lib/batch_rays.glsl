// The rays of a batch by path, and the keys of their alpha tests. Binds both.
//
// Variant: HALFLIGHT_ALPHA.
#include "shaders/shared/frame.h"
#include "shaders/shared/rays.h"

layout(binding = UNIT_FREE) uniform samplerBuffer rays;  // RGBA32F, two texels each
#ifdef HALFLIGHT_ALPHA
#include "shaders/lib/alpha_key.glsl"
layout(std140, binding = BLOCK_FRAME) uniform FrameBlock { Frame frame; };
uniform uint alpha_salt;
uniform uint rays_of_path;  // consecutive ones
#endif

Ray load_ray(uint path) {
    vec4 origin = texelFetch(rays, int(2u * path));
    vec4 direction = texelFetch(rays, int(2u * path + 1u));
    return Ray(origin.xyz, origin.w, direction.xyz, direction.w);
}

// Not read without HALFLIGHT_ALPHA.
uint alpha_key(uint path) {
#ifdef HALFLIGHT_ALPHA
    return alpha_key_of_path(frame, path / rays_of_path, alpha_salt + ((path % rays_of_path) << 16));
#else
    return 0u;
#endif
}
