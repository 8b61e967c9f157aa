// Chords and shafts in the hierarchy's units: a ray ends where it leaves the hierarchy, or at t_max. Needs
// shaders/lib/bvh.glsl.
#include "shaders/lib/shaft.glsl"

struct Chord {
    vec3 origin;
    vec3 end;
};

// The units of a hierarchy, for shafts and nodes.
struct ShaftSpace {
    vec3 base;
    vec3 cell;   // size of one unit in world units
    vec3 upper;  // largest corner of the hierarchy; the smallest one is `lower`
    vec3 lower;
    float slack;
};

ShaftSpace shaft_space(BvhHead head) {
    if (kFloatNodes)
        return ShaftSpace(vec3(0.0), vec3(1.0), head.base + kGridCells * head.cell, head.base, head.slack);
    return ShaftSpace(head.base, head.cell, vec3(kGridCells), vec3(0.0), head.slack);
}

// Returns an upper bound of the error of box_ray()'s test for a ray from `origin`, relative to exact arithmetic. It
// covers the test's slack and its slabs' 2^-20, and the roundings of chord and shaft test, each a few 2^-24 of the
// reach, or 5 * 2^-24 for a division. All are below slack + 2^-17.
vec3 shaft_margin(ShaftSpace space, vec3 origin_lower, vec3 origin_upper) {
    vec3 reach = max(abs(space.upper - origin_lower), abs(origin_upper - space.lower)) * space.cell;
    reach = max(reach, max(abs(origin_lower - space.lower), abs(space.upper - origin_upper)) * space.cell);
    return (space.slack + 7.6293945e-6) * max(reach.x, max(reach.y, reach.z)) / space.cell;
}

Chord chord_of(ShaftSpace space, vec3 world_origin, vec3 world_direction, float t_max) {
    vec3 origin = (world_origin - space.base) / space.cell;
    vec3 direction = world_direction / space.cell;
    vec3 magnitude = abs(direction);
    float least = max(magnitude.x, max(magnitude.y, magnitude.z)) * 9.094947017729282e-13;  // 2^-40: the bound of box_ray(), here in cells, whose sides differ by 2^20 at most (grid_over)
    bvec3 backward = lessThan(direction, vec3(0.0));
    vec3 raised = mix(vec3(1.0), vec3(-1.0), backward) * max(magnitude, vec3(least));
    vec3 margin = shaft_margin(space, origin, origin);
    vec3 leave = (mix(space.upper + margin, space.lower - margin, backward) - origin) / raised;
    // The end is finite, because 0 * inf is NaN.
    float t = min(min(t_max, 3.4028235e38), max(0.0, min(leave.x, min(leave.y, leave.z))));
    return Chord(origin, origin + direction * t);
}

ShaftTest shaft_test(ShaftSpace space, Shaft shaft) {
    return shaft_test(shaft, shaft_margin(space, shaft.origin_lower, shaft.origin_upper));
}
