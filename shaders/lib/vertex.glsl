// Vertex attributes (shaders/shared/vertex.h). Needs shaders/geometry_tables.glsl.
#include "shaders/shared/vertex.h"

const bool kVertexColors = HALFLIGHT_VERTEX_COLORS != 0;

vec4 vertex_row(uint vertex, int texel) {
    return texelFetch(scene_vertices, int(vertex) * HALFLIGHT_VERTEX_STRIDE + texel);
}

vec4 interpolate_row(uvec3 corners, vec3 weights, int texel) {
    return weights.x * vertex_row(corners.x, texel) + weights.y * vertex_row(corners.y, texel) +
           weights.z * vertex_row(corners.z, texel);
}

// Returns a corner's uv set 0 in xy and uv set 1 in zw.
vec4 corner_uvs(uint vertex) {
    return vec4(vertex_row(vertex, kVertexNormalTexel).w, vertex_row(vertex, kVertexUvTexel).xyz);
}

// Returns uv set 0 in xy and uv set 1 in zw.
vec4 interpolate_uvs(uvec3 corners, vec3 weights) {
    return vec4(interpolate_row(corners, weights, kVertexNormalTexel).w,
                interpolate_row(corners, weights, kVertexUvTexel).xyz);
}

// Returns exactly the corners' colour if they are equal, because weights whose sum is not quite 1 must not turn
// white to grey.
vec4 interpolate_color(uvec3 corners, vec3 weights) {
    const int texel = HALFLIGHT_VERTEX_STRIDE - 1;
    vec4 first = vertex_row(corners.x, texel);
    return first + weights.y * (vertex_row(corners.y, texel) - first) + weights.z * (vertex_row(corners.z, texel) - first);
}
