// Texture units of the scene tables, one place for C++ and GLSL: every kernel shares them. A kernel's own blocks,
// images and textures have no number in the code; they are bound by name (engine/gpu/program_slots.h).
#ifndef HALFLIGHT_SHARED_BINDINGS_H
#define HALFLIGHT_SHARED_BINDINGS_H

// Texture buffers unless said otherwise. Unit 0 stays free: it is what a sampler has whose unit no layout names.
#define UNIT_NODES 1               // RGBA32UI or RGBA32F: BVH4 nodes of all blocks and of the top level
#define UNIT_TRIANGLE_VERTICES 2   // RGBA32F: pairs of triangles in leaf order
#define UNIT_INSTANCES 3           // RGBA32F: BlockInstance rows
#define UNIT_TRIANGLES 4           // RGBA32UI: TraceTables::triangles
#define UNIT_POSITIONS 5           // RGB32F: TraceTables::positions
#define UNIT_VERTICES 6            // RGBA32F: vertex attribute rows
#define UNIT_MATERIALS 7           // RGBA32F: material rows
#define UNIT_TEXTURES 8            // RGBA32UI: texture descriptors
#define UNIT_COLOR_TEXELS 9        // RGBA16F: linear colour
#define UNIT_DATA_TEXELS 10        // RGBA8: normals, roughness, masks
#define UNIT_LIGHTS 11             // RGBA32F: light rows
#define UNIT_LIGHT_ALIAS 12        // RG32F: alias table over lights
#define UNIT_LIGHT_OF_TRIANGLE 13  // R32UI: light of an emissive triangle
#define UNIT_ENVIRONMENT 14        // 2D RGB32F
#define UNIT_ENVIRONMENT_ALIAS 15  // RGBA32F: alias table over environment cells
#define UNIT_ALBEDO 16             // 2D RG32F: directional albedo (E_A, E_B)
#define UNIT_LIGHT_TREE 17         // RGBA32F: light tree
#define UNIT_FREE 18               // first unit for a kernel's own textures

#endif
