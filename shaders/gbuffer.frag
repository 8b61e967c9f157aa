// Primary visibility: which triangle of which block instance is nearest.
#include "shaders/shared/bindings.h"
#include "shaders/shared/frame.h"
#include "shaders/scene_tables.glsl"

layout(std140, binding = BLOCK_FRAME) uniform FrameBlock { Frame frame; };

uniform uint first_triangle;  // of the block

flat in uint instance;

layout(location = 0) out uvec2 visibility;  // triangle + 1, instance

#ifdef HALFLIGHT_ALPHA
#include "shaders/lib/alpha.glsl"
#include "shaders/lib/camera.glsl"
#include "shaders/lib/hash.glsl"
#include "shaders/shared/pixel_order.h"
#include "shaders/lib/primary_hit.glsl"
#endif

void main() {
    uint triangle = first_triangle + uint(gl_PrimitiveID);
#ifdef HALFLIGHT_ALPHA
    // Also taken by opaque triangles: alpha_accept is true for them, and a branch would save nothing here.
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    Ray ray = camera_ray(frame, pixel + ivec2(0, frame.band_y));
    Hit hit = primary_hit(ray, triangle, instance);
    uint key = ray_key(path_of_pixel(pixel, uvec2(frame.tiles_x, frame.tiles_y)), frame.seed, frame.sample_index, 0u);
    if (!alpha_accept(triangle, instance, hit.u, hit.v, key)) discard;
#endif
    visibility = uvec2(triangle + 1u, instance);
}
