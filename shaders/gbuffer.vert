// Transforms block instances to clip space for primary visibility. Each block is one indexed, instanced draw.
#include "shaders/shared/frame_block.h"
#include "shaders/geometry_tables.glsl"

layout(std140) uniform FrameBlock { Frame frame; };

layout(location = 0) in vec3 block_position;
layout(location = 1) in uint block_instance;  // one per instance

// Visible share of the viewport (passes/surface/gbuffer.cpp).
uniform float viewport_share;

flat out uint instance;
flat out uint mirrored;  // HALFLIGHT_CULL_SEEN: 1 if the transform of the instance mirrors

void main() {
    instance = block_instance;
    mirrored = HALFLIGHT_CULL_SEEN != 0 && mirrors(block_instance) ? 1u : 0u;
    gl_Position = frame.view_projection * vec4(block_to_world(block_instance, block_position), 1.0);
    gl_Position.xy *= viewport_share;
}
