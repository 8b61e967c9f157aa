// Surfaces as preview passes know them: a guide is a unit normal and a depth along the camera's axis, 0 where nothing is
// seen. Needs shaders/shared/frame.h.

// What is seen through a pixel's centre at a depth, relative to the camera.
vec3 place_at_depth(Frame frame, ivec2 pixel, float depth) {
    vec2 at = 2.0 * (vec2(pixel) + 0.5) / vec2(frame.size) - 1.0;
    vec3 offset = at.x * frame.camera_right.xyz - at.y * frame.camera_up.xyz;
    return depth * frame.camera_forward.xyz + (frame.camera_position.w != 0.0 ? depth : 1.0) * offset;
}

// World units that a pixel is high at a depth.
float pixel_extent(Frame frame, float depth) {
    return 2.0 * length(frame.camera_up.xyz) / float(frame.size.y) * (frame.camera_position.w != 0.0 ? depth : 1.0);
}

// How far a surface may leave the other's tangent plane, as a slope.
const float kLikenessSlope = 0.5;

// How much the surface at pixel q is a part of that at pixel p, which is `place` at its depth; in [0,1]. The edge-stopping
// functions of normal and depth of Schied et al. 2017 (SVGF), equations 3 and 4, the depth's by distance from either's
// tangent plane, which needs no derivative of the depth.
float likeness(Frame frame, ivec2 p, vec4 guide_p, vec3 place, ivec2 q, vec4 guide_q) {
    vec3 between = place_at_depth(frame, q, guide_q.w) - place;
    float apart = max(abs(dot(guide_p.xyz, between)), abs(dot(guide_q.xyz, between)));
    float slack = kLikenessSlope * length(vec2(q - p)) * pixel_extent(frame, guide_p.w);
    float alike = max(dot(guide_p.xyz, guide_q.xyz), 0.0);
    for (int i = 0; i < 5; ++i) alike *= alike;  // to the 32nd power
    return guide_p.w > 0.0 && guide_q.w > 0.0 ? alike * exp(-apart / max(slack, 1e-30)) : 0.0;
}
