// Geometry at a hit. Needs shaders/geometry_tables.glsl.
#include "shaders/lib/offset.glsl"
#include "shaders/lib/onb.glsl"
#include "shaders/lib/vertex.glsl"
#include "shaders/shared/ray_structs.h"

const bool kTextures = HALFLIGHT_TEXTURES != 0;
const bool kNormalMaps = HALFLIGHT_NORMAL_MAPS != 0;

struct Surface {
    vec3 position;          // position relative to the tables' origin
    vec3 geometric_normal;  // n_g: unit length, on the side of wo
    float offset;           // distance along n_g at which new rays start (offset_ray_origin())
    vec3 normal;            // interpolated, unit length, on the side of n_g; neither normal-mapped nor bent
    vec3 smooth_normal;     // normal of the smooth surface that the vertex normals suggest, unit length, on the side of n_g
    float lift;             // height of the smooth surface above the triangle, >= 0. It is 0 where vertex normals are
                            // on both sides of the triangle.
    uint material;
    bool front;             // true: n_g is on the outside, where vertex normals point to
    vec2 uv0, uv1;          // with textures
    vec4 tangent;           // with normal maps: unit length, with the sign of `normal`; w: bitangent = cross(normal,
                            // tangent) * w; 0: no tangent
    vec4 color;             // with vertex colours
};

// Moves barycentric weights into the triangle until its edges are at least `distance` away. The move is at most a
// thousandth of the triangle's length, so slivers keep less. e1, e2: edges from the first corner.
vec3 weights_inside(vec3 weights, vec3 e1, vec3 e2, float distance) {
    float longest = sqrt(max(max(dot(e1, e1), dot(e2, e2)), dot(e2 - e1, e2 - e1)));
    float doubled_area = max(length(cross(e1, e2)), 1e-30);
    vec3 inside = max(weights, vec3(min(distance * longest / doubled_area, 1.0 / 1024.0)));
    return inside / (inside.x + inside.y + inside.z);
}

// Returns gradient (xyz) and height (w) of the quadratic patch through a triangle's corners, whose edges curve as the
// vertex normals say (SHADING.md, Shading normals). edges: those opposite to each corner, in order round the triangle.
vec4 smooth_patch(mat3 edges, mat3 normals, vec3 weights) {
    vec3 squares = vec3(dot(edges[0], edges[0]), dot(edges[1], edges[1]), dot(edges[2], edges[2]));
    float longest = sqrt(max(max(squares.x, squares.y), max(squares.z, 1e-30)));
    edges *= 1.0 / longest;
    vec3 face = cross(edges[0], edges[1]);
    vec3 bends = vec3(dot(edges[0], normals[2] - normals[1]), dot(edges[1], normals[0] - normals[2]),
                      dot(edges[2], normals[1] - normals[0]));
    vec3 slopes = 0.5 * (bends.zxy * weights.yzx + bends.yzx * weights.zxy);  // along the gradients of the weights
    return vec4(cross(face, edges * slopes) / max(dot(face, face), 1e-20), 0.5 * longest * dot(weights, slopes));
}

