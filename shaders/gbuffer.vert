// Transforms block instances to clip space for primary visibility. Each block is one indexed, instanced draw.
#include "shaders/shared/frame_block.h"
#include "shaders/geometry_tables.glsl"

layout(std140) uniform FrameBlock { Frame frame; };

layout(location = 0) in vec3 block_position;
layout(location = 1) in uint block_instance;  // one per instance

// Visible share of the viewport (passes/surface/gbuffer.cpp).
uniform float viewport_share;

flat out uint instance;
#if HALFLIGHT_CULL_SEEN
flat out uint mirrored;  // 1: the transform of the instance mirrors
#endif

void main() {
    instance = block_instance;
#if HALFLIGHT_CULL_SEEN
    mirrored = mirrors(block_instance) ? 1u : 0u;
#endif
    gl_Position = frame.view_projection * vec4(block_to_world(block_instance, block_position), 1.0);
    gl_Position.xy *= viewport_share;
}
