// Chord shafts: what a bundle of rays can meet, conservatively. Needs shaders/lib/bvh.glsl.
//
// The chord of a ray goes from its origin to its end, where it leaves the hierarchy or at t_max. At s in [0, 1] of the way all
// rays of the bundle are in the box that moves linearly from the box of the origins to the box of the ends. A node is met
// where on all axes the moving box overlaps the node's for a common s: six half lines. Tighter than intervals of origins and
// directions, and without cases of sign.

struct Shaft {
    vec3 origin_lower;
    vec3 origin_upper;
    vec3 end_lower;
    vec3 end_upper;
};

struct Chord {
    vec3 origin;
    vec3 end;
};

// The hierarchy's units, in which shafts and nodes are.
struct ShaftSpace {
    vec3 base;
    vec3 cell;   // of one unit, in world units
    vec3 upper;  // greatest corner of the hierarchy; the least one is `lower`
    vec3 lower;
    float slack;
};

ShaftSpace shaft_space(BvhHead head) {
#ifdef HALFLIGHT_NODES_FLOAT
    return ShaftSpace(vec3(0.0), vec3(1.0), head.base + kGridCells * head.cell, head.base, head.slack);
#else
    return ShaftSpace(head.base, head.cell, vec3(kGridCells), vec3(0.0), head.slack);
#endif
}

// By how much box_ray()'s test of a ray from `origin` may reach beyond exact arithmetic, and more: its slack and the 2^-21 of
// its slabs, then the roundings of the chord and of the shaft's test, each a few 2^-24 of the reach. All of it is below
// slack + 2^-18.
vec3 shaft_margin(ShaftSpace space, vec3 origin_lower, vec3 origin_upper) {
    vec3 reach = max(abs(space.upper - origin_lower), abs(origin_upper - space.lower)) * space.cell;
    reach = max(reach, max(abs(origin_lower - space.lower), abs(space.upper - origin_upper)) * space.cell);
    return (space.slack + 3.8146973e-6) * max(reach.x, max(reach.y, reach.z)) / space.cell;
}

Chord chord_of(ShaftSpace space, vec3 world_origin, vec3 world_direction, float t_max) {
    vec3 origin = (world_origin - space.base) / space.cell;
    vec3 direction = world_direction / space.cell;
    vec3 magnitude = abs(direction);
    float least = max(magnitude.x, max(magnitude.y, magnitude.z)) * 9.094947017729282e-13;  // like box_ray()'s, in cells; their sides differ by 2^20 at most (grid_over)
    bvec3 backward = lessThan(direction, vec3(0.0));
    vec3 raised = mix(vec3(1.0), vec3(-1.0), backward) * max(magnitude, vec3(least));
    vec3 margin = shaft_margin(space, origin, origin);
    vec3 leave = (mix(space.upper + margin, space.lower - margin, backward) - origin) / raised;
    // Finite, as 0 * inf is not a number.
    float t = min(min(t_max, 3.4028235e38), max(0.0, min(leave.x, min(leave.y, leave.z))));
    return Chord(origin, origin + direction * t);
}

// The box at s as a test wants it: half lines s <= or >= (bound - at_0) * inverse.
struct ShaftTest {
    vec3 lower;          // of the box at s = 0
    vec3 upper;
    vec3 lower_inverse;  // one by the way that the lower corner makes from s = 0 to 1; not zero
    vec3 upper_inverse;
};

vec3 away_from_zero(vec3 v, vec3 least) { return mix(v, least, lessThan(abs(v), least)); }

ShaftTest shaft_test(ShaftSpace space, Shaft shaft) {
    vec3 margin = shaft_margin(space, shaft.origin_lower, shaft.origin_upper);
    vec3 least = margin * 9.5367432e-7;  // moves the box by 2^-20 of the margin at most
    ShaftTest t;
    t.lower = shaft.origin_lower - margin;
    t.upper = shaft.origin_upper + margin;
    t.lower_inverse = 1.0 / away_from_zero(shaft.end_lower - shaft.origin_lower, least);
    t.upper_inverse = 1.0 / away_from_zero(shaft.end_upper - shaft.origin_upper, least);
    return t;
}

struct ShaftInterval {
    vec4 enter;  // where the shaft meets each of four boxes, 0 to 1
    vec4 leave;  // < enter: it does not
};

ShaftInterval shaft_interval(ShaftTest t, vec4 lower[3], vec4 upper[3]) {
    ShaftInterval i = ShaftInterval(vec4(0.0), vec4(1.0));
    for (int a = 0; a < 3; ++a) {
        vec4 low = (upper[a] - t.lower[a]) * t.lower_inverse[a];   // the moving lower corner is below the node's upper one
        vec4 high = (lower[a] - t.upper[a]) * t.upper_inverse[a];  // the moving upper corner is above the node's lower one
        bool low_rises = t.lower_inverse[a] > 0.0;
        bool high_rises = t.upper_inverse[a] > 0.0;
        i.leave = min(i.leave, low_rises ? low : vec4(1.0));
        i.enter = max(i.enter, low_rises ? vec4(0.0) : low);
        i.enter = max(i.enter, high_rises ? high : vec4(0.0));
        i.leave = min(i.leave, high_rises ? vec4(1.0) : high);
    }
    return i;
}

bool shaft_contains(Shaft outer, Shaft inner) {
    return all(lessThanEqual(outer.origin_lower, inner.origin_lower)) &&
           all(greaterThanEqual(outer.origin_upper, inner.origin_upper)) &&
           all(lessThanEqual(outer.end_lower, inner.end_lower)) && all(greaterThanEqual(outer.end_upper, inner.end_upper));
}
