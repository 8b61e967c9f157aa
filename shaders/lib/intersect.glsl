// Rays against triangles, watertight (Woop, Benthin, Wald 2013, Watertight Ray/Triangle Intersection, JCGT 2(1)), both
// sides. The corners are brought to a space where the ray is the z axis; there the signs of the three edge functions
// decide. Two triangles with a common edge see the same two corners, bit for bit, and opposite signs.
//
// Without doubles: a float edge function, the difference of two rounded products, never has the wrong sign, since
// rounding is monotone; at worst it is zero. Zero counts as inside, so of the triangles around a point the one that
// contains it is met, and others that the ray passes within the rounding of their corners. These are kept few by asking
// that the corners' bounds contain the ray and have an area; a needle of which all three are zero is met on that alone.

struct TriangleRay {
    ivec3 axes;    // z: that of the greatest direction component
    vec3 origin;   // in that order of axes
    vec3 shear;    // xy: direction.xy / direction.z, z: 1 / direction.z, in that order of axes
};

struct TriangleHit {
    bool met;
    float t;
    float u;
    float v;
};

TriangleRay triangle_ray(vec3 origin, vec3 direction) {
    vec3 magnitude = abs(direction);
    bool x_first = magnitude.x > magnitude.y && magnitude.x > magnitude.z;
    bool y_first = !x_first && magnitude.y > magnitude.z;
    TriangleRay ray;
    ray.axes = x_first ? ivec3(1, 2, 0) : (y_first ? ivec3(2, 0, 1) : ivec3(0, 1, 2));
    ray.origin = x_first ? origin.yzx : (y_first ? origin.zxy : origin);
    vec3 d = x_first ? direction.yzx : (y_first ? direction.zxy : direction);
    precise float inverse = 1.0 / d.z;
    precise vec2 shear = d.xy * inverse;
    ray.shear = vec3(shear, inverse);
    return ray;
}

bool may_contain_zero(vec3 v) {
    return any(lessThanEqual(v, vec3(0.0))) && any(greaterThanEqual(v, vec3(0.0))) && any(notEqual(v, vec3(0.0)));
}

// row_*: coordinates of the three corners along axes.x, .y and .z. t is not yet compared with anything.
TriangleHit intersect_triangle(TriangleRay ray, vec3 row_x, vec3 row_y, vec3 row_z) {
    precise vec3 z = row_z - ray.origin.z;
    precise vec3 x = (row_x - ray.origin.x) - ray.shear.x * z;
    precise vec3 y = (row_y - ray.origin.y) - ray.shear.y * z;
    precise vec3 edges = x.zxy * y.yzx - y.zxy * x.yzx;  // weights of the corners, times the determinant
    bool positive = all(greaterThanEqual(edges, vec3(0.0)));
    bool negative = all(lessThanEqual(edges, vec3(0.0)));
    bool in_bounds = may_contain_zero(x) && may_contain_zero(y);
    if (positive && negative && in_bounds) edges = vec3(1.0);
    precise float determinant = edges.x + edges.y + edges.z;
    precise float inverse = 1.0 / determinant;
    precise float t = (edges.x * z.x + edges.y * z.y + edges.z * z.z) * ray.shear.z * inverse;
    precise vec2 weights = edges.yz * inverse;
    return TriangleHit((positive || negative) && in_bounds && determinant != 0.0, t, weights.x, weights.y);
}
