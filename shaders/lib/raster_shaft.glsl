// Shafts of raster culling: in world units, with a lower bound of t at s.
#include "shaders/lib/shaft.glsl"

struct TimedShaft {
    Shaft rays;
    float least_t;  // lower bound of the rays' ends
};

const float kShaftBig = 1e30;

// Returns the shaft of no rays.
TimedShaft empty_shaft() {
    return TimedShaft(Shaft(vec3(kShaftBig), vec3(-kShaftBig), vec3(kShaftBig), vec3(-kShaftBig)), kShaftBig);
}

// Returns a shaft that holds all rays.
TimedShaft endless_shaft() {
    return TimedShaft(Shaft(vec3(-kShaftBig), vec3(kShaftBig), vec3(-kShaftBig), vec3(kShaftBig)), 0.0);
}

TimedShaft shaft_union(TimedShaft a, TimedShaft b) {
    return TimedShaft(shaft_union(a.rays, b.rays), min(a.least_t, b.least_t));
}

float greatest_of(vec3 v) { return max(v.x, max(v.y, v.z)); }

// Returns the largest coordinate of rays and hierarchy.
float shaft_reach(Shaft s, float hull) {
    vec3 origin = max(abs(s.origin_lower), abs(s.origin_upper));
    vec3 end = max(abs(s.end_lower), abs(s.end_upper));
    return max(hull, max(greatest_of(origin), greatest_of(end)));
}

// Returns the padding of boxes. The tracer accepts a box that a ray passes within slack * 2 reach
// (shaders/lib/box.glsl). Its entry may be early by 2^-19 of the distance, which is 2^-18 reach. The arithmetic of
// bounds and test loses less than 64 roundings of 2^-24 reach. `slack` is that of the hierarchy at index 0, which
// covers instances. It is doubled for the boxes inside them.
float shaft_padding(float reach, float slack) { return reach * (4.0 * slack + 7.62939453125e-6); }  // 2^-17

struct TimedTest {
    ShaftTest test;
    float least_t;
};

TimedTest shaft_test(TimedShaft s, float hull, float slack) {
    return TimedTest(shaft_test(s.rays, vec3(shaft_padding(shaft_reach(s.rays, hull), slack))), s.least_t);
}

// Returns a lower bound of the entry of the shaft's rays into the box; negative if none enters. It tests axis by
// axis, like shaft_interval().
float shaft_near(TimedTest s, vec3 lower, vec3 upper) {
    vec3 low = (upper - s.test.lower) * s.test.lower_inverse;
    vec3 high = (lower - s.test.upper) * s.test.upper_inverse;
    vec3 zero = vec3(0.0), one = vec3(1.0);
    bvec3 low_rises = greaterThan(s.test.lower_inverse, zero), high_rises = greaterThan(s.test.upper_inverse, zero);
    float enter = max(greatest_of(max(mix(low, zero, low_rises), mix(zero, high, high_rises))), 0.0);
    vec3 leaves = min(mix(one, low, low_rises), mix(high, one, high_rises));
    float leave = min(min(leaves.x, leaves.y), min(leaves.z, 1.0));
    return enter > leave ? -1.0 : enter * s.least_t;
}

// Returns the shaft relative to another origin and scale of the axes.
ShaftTest scaled_shaft(ShaftTest s, vec3 base, vec3 cell) {
    return ShaftTest((s.lower - base) / cell, (s.upper - base) / cell, s.lower_inverse * cell, s.upper_inverse * cell);
}
