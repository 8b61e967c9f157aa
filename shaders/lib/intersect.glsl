// Watertight ray/triangle test of both sides (Woop, Benthin, Wald 2013, Watertight Ray/Triangle Intersection, JCGT
// 2(1)). The corners are transformed to a space where the ray is the z axis; there the signs of the three edge
// functions decide. Two triangles with a common edge get the same two corners, bit for bit, and opposite signs.
//
// No doubles are needed: a float edge function, the difference of two rounded products, never has the wrong sign,
// because rounding is monotone. At worst it is zero, which counts as inside. Therefore the triangle that contains a
// point is hit, and so are others that the ray passes within the rounding of their corners. To keep those few, the
// corners' bounds must contain the ray and have an area. A sliver with three zero edge functions is hit on that
// condition alone.
//
// Variant HALFLIGHT_SLIVERS is for scenes with slivers. In floats, shearing rounds corners relative to their distance,
// which loses a sliver's height. In doubles (REAL) the corners are exact to 2^-50 of the distance.
#if HALFLIGHT_SLIVERS
#define REAL double
#define REAL2 dvec2
#define REAL3 dvec3
#define REAL4 dvec4
#else
#define REAL float
#define REAL2 vec2
#define REAL3 vec3
#define REAL4 vec4
#endif

struct TriangleRay {
    ivec3 axes;    // z: axis of the largest direction component
    vec3 origin;   // coordinates in the order of axes
    REAL3 shear;   // xy: direction.xy / direction.z, z: 1 / direction.z, in the order of axes
};

TriangleRay triangle_ray(vec3 origin, vec3 direction) {
    vec3 magnitude = abs(direction);
    bool x_first = magnitude.x > magnitude.y && magnitude.x > magnitude.z;
    bool y_first = !x_first && magnitude.y > magnitude.z;
    TriangleRay ray;
    ray.axes = x_first ? ivec3(1, 2, 0) : (y_first ? ivec3(2, 0, 1) : ivec3(0, 1, 2));
    ray.origin = x_first ? origin.yzx : (y_first ? origin.zxy : origin);
    vec3 d = x_first ? direction.yzx : (y_first ? direction.zxy : direction);
    precise REAL inverse = REAL(1.0) / REAL(d.z);
    precise REAL2 shear = REAL2(d.xy) * inverse;
    ray.shear = REAL3(shear, inverse);
    return ray;
}

// Hit of a ray with a triangle's plane, and the weights of the corners there. `edges`: weights times the determinant;
// `z`: of the corners. The bits are equal for all orders of the corners that keep the last one in its place.
struct TrianglePoint {
    float t;  // parameter of the ray, not yet compared with the ray's interval
    vec3 weights;
};

TrianglePoint triangle_point(TriangleRay ray, REAL3 edges, REAL3 z) {
    if (edges == REAL3(0.0)) edges = REAL3(1.0);
    precise REAL determinant = edges.x + edges.y + edges.z;
    precise REAL inverse = REAL(1.0) / determinant;
    precise REAL t = (edges.x * z.x + edges.y * z.y + edges.z * z.z) * ray.shear.z * inverse;
    precise REAL3 weights = edges * inverse;
    return TrianglePoint(float(t), vec3(weights));
}

// Two triangles of a ring of four corners: 0, 1, 2 and 2, 3, 0.
struct PairEdges {
    bvec2 met;     // true: the ray's whole line hits the triangle
    REAL4 z;       // z of the corners
    REAL4 ring;    // edge functions from each corner to the next
    REAL across;   // edge function from corner 0 to 2
};

// Returns whether the bounds of each triangle's corners contain zero and more than zero.
bvec2 both_may_contain_zero(REAL4 v) {
    const REAL4 zero = REAL4(0.0);
    bvec4 below = lessThanEqual(v, zero), above = greaterThanEqual(v, zero), off = notEqual(v, zero);
    bvec3 common_edge = bvec3(below.x || below.z, above.x || above.z, off.x || off.z);
    return bvec2((common_edge.x || below.y) && (common_edge.y || above.y) && (common_edge.z || off.y),
                 (common_edge.x || below.w) && (common_edge.y || above.w) && (common_edge.z || off.w));
}

// Intersects a pair. row_*: coordinates of the four corners along axes.x, .y and .z.
PairEdges intersect_pair(TriangleRay ray, vec4 row_x, vec4 row_y, vec4 row_z) {
    precise REAL4 z = REAL4(row_z) - REAL(ray.origin.z);
    precise REAL4 x = (REAL4(row_x) - REAL(ray.origin.x)) - ray.shear.x * z;
    precise REAL4 y = (REAL4(row_y) - REAL(ray.origin.y)) - ray.shear.y * z;
    precise REAL4 ring = x * y.yzwx - y * x.yzwx;
    precise REAL across = x.x * y.z - y.x * x.z;
    bvec4 positive = greaterThanEqual(ring, REAL4(0.0)), negative = lessThanEqual(ring, REAL4(0.0));
    bool across_positive = across >= REAL(0.0), across_negative = across <= REAL(0.0);
    bool first = (positive.x && positive.y && across_negative) || (negative.x && negative.y && across_positive);
    bool second = (positive.z && positive.w && across_positive) || (negative.z && negative.w && across_negative);
    bvec2 x_in = both_may_contain_zero(x), y_in = both_may_contain_zero(y);
    return PairEdges(bvec2(first && x_in.x && y_in.x, second && x_in.y && y_in.y), z, ring, across);
}

