// Finds the pixels of a neighbouring frame that show the same surfaces as the pixels of this frame.
layout(local_size_x = 8, local_size_y = 8) in;

uniform sampler2D guide;   // xyz: normal; w: ln(depth)
uniform sampler2D motion;  // xy: way of the surface to its place in the neighbour, pixels; z: change of ln(depth) on it;
                           // w: object, 0: none
uniform sampler2D motion_back;  // motion from the neighbour to this frame
uniform sampler2D other_guide;
layout(rgba32f) writeonly uniform image2D place;  // xy: pixel of the neighbour; z: 1 where it shows the surface, else 0

// Most that a surface may differ between two frames.
const float kMostWay = 1.5;     // between a pixel and the end of the way there and back, pixels
const float kMostDepth = 0.1;   // difference of ln(depth)
const float kMostNormal = 0.5;  // difference of the normals

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    ivec2 size = imageSize(place);
    if (any(greaterThanEqual(pixel, size))) return;
    vec4 way = texelFetch(motion, pixel, 0);
    ivec2 there = pixel + ivec2(round(way.xy));
    bool inside = all(greaterThanEqual(there, ivec2(0))) && all(lessThan(there, size));
    there = clamp(there, ivec2(0), size - 1);
    vec4 back = texelFetch(motion_back, there, 0);
    vec4 own = texelFetch(guide, pixel, 0);
    vec4 other = texelFetch(other_guide, there, 0);
    bool alike = distance(vec2(there) + back.xy, vec2(pixel)) <= kMostWay &&
                 abs(other.w - way.z - own.w) <= kMostDepth && distance(other.xyz, own.xyz) <= kMostNormal;
    bool same = inside && way.w > 0.0 && way.w == back.w && alike;
    imageStore(place, pixel, vec4(vec2(there), same ? 1.0 : 0.0, 0.0));
}
