// Surfaces of preview passes: a guide is a unit normal and a depth along the camera's axis, 0 for the background. Needs
// shaders/shared/frame.h.

// Returns the point at a depth on the ray through a pixel's centre, relative to the camera.
vec3 place_at_depth(Frame frame, ivec2 pixel, float depth) {
    vec2 at = 2.0 * (vec2(pixel) + 0.5) / vec2(frame.size) - 1.0;
    vec3 offset = at.x * frame.camera_right.xyz - at.y * frame.camera_up.xyz;
    return depth * frame.camera_forward.xyz + (frame.camera_position.w != 0.0 ? depth : 1.0) * offset;
}

// Returns the height of a pixel at a depth, world units.
float pixel_extent(Frame frame, float depth) {
    return 2.0 * length(frame.camera_up.xyz) / float(frame.size.y) * (frame.camera_position.w != 0.0 ? depth : 1.0);
}

// Maximum distance of a surface from the other's tangent plane, as a slope.
const float kLikenessSlope = 0.5;

// Returns the similarity, in [0,1], of the surfaces at pixels q and p; `place` is that of p at its depth. It has the
// edge-stopping functions of normal and depth of Schied et al. 2017 (SVGF), equations 3 and 4. The second one uses the
// distance from either tangent plane, which needs no derivative of the depth.
float likeness(Frame frame, ivec2 p, vec4 guide_p, vec3 place, ivec2 q, vec4 guide_q) {
    vec3 between = place_at_depth(frame, q, guide_q.w) - place;
    float apart = max(abs(dot(guide_p.xyz, between)), abs(dot(guide_q.xyz, between)));
    float slack = kLikenessSlope * length(vec2(q - p)) * pixel_extent(frame, guide_p.w);
    float alike = max(dot(guide_p.xyz, guide_q.xyz), 0.0);
    for (int i = 0; i < 5; ++i) alike *= alike;  // raises `alike` to the power of 32
    return guide_p.w > 0.0 && guide_q.w > 0.0 ? alike * exp(-apart / max(slack, 1e-30)) : 0.0;
}
