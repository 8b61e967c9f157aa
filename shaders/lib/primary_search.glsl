// What a camera ray hits, of what is seen at its pixel and beside it. Needs the texture `visibility`, shaders/scene_tables.glsl.
//
// Rasterizers snap corners to 1/256 pixel, and depths by as much of their slope, so that beside an edge another triangle
// shows than the pixel's ray hits. That one is then seen by a neighbouring pixel, unless it is smaller than a pixel
// itself: the nearest of those that the ray meets is taken, ties as shaders/lib/traverse.glsl breaks them.
#include "shaders/lib/alpha.glsl"
#include "shaders/lib/block_ray.glsl"
#include "shaders/lib/intersect.glsl"
#include "shaders/shared/frame.h"
#include "shaders/shared/rays.h"

// Triangle + 1 (0: nothing) and instance. pixel: of the image; outside of it, that of its edge.
uvec2 seen_at(Frame frame, ivec2 pixel) {
    ivec2 inside = clamp(pixel, ivec2(0), frame.size - 1);
    return texelFetch(visibility, inside - ivec2(0, frame.window_y), 0).xy;
}

// 0: the pixel itself; 1 to 4: those that share an edge with it.
ivec2 neighbour(ivec2 pixel, int i) {
    return pixel + ivec2(i == 1 ? 1 : (i == 2 ? -1 : 0), i == 3 ? 1 : (i == 4 ? -1 : 0));
}

const int kPixelsAsked = 5;

// alpha_key: of the ray. As seen_at(). Where the ray meets none of them: nothing, if that is what one of them shows,
// else what the rasterizer has drawn.
uvec2 search_seen(Frame frame, ivec2 pixel, Ray ray, uint alpha_key) {
    uvec2 drawn = seen_at(frame, pixel);
    bool alike = true;
    for (int i = 1; i < kPixelsAsked; ++i) alike = alike && seen_at(frame, neighbour(pixel, i)) == drawn;
    int count = alike ? 0 : kPixelsAsked;

    uvec2 nearest = drawn;
    float nearest_t = uintBitsToFloat(0x7f800000u);
    bool met = false;
    bool open = false;
    int i = 0;
    do {
        if (i < count) {
            uvec2 seen = seen_at(frame, neighbour(pixel, i));
            open = open || seen.x == 0u;
            uint triangle = max(seen.x, 1u) - 1u;
            uvec3 corner = triangle_corners(triangle);
#ifdef HALFLIGHT_INSTANCES
            Ray local = ray_in_block(ray, seen.y);
#else
            Ray local = ray;
#endif
            TriangleHit hit = intersect_triangle(triangle_ray(local.origin, local.direction), corner_position(corner.x),
                                                 corner_position(corner.y), corner_position(corner.z));
            bool wins_tie = seen.y < nearest.y || (seen.y == nearest.y && seen.x < nearest.x);
            bool nearer = seen.x != 0u && hit.met && hit.at.t > ray.t_min &&
                          (hit.at.t < nearest_t || (hit.at.t == nearest_t && wins_tie));
#ifdef HALFLIGHT_ALPHA
            nearer = nearer && alpha_accept(triangle, seen.y, hit.at.weights.y, hit.at.weights.z, alpha_key);
#endif
            if (nearer) {
                nearest = seen;
                nearest_t = hit.at.t;
                met = true;
            }
        }
        ++i;
    } while (i < count);
    return met ? nearest : (open ? uvec2(0u) : drawn);
}