// Returns the edge functions of the pair's first or second triangle: for the ring's corners 0 and 2, then for its third
// corner.
REAL3 edges_of(PairEdges e, bool second) {
    return second ? REAL3(e.ring.z, e.ring.w, e.across) : REAL3(e.ring.y, e.ring.x, -e.across);
}
REAL3 corners_z(PairEdges e, bool second) { return REAL3(e.z.x, e.z.z, second ? e.z.w : e.z.y); }

TrianglePoint pair_point(TriangleRay ray, PairEdges e, bool second) {
    return triangle_point(ray, edges_of(e, second), corners_z(e, second));
}

// Returns whether a ray meets the side of a triangle from which its corners are clockwise. `edges`: as for
// triangle_point(), whose signs do not differ; all are zero if the triangle is edge-on, which has no such side.
// `turned`: the corners are clockwise in the order of the edge functions.
bool meets_back(TriangleRay ray, REAL3 edges, bool turned) {
    REAL sum = edges.x + edges.y + edges.z;
    return sum != REAL(0.0) && ((sum > REAL(0.0)) == (ray.shear.z > REAL(0.0))) != turned;
}

// Returns a sum whose bits do not depend on the order of the terms.
REAL sum_of(REAL3 v) {
    REAL least = min(min(v.x, v.y), v.z), most = max(max(v.x, v.y), v.z);
    REAL middle = max(min(v.x, v.y), min(max(v.x, v.y), v.z));
    precise REAL sum = (least + most) + middle;
    return sum;
}

// Returns t of a hit of a pair's triangle. Its bits do not depend on the partner in the pair.
float pair_t(TriangleRay ray, PairEdges e, bool second) {
    REAL3 edges = edges_of(e, second);
    if (edges == REAL3(0.0)) edges = REAL3(1.0);
    precise REAL3 products = edges * corners_z(e, second);
    precise REAL inverse = REAL(1.0) / sum_of(edges);
    precise REAL t = sum_of(products) * ray.shear.z * inverse;
    return float(t);
}

// A hit of a single triangle, its corners in file order; equal bits as in any pair.
struct TriangleHit {
    bool met;   // true: the ray's whole line hits the triangle
    bool back;  // true: the ray meets the side from which the corners are clockwise
    TrianglePoint at;
};

vec3 along_axes(TriangleRay ray, vec3 v) {
    return ray.axes.z == 0 ? v.yzx : (ray.axes.z == 1 ? v.zxy : v);
}

TriangleHit intersect_triangle(TriangleRay ray, vec3 a, vec3 b, vec3 c) {
    a = along_axes(ray, a), b = along_axes(ray, b), c = along_axes(ray, c);
    PairEdges e = intersect_pair(ray, vec4(a.x, b.x, c.x, c.x), vec4(a.y, b.y, c.y, c.y), vec4(a.z, b.z, c.z, c.z));
    REAL3 edges = REAL3(e.ring.y, -e.across, e.ring.x);
    return TriangleHit(e.met.x, meets_back(ray, edges, false), triangle_point(ray, edges, e.z.xyz));
}

REAL3 arranged(REAL3 v, bvec3 is_second, bvec3 is_third) {
    REAL first = is_second.x || is_third.x ? (is_second.y || is_third.y ? v.z : v.y) : v.x;
    return REAL3(first, is_second.x ? v.x : (is_second.y ? v.y : v.z), is_third.x ? v.x : (is_third.y ? v.y : v.z));
}

// Reorders corners and weights to file order; `order` (shaders/shared/bvh_nodes.h) holds their places. Coincident
// triangles then have hits with equal t, bit for bit, whatever their partners in pairs are, and the lower id wins.
TrianglePoint pair_point_in_file_order(TriangleRay ray, PairEdges e, bool second, uint order) {
    uint at_second = order & 3u, at_third = (order >> 2) & 3u;
    REAL3 edges = edges_of(e, second);
    REAL3 z = corners_z(e, second);
    bvec3 is_second = equal(uvec3(at_second), uvec3(0u, 1u, 2u));
    bvec3 is_third = equal(uvec3(at_third), uvec3(0u, 1u, 2u));
    return triangle_point(ray, arranged(edges, is_second, is_third), arranged(z, is_second, is_third));
}