// Returns the surface at a hit. `direction` of the ray has any length; wo = -direction. Precondition: no miss.
Surface surface_at(Hit hit, vec3 direction) {
    uvec4 triangle = triangle_row(hit.triangle);
    vec3 weights = vec3(1.0 - hit.u - hit.v, hit.u, hit.v);
    vec3 a = corner_position(triangle.x);
    vec3 b = corner_position(triangle.y);
    vec3 c = corner_position(triangle.z);
    Surface s;
    s.material = triangle.w & 0x00ffffffu;
    s.position = weights.x * a + weights.y * b + weights.z * c;
    // pbrt-v4 6.8.4 has seven roundings; adding the offset to the position has two more (offset_ray_origin()).
    vec3 error = rounding_bound(9.0) * (abs(weights.x * a) + abs(weights.y * b) + abs(weights.z * c));
    // The tracer translates the corners to the ray's origin and shears them; each coordinate gets a few roundings of
    // their distance. A shift by as much along the plane would let a slanted ray that leaves the plane meet it again.
    vec3 spread = rounding_bound(8.0) *
                  (weights.x * abs(a - s.position) + weights.y * abs(b - s.position) + weights.z * abs(c - s.position));
    vec3 face = face_of_corners(a, b, c);
    float sliver = sliver_bound(a - s.position, b - s.position, c - s.position);
    vec4 normal_u = interpolate_row(triangle.xyz, weights, kVertexNormalTexel);
    vec3 normal = normal_u.xyz;
    mat3 corner_normals = mat3(vertex_row(triangle.x, kVertexNormalTexel).xyz, vertex_row(triangle.y, kVertexNormalTexel).xyz,
                               vertex_row(triangle.z, kVertexNormalTexel).xyz);
    mat3 block_normals = corner_normals;
    vec3 tangent = vec3(0.0);
    float handedness = 1.0;
    if (kTextures) {
        vec4 uv_rest = interpolate_row(triangle.xyz, weights, kVertexUvTexel);
        s.uv0 = vec2(normal_u.w, uv_rest.x);
        s.uv1 = uv_rest.yz;
        handedness = uv_rest.w < 0.0 ? -1.0 : 1.0;
    }
    if (kNormalMaps) tangent = interpolate_row(triangle.xyz, weights, kVertexTangentTexel).xyz;
    if (kVertexColors) s.color = interpolate_color(triangle.xyz, weights);
    vec4 m0 = instance_row(hit.instance, kInstanceBlockToWorld, 0);
    vec4 m1 = instance_row(hit.instance, kInstanceBlockToWorld, 1);
    vec4 m2 = instance_row(hit.instance, kInstanceBlockToWorld, 2);
    mat3 inverse_rows = mat3(instance_row(hit.instance, kInstanceWorldToBlock, 0).xyz,
                             instance_row(hit.instance, kInstanceWorldToBlock, 1).xyz,
                             instance_row(hit.instance, kInstanceWorldToBlock, 2).xyz);
    vec4 p = vec4(s.position, 1.0);
    vec3 translation = abs(vec3(m0.w, m1.w, m2.w));
    float moved = instance_row(hit.instance, kInstanceMoved, 0).x;  // 0: in world space already, without rounding
    if (kInstances) {
        // Placing the point has five roundings, and so has the tracer's transform to block space, W x: one of W itself
        // and four of the sums. In the world they are scaled by |M|, and |W x| <= |W| (|world| + 2 |translation|).
        vec3 reach = abs(vec3(dot(m0, p), dot(m1, p), dot(m2, p))) + 2.0 * translation;
        mat3 absolute_inverse = mat3(abs(inverse_rows[0]), abs(inverse_rows[1]), abs(inverse_rows[2]));
        error += moved * rounding_bound(5.0) * (abs(s.position) + reach * absolute_inverse);
        if (HALFLIGHT_SLIVERS != 0) {
            // The direction is transformed, too, with four roundings, and the ray deviates by as much of its length.
            vec3 extent = max(abs(a - s.position), max(abs(b - s.position), abs(c - s.position)));
            vec3 way = vec3(dot(abs(m0.xyz), extent), dot(abs(m1.xyz), extent), dot(abs(m2.xyz), extent));
            sliver += moved * rounding_bound(4.0) * dot(abs(face) / max(length(face), 1e-30), way * absolute_inverse);
        }
    }
    // Rays that start at an edge where walls meet would often pass through the other wall. Therefore the point is kept
    // away from the edges, by four times its own error, so that walls may meet at angles down to 1/4. Attributes remain
    // those of the hit.
    vec3 inside = weights_inside(weights, b - a, c - a, 4.0 * (length(error) + length(spread)));
    s.position = inside.x * a + inside.y * b + inside.z * c;
    if (kInstances) {
        p = vec4(s.position, 1.0);
        error = vec3(dot(abs(m0.xyz), error), dot(abs(m1.xyz), error), dot(abs(m2.xyz), error)) +
                rounding_bound(5.0) * translation;
        spread = vec3(dot(abs(m0.xyz), spread), dot(abs(m1.xyz), spread), dot(abs(m2.xyz), spread));
        s.position = vec3(dot(m0, p), dot(m1, p), dot(m2, p));
        float block_face = length(face);
        face = inverse_rows * face;  // columns are the rows of W, so the product is with the transpose of W
        // Heights above planes grow as their normals shrink.
        sliver *= moved != 0.0 ? block_face / max(length(face), 1e-30) : 1.0;
        normal = inverse_rows * normal;
        corner_normals = inverse_rows * corner_normals;
        tangent = vec3(dot(m0.xyz, tangent), dot(m1.xyz, tangent), dot(m2.xyz, tangent));
        handedness *= dot(cross(m0.xyz, m1.xyz), m2.xyz) < 0.0 ? -1.0 : 1.0;
    }
    // If rounding loses the cross product of a sliver, any normal is valid; it faces the ray.
    float face_squared = dot(face, face);
    face = face_squared > 0.0 ? face * inversesqrt(face_squared) : -normalize(direction);
    s.geometric_normal = dot(face, direction) > 0.0 ? -face : face;
    s.offset = dot(abs(face), error) + max(length(spread), sliver);
    // Normals that cancel out are replaced by the face's.
    float length_squared = dot(normal, normal);
    normal = length_squared > 0.0 ? normal * inversesqrt(length_squared) : s.geometric_normal;
    float side = dot(normal, s.geometric_normal) < 0.0 ? -1.0 : 1.0;
    s.normal = side * normal;
    s.front = side > 0.0;
    // Products of edges and normals are the same in block space, divided by the lengths of the normals in the world.
    for (int i = 0; i < 3; ++i) block_normals[i] *= inversesqrt(max(dot(corner_normals[i], corner_normals[i]), 1e-30));
    vec4 smooth_shape = side * smooth_patch(mat3(c - b, a - c, b - a), block_normals, weights);
    vec3 gradient = smooth_shape.xyz;
    if (kInstances) gradient = inverse_rows * gradient;
    gradient -= dot(gradient, s.geometric_normal) * s.geometric_normal;
    s.smooth_normal = normalize(s.geometric_normal - gradient);
    bool has_sides = all(greaterThan(side * (s.geometric_normal * corner_normals), vec3(0.0)));
    s.lift = has_sides ? max(smooth_shape.w, 0.0) : 0.0;
    float tangent_squared = dot(tangent, tangent);
    bool has_tangent = tangent_squared > 0.0;
    s.tangent = vec4(has_tangent ? tangent * (side * inversesqrt(tangent_squared)) : vec3(0.0),
                     has_tangent ? side * handedness : 0.0);
    return s;
}
