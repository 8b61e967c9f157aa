// The shaft of a set of rays: the box that moves from the box of their origins (s = 0) to the box of their ends (s = 1).
// A ray's point at s of its length is in the moving box at s. What follows is conservative where the boxes are padded by
// `shaft_padding`.

struct Shaft {
    vec3 from_lower;
    vec3 from_upper;
    vec3 to_lower;
    vec3 to_upper;
    float least_t;  // of the rays' ends
};

const float kShaftBig = 1e30;

// No rays.
Shaft empty_shaft() {
    return Shaft(vec3(kShaftBig), vec3(-kShaftBig), vec3(kShaftBig), vec3(-kShaftBig), kShaftBig);
}

// Rays that can be anywhere.
Shaft endless_shaft() { return Shaft(vec3(-kShaftBig), vec3(kShaftBig), vec3(-kShaftBig), vec3(kShaftBig), 0.0); }

Shaft shaft_union(Shaft a, Shaft b) {
    return Shaft(min(a.from_lower, b.from_lower), max(a.from_upper, b.from_upper), min(a.to_lower, b.to_lower),
                 max(a.to_upper, b.to_upper), min(a.least_t, b.least_t));
}

float greatest_of(vec3 v) { return max(v.x, max(v.y, v.z)); }

// Greatest coordinate of rays and hierarchy.
float shaft_reach(Shaft s, float hull) {
    vec3 from = max(abs(s.from_lower), abs(s.from_upper));
    vec3 to = max(abs(s.to_lower), abs(s.to_upper));
    return max(hull, max(greatest_of(from), greatest_of(to)));
}

// The tracer lets a ray meet a box that it passes within slack * 2 reach (shaders/lib/box.glsl), and says that it enters
// by 2^-20 of the way too early, which is 2^-19 reach. What the bounds' and this file's arithmetic loses is less than 32
// roundings of 2^-24 reach. slack: that of the hierarchy at index 0, which covers instances; twice, for those inside.
float shaft_padding(float reach, float slack) { return reach * (4.0 * slack + 3.814697265625e-6); }  // 2^-18

// a + s b <= 0 asks that the moving box's lower end is below a box's upper end, c + s d <= 0 the other way round.
struct ShaftTest {
    vec3 from_lower;
    vec3 from_upper;
    vec3 inverse_lower;  // of -b and -d, never infinite
    vec3 inverse_upper;
    float least_t;
};

// Slower motion than 2^-30 of the reach is taken for motion towards the box at that speed: no box is lost by that.
vec3 shaft_inverse(vec3 b, float least) { return -1.0 / mix(b, vec3(-least), lessThan(abs(b), vec3(least))); }

ShaftTest shaft_test(Shaft s, float hull, float slack) {
    float reach = shaft_reach(s, hull);
    float padding = shaft_padding(reach, slack);
    float least = reach * 9.313225746154785e-10;
    return ShaftTest(s.from_lower - padding, s.from_upper + padding, shaft_inverse(s.to_lower - s.from_lower, least),
                     shaft_inverse(s.from_upper - s.to_upper, least), s.least_t);
}

// A lower bound of where rays of the shaft enter the box; negative where none does.
float shaft_near(ShaftTest s, vec3 lower, vec3 upper) {
    vec3 l = (s.from_lower - upper) * s.inverse_lower;
    vec3 u = (lower - s.from_upper) * s.inverse_upper;
    // Inverse > 0: s >= quotient, the box comes nearer; else s <= quotient.
    vec3 zero = vec3(0.0), one = vec3(1.0);
    vec3 begins = max(mix(l, zero, lessThan(s.inverse_lower, zero)), mix(u, zero, lessThan(s.inverse_upper, zero)));
    vec3 ends = min(mix(one, l, lessThan(s.inverse_lower, zero)), mix(one, u, lessThan(s.inverse_upper, zero)));
    float begin = max(greatest_of(begins), 0.0);
    float end = min(min(ends.x, ends.y), min(ends.z, 1.0));
    return begin > end ? -1.0 : begin * s.least_t;
}

// The same shaft seen from another origin and scale of the axes.
ShaftTest scaled_shaft(ShaftTest s, vec3 base, vec3 cell) {
    return ShaftTest((s.from_lower - base) / cell, (s.from_upper - base) / cell, s.inverse_lower * cell,
                     s.inverse_upper * cell, s.least_t);
}

void shaft_slab(inout vec4 begin, inout vec4 end, vec4 distance, float inverse) {
    vec4 s = distance * inverse;
    begin = inverse < 0.0 ? begin : max(begin, s);
    end = inverse < 0.0 ? min(end, s) : end;
}

// Where, in parts of their length, rays of the shaft enter four boxes; more than 1 where none does.
vec4 shaft_begins(ShaftTest s, vec4 lower_x, vec4 lower_y, vec4 lower_z, vec4 upper_x, vec4 upper_y, vec4 upper_z) {
    vec4 begin = vec4(0.0), end = vec4(1.0);
    shaft_slab(begin, end, s.from_lower.x - upper_x, s.inverse_lower.x);
    shaft_slab(begin, end, s.from_lower.y - upper_y, s.inverse_lower.y);
    shaft_slab(begin, end, s.from_lower.z - upper_z, s.inverse_lower.z);
    shaft_slab(begin, end, lower_x - s.from_upper.x, s.inverse_upper.x);
    shaft_slab(begin, end, lower_y - s.from_upper.y, s.inverse_upper.y);
    shaft_slab(begin, end, lower_z - s.from_upper.z, s.inverse_upper.z);
    return mix(begin, vec4(2.0), greaterThan(begin, end));
}
