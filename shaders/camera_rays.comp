// Makes camera rays in path order, for a tracer. Rays beyond the band's edge are dead.
#include "shaders/shared/frame_block.h"
#include "shaders/shared/ray_structs.h"

layout(local_size_x = 64) in;

layout(std140) uniform FrameBlock { Frame frame; };
layout(std430) writeonly buffer Rays { Ray rays[]; };

#include "shaders/lib/camera.glsl"
#include "shaders/lib/path_pixel.glsl"

void main() {
    uint path = gl_GlobalInvocationID.x;
    ivec2 pixel = ivec2(pixel_in_band(frame, path));
    Ray ray = camera_ray(frame_of_path(frame, path), pixel + ivec2(frame.band_x, frame.band_y));
    ray.t_max = pixel.x < frame.band_columns && pixel.y < frame.band_rows ? ray.t_max : -1.0;
    rays[path] = ray;
}
