// The scene's arrays, and access to their elements. Kernels include this before the files of shaders/lib.
//
// The defines of shader_defines() (engine/tables/shading_tables.h) select the arrays; unread ones cost nothing.
#include "shaders/shared/bindings.h"
#include "shaders/shared/instances.h"

layout(binding = UNIT_INSTANCES) uniform samplerBuffer scene_instances;
layout(binding = UNIT_TRIANGLES) uniform usamplerBuffer scene_triangles;
layout(binding = UNIT_POSITIONS) uniform samplerBuffer scene_positions;
layout(binding = UNIT_VERTICES) uniform samplerBuffer scene_vertices;
layout(binding = UNIT_MATERIALS) uniform samplerBuffer scene_materials;
layout(binding = UNIT_TEXTURES) uniform usamplerBuffer scene_textures;
layout(binding = UNIT_COLOR_TEXELS) uniform samplerBuffer color_texels;
layout(binding = UNIT_DATA_TEXELS) uniform samplerBuffer data_texels;
layout(binding = UNIT_LIGHTS) uniform samplerBuffer scene_lights;
layout(binding = UNIT_LIGHT_ALIAS) uniform samplerBuffer light_alias;
layout(binding = UNIT_LIGHT_OF_TRIANGLE) uniform usamplerBuffer light_of_triangle;
layout(binding = UNIT_ENVIRONMENT) uniform sampler2D environment_map;
layout(binding = UNIT_ENVIRONMENT_ALIAS) uniform samplerBuffer environment_cells;
layout(binding = UNIT_LIGHT_TREE) uniform usamplerBuffer light_tree;
layout(binding = UNIT_ALBEDO) uniform sampler2D albedo_table;

// TraceTables::triangles: three vertex indices and the word of flags and material.
uvec4 triangle_row(uint triangle) { return texelFetch(scene_triangles, int(triangle)); }
uvec3 triangle_corners(uint triangle) { return triangle_row(triangle).xyz; }

// Returns the corner in block space.
vec3 corner_position(uint vertex) { return texelFetch(scene_positions, int(vertex)).xyz; }

// Returns row 0 to 2 of a block instance's matrix; `first` is kInstanceBlockToWorld or kInstanceWorldToBlock.
vec4 instance_row(uint instance, int first, int row) {
    return texelFetch(scene_instances, int(instance) * kInstanceStride + first + row);
}

// Returns the world position relative to the tables' origin.
vec3 block_to_world(uint instance, vec3 position) {
#ifdef HALFLIGHT_INSTANCES
    vec4 p = vec4(position, 1.0);
    return vec3(dot(instance_row(instance, kInstanceBlockToWorld, 0), p),
                dot(instance_row(instance, kInstanceBlockToWorld, 1), p),
                dot(instance_row(instance, kInstanceBlockToWorld, 2), p));
#else
    return position;
#endif
}
