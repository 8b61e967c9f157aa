// Chord shafts: conservative bounds of a bundle of rays.
//
// The chord of a ray goes from its origin to its end. At s in [0, 1] of the chord, all rays of the bundle are in a box.
// It moves linearly from the box of the origins to the box of the ends. A node is met where the moving box overlaps the
// node's on all axes for a common s: six half lines. This is tighter than intervals of origins and directions, and has
// no cases of sign.

struct Shaft {
    vec3 origin_lower;
    vec3 origin_upper;
    vec3 end_lower;
    vec3 end_upper;
};

Shaft shaft_union(Shaft a, Shaft b) {
    return Shaft(min(a.origin_lower, b.origin_lower), max(a.origin_upper, b.origin_upper), min(a.end_lower, b.end_lower),
                 max(a.end_upper, b.end_upper));
}

bool shaft_contains(Shaft outer, Shaft inner) {
    return all(lessThanEqual(outer.origin_lower, inner.origin_lower)) &&
           all(greaterThanEqual(outer.origin_upper, inner.origin_upper)) &&
           all(lessThanEqual(outer.end_lower, inner.end_lower)) && all(greaterThanEqual(outer.end_upper, inner.end_upper));
}

// The box at s in the form of the test: half lines s <= or >= (bound - at_0) * inverse.
struct ShaftTest {
    vec3 lower;          // lower corner of the box at s = 0
    vec3 upper;
    vec3 lower_inverse;  // reciprocal of the lower corner's motion from s = 0 to 1; not zero
    vec3 upper_inverse;
};

vec3 away_from_zero(vec3 v, vec3 least) { return mix(v, least, lessThan(abs(v), least)); }

// Prepares the test of a shaft. `margin` enlarges it for rounding errors.
ShaftTest shaft_test(Shaft shaft, vec3 margin) {
    vec3 least = margin * 9.5367432e-7;  // moves a corner by at most 2^-19 of the margin, which the margin covers
    ShaftTest t;
    t.lower = shaft.origin_lower - margin;
    t.upper = shaft.origin_upper + margin;
    t.lower_inverse = 1.0 / away_from_zero(shaft.end_lower - shaft.origin_lower, least);
    t.upper_inverse = 1.0 / away_from_zero(shaft.end_upper - shaft.origin_upper, least);
    return t;
}

struct ShaftInterval {
    vec4 enter;  // s of the shaft's entry into each of four boxes, 0 to 1
    vec4 leave;  // s of the shaft's exit; < enter: the box is not met
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
