// Finds the hit of a camera ray among the triangles rasterized at its pixel and at the neighbouring pixels. Needs the
// image `visibility` and shaders/scene_tables.glsl.
//
// Rasterizers snap corners to 1/256 pixel, and depths by as much of their slope. Beside an edge they may show another
// triangle than the one that the pixel's ray hits. A neighbouring pixel shows that one, unless it is smaller than a
// pixel. The nearest of these triangles that the ray hits is selected; ties are broken like in
// shaders/lib/traverse.glsl.
#include "shaders/lib/alpha.glsl"
#include "shaders/lib/primary_hit.glsl"
#include "shaders/shared/frame_block.h"
#include "shaders/shared/ray_structs.h"

// Returns triangle + 1 (0: none) and instance at a pixel of the image, or at its edge for pixels beyond.
uvec2 seen_at(Frame frame, ivec2 pixel) {
    ivec2 inside = clamp(pixel, ivec2(0), frame.size - 1);
    return imageLoad(visibility, inside - ivec2(0, frame.window_y)).xy;
}

// Returns pixel i: 0 is the pixel itself, 1 to 4 share an edge with it.
ivec2 neighbour(ivec2 pixel, int i) {
    return pixel + ivec2(i == 1 ? 1 : (i == 2 ? -1 : 0), i == 3 ? 1 : (i == 4 ? -1 : 0));
}

struct PrimarySearch {
    bool is_hit;
    Hit hit;  // the hit; for a miss, record of some triangle
};

// Searches the triangles seen around a pixel; `random`: alpha_sampler_of_pixel(). If the ray hits none, the result is a miss if
// one of the pixels shows the background, else the rasterized triangle.
PrimarySearch search_seen(Frame frame, ivec2 pixel, Ray ray, Sampler random) {
    uvec2 drawn = seen_at(frame, pixel);
    uvec2 right = seen_at(frame, neighbour(pixel, 1)), left = seen_at(frame, neighbour(pixel, 2));
    uvec2 below = seen_at(frame, neighbour(pixel, 3)), above = seen_at(frame, neighbour(pixel, 4));
    bool open = drawn.x == 0u || right.x == 0u || left.x == 0u || below.x == 0u || above.x == 0u;
    // The bits select the pixel's own triangle, and those not equal to earlier ones. Software drivers pay for each
    // iteration of the loop below by the maximum over eight pixels.
    uint asked = 1u | (right != drawn ? 2u : 0u) | (left != drawn && left != right ? 4u : 0u) |
                 (below != drawn && below != right && below != left ? 8u : 0u) |
                 (above != drawn && above != right && above != left && above != below ? 16u : 0u);

    Hit nearest;
    bool met = false;
    bool first = true;
    do {
        if (asked != 0u) {
            uvec2 seen = seen_at(frame, neighbour(pixel, findLSB(asked)));
            asked &= asked - 1u;
            PrimaryHit p = primary_hit(ray, max(seen.x, 1u) - 1u, seen.y);
            bool wins_tie = p.hit.instance < nearest.instance ||
                            (p.hit.instance == nearest.instance && p.hit.triangle < nearest.triangle);
            bool nearer = !met || p.hit.t < nearest.t || (p.hit.t == nearest.t && wins_tie);
            nearer = nearer && seen.x != 0u && p.met && p.hit.t > ray.t_min;
            if (HALFLIGHT_CULL_SEEN != 0) {
                uint word = triangle_row(max(seen.x, 1u) - 1u).w;
                bool mirrored = (word & kTriangleMirrored) != 0u;
                nearer = nearer && ((word & kTriangleOneSided) == 0u || p.back == mirrored);
            }
            nearer = nearer && alpha_accept(p.hit.triangle, p.hit.triangle, p.hit.instance, p.hit.u, p.hit.v, random);
            if (nearer || first) nearest = p.hit;
            met = met || nearer;
            first = false;
        }
    } while (asked != 0u);
    return PrimarySearch(met || !open, nearest);
}
