// Maps from the unit square.

// Samples the unit disk uniformly by the concentric map (Shirley and Chiu 1997), which keeps strata of the square
// compact on the disk. Returns the point and its signed distance from the centre.
vec3 sample_disk(vec2 xi) {
    vec2 p = 2.0 * xi - 1.0;
    bool wide = abs(p.x) > abs(p.y);
    float radius = wide ? p.x : p.y;
    float ratio = wide ? p.y / p.x : (p.y != 0.0 ? p.x / p.y : 0.0);
    float phi = 0.785398163397 * ratio;
    vec2 around = wide ? vec2(cos(phi), sin(phi)) : vec2(sin(phi), cos(phi));
    return vec3(radius * around, radius);
}

// Samples a unit vector around +z with density cos / pi.
vec3 sample_cosine(vec2 xi) {
    vec3 p = sample_disk(xi);
    // The factors of 1 - radius^2 keep the cosine's precision at the rim.
    return vec3(p.xy, sqrt((1.0 - abs(p.z)) * (1.0 + abs(p.z))));
}

// Samples the weights of a triangle's second and third corner, uniform per area (Heitz 2019, A Low-Distortion Map
// Between Triangle and Square).
vec2 sample_triangle(vec2 xi) {
    return xi.y > xi.x ? vec2(0.5 * xi.x, xi.y - 0.5 * xi.x) : vec2(xi.x - 0.5 * xi.y, 0.5 * xi.y);
}

// Returns the weight of a sample of density a if another technique has density b (Veach 1997, section 9.2.4, beta =
// 2). The division first keeps squares of large densities finite. The weight is 0 if both densities are 0.
float power_heuristic(float a, float b) {
    if (a <= b) {
        float r = b > 0.0 ? a / b : 0.0;
        return r * r / (1.0 + r * r);
    }
    float r = b / a;
    return 1.0 / (1.0 + r * r);
}
