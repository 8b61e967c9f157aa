// The scene's triangles and instances, and functions that read single elements. Kernels that trace, rasterize or
// resolve hits (shaders/resolve.comp) include it, and so do those that sample lights (shaders/lib/lights.glsl).
#include "shaders/shared/texture_units.h"
#include "shaders/shared/instance_texels.h"
#include "shaders/shared/triangle.h"

layout(binding = kUnitInstances) uniform samplerBuffer scene_instances;
layout(binding = kUnitTriangles) uniform usamplerBuffer scene_triangles;
layout(binding = kUnitPositions) uniform samplerBuffer scene_positions;
layout(binding = kUnitVertices) uniform samplerBuffer scene_vertices;

const bool kInstances = HALFLIGHT_INSTANCES != 0;  // the scene has instances, each with a matrix

// Returns a row of TraceTables::triangles: three vertex indices and the word of flags and material.
uvec4 triangle_row(uint triangle) { return texelFetch(scene_triangles, int(triangle)); }
uvec3 triangle_corners(uint triangle) { return triangle_row(triangle).xyz; }
// Returns whether a triangle is part of a shadow catcher.
bool catches_shadows(uint triangle) { return (triangle_row(triangle).w & kTriangleCatcher) != 0u; }

// Returns a position in block space.
vec3 corner_position(uint vertex) { return texelFetch(scene_positions, int(vertex)).xyz; }

// Returns row 0 to 2 of an instance's matrix; `first` is kInstanceBlockToWorld or kInstanceWorldToBlock.
vec4 instance_row(uint instance, int first, int row) {
    return texelFetch(scene_instances, int(instance) * kInstanceStride + first + row);
}

// Returns whether the transform of an instance mirrors.
bool mirrors(uint instance) {
    if (HALFLIGHT_INSTANCES == 0) return false;
    vec3 x = instance_row(instance, kInstanceBlockToWorld, 0).xyz, y = instance_row(instance, kInstanceBlockToWorld, 1).xyz;
    return dot(cross(x, y), instance_row(instance, kInstanceBlockToWorld, 2).xyz) < 0.0;
}

// Transforms a position to world space relative to the tables' origin.
vec3 block_to_world(uint instance, vec3 position) {
    if (HALFLIGHT_INSTANCES == 0) return position;
    vec4 p = vec4(position, 1.0);
    return vec3(dot(instance_row(instance, kInstanceBlockToWorld, 0), p),
                dot(instance_row(instance, kInstanceBlockToWorld, 1), p),
                dot(instance_row(instance, kInstanceBlockToWorld, 2), p));
}
