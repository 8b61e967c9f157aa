// Rays by path, read as texels, which are faster than storage blocks on llvmpipe.
#include "shaders/shared/ray_structs.h"

uniform samplerBuffer rays;  // RGBA32F, two texels each

Ray load_ray(uint ray) {
    vec4 origin = texelFetch(rays, int(2u * ray));
    vec4 direction = texelFetch(rays, int(2u * ray + 1u));
    return Ray(origin.xyz, origin.w, direction.xyz, direction.w);
}
