// Stores the nearest triangle of each pixel and its block instance (primary visibility).
#include "shaders/shared/frame_block.h"
#include "shaders/geometry_tables.glsl"
#include "shaders/scene_tables.glsl"
#include "shaders/lib/alpha.glsl"
#include "shaders/lib/alpha_sampler.glsl"
#include "shaders/lib/camera.glsl"
#include "shaders/lib/primary_hit.glsl"

layout(std140) uniform FrameBlock { Frame frame; };

uniform uint first_triangle;  // first triangle of the block

flat in uint instance;
flat in uint mirrored;

layout(location = 0) out uvec2 visibility;  // triangle + 1, instance

void main() {
    uint triangle = first_triangle + uint(gl_PrimitiveID);
    if (HALFLIGHT_CULL_SEEN != 0) {
        uint word = triangle_row(triangle).w;
        bool turned = ((word & kTriangleMirrored) != 0u) != (mirrored != 0u);
        // The picture's first row is the lowest one of the target, so fronts appear clockwise.
        if ((word & kTriangleOneSided) != 0u && gl_FrontFacing != turned) discard;
    }
    if (HALFLIGHT_ALPHA != 0) {
        // Opaque triangles run this code, too: alpha_accept is true for them, and a branch would save nothing here.
        ivec2 pixel = ivec2(gl_FragCoord.xy) + ivec2(0, frame.window_y);
        Ray ray = camera_ray(frame, pixel);
        Hit hit = primary_hit(ray, triangle, instance).hit;
        Sampler random = alpha_sampler_of_pixel(frame, uvec2(pixel), 0u);
        if (!alpha_accept(triangle, triangle, instance, hit.u, hit.v, random)) discard;
    }
    visibility = uvec2(triangle + 1u, instance);
}
