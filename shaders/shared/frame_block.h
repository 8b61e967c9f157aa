// Constants of one sample of one band. Uniform block FrameBlock; the layout is the same in std140 and std430.
#pragma once

#include "shaders/shared/portable.h"
#include "shaders/shared/ray_projections.h"

HALFLIGHT_SHARED_BEGIN

// A frame is rendered in horizontal bands so that no buffer outgrows a driver's limit. Paths of a band are numbered in
// tile order (shaders/shared/pixel_order.h); sampling is keyed by the pixel of the whole image, so bands change no
// result.
struct Frame {
    // World (relative to origin) to clip space of the raster window, reversed infinite depth, jitter included.
    // HALFLIGHT_OPTICS: to camera coordinates.
    mat4 view_projection;
    mat4 previous_view_projection;  // view_projection of the previous frame, without jitter
    vec4 camera_position;           // xyz relative to SceneTables::origin; w: 1 perspective, 0 orthographic
    // xyz: half of the image's width on the plane at distance 1 (orthographic: on any plane); HALFLIGHT_OPTICS: 1 long
    vec4 camera_right;
    vec4 camera_up;       // xyz: half of the image's height on that plane; HALFLIGHT_OPTICS: 1 long
    vec4 camera_forward;  // xyz: unit direction of view
    vec2 jitter;          // sample point from the pixel's upper left corner, pixels; [0,1)^2 with the usual filter
    vec2 clip;            // near and far distance along camera_forward (curved projections: the ray); far may be +inf
    ivec2 size;           // size of the whole image, pixels, also if a part of it is rendered
    int band_y;           // first row of the band; beyond the image's edge in pictures with overscan
    int band_rows;        // number of rows of the band
    uint sample_index;    // index in the frame's sequence, from 0
    uint seed;            // seed of the frame: user's seed and frame number
    uint tiles_x;         // number of 16x16 blocks across
    uint tiles_y;         // number of 16x16 blocks down the band
    int window_y;         // row of the image that is rasterized into row 0 of the visibility texture
    uint begins;          // 1: sums begin with this sample; else 0
    uint shared_count;    // 0: one sequence per pixel; > 0: all pixels share one, with as many samples of each in a row
    uint first_half;      // 1: the sample belongs to the first of the two halves that the denoiser compares; else 0
    int band_x;           // first column of the band; beyond the image's edge in pictures with overscan
    int band_columns;     // number of columns of the band
    uint transparent;     // 1: the environment is not seen directly; else 0
    float half_pixel;     // half of a pixel's height on the plane at distance 1 (orthographic: on any plane)
    // Lens of cameras with depth of field (HALFLIGHT_LENS).
    vec4 lens_x;    // xyz: x axis of the aperture, as long as its radius; w: 1 / distance of the focus, 0: infinity
    vec4 lens_y;    // xyz: y axis of the aperture; w: number of blades, 0: round
    Optics optics;  // HALFLIGHT_OPTICS
};
HALFLIGHT_SHARED_SIZE(Frame, 336)

HALFLIGHT_SHARED_END
