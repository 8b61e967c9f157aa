// Stores data outputs of the surfaces at the pixels' centres; HALFLIGHT_MOTION adds motion. HALFLIGHT_OPTICS: as in
// shaders/lib/camera.glsl.
#include "shaders/shared/frame_block.h"
#include "shaders/shared/pixel_order.h"
#include "shaders/shared/ray_structs.h"
#include "shaders/scene_tables.glsl"

layout(local_size_x = 64) in;

layout(std140) uniform FrameBlock { Frame frame; };
layout(std430) readonly buffer Hits { Hit hits[]; };

#include "shaders/lib/camera.glsl"
#include "shaders/lib/surface_record.glsl"
#define HALFLIGHT_MAKE_AOV_RECORD 1
#include "shaders/shared/aov_record.h"

layout(std430) writeonly buffer Records { AovRecord records[]; };

void main() {
    uint path = gl_GlobalInvocationID.x;
    records[path] = aov_record(path, load_surface_point(path), hits[path]);
}
