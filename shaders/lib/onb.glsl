// Normals, orthonormal bases, the sphere.

// Returns a vector perpendicular to two edges, of arbitrary length. Scaling first keeps products of four lengths within
// floats.
vec3 face_vector(vec3 e1, vec3 e2) {
    vec3 extent = max(abs(e1), abs(e2));
    float scale = 1.0 / max(max(extent.x, extent.y), max(extent.z, 1e-30));
    return cross(e1 * scale, e2 * scale);
}

// Returns a vector perpendicular to a triangle. Rounded edges of a sliver do not determine its height.
vec3 face_of_corners(vec3 a, vec3 b, vec3 c) {
    if (HALFLIGHT_SLIVERS == 0) return face_vector(b - a, c - a);
    dvec3 face = cross(dvec3(b) - dvec3(a), dvec3(c) - dvec3(a));
    dvec3 magnitude = abs(face);
    double largest = max(max(magnitude.x, magnitude.y), magnitude.z);
    return vec3(face / (largest > double(0.0) ? largest : double(1.0)));
}

// Returns the basis with two tangents and n as columns (Duff et al. 2017, Building an Orthonormal Basis, Revisited).
mat3 basis_around(vec3 n) {
    float s = n.z >= 0.0 ? 1.0 : -1.0;
    float a = -1.0 / (s + n.z);
    float b = n.x * n.y * a;
    return mat3(vec3(1.0 + s * n.x * n.x * a, s * b, -s * n.x), vec3(b, s + n.y * n.y * a, -n.y), n);
}

// Returns a unit vector: `cosine` in [-1, 1] towards +z, `turn` in [0, 1] around it.
vec3 sphere_direction(float cosine, float turn) {
    float sine = sqrt(max(0.0, 1.0 - cosine * cosine));
    float phi = 6.28318530718 * turn;
    return vec3(sine * cos(phi), sine * sin(phi), cosine);
}
