// Texture units of the scene tables, one place for C++ and GLSL: every kernel shares them. A kernel's own blocks,
// images and textures have no number in the code; they are bound by name (engine/gpu/program_slots.h).
#pragma once

// The textures are texture buffers, for a reason that docs/measuring.md gives (start-up on llvmpipe). Unit 0 stays free:
// samplers without a layout unit read it.
#define UNIT_NODES 1               // RGBA32UI or RGBA32F: BVH4 nodes of all blocks and of the top level
#define UNIT_TRIANGLE_VERTICES 2   // RGBA32F: pairs of triangles in leaf order; RGB32F: vertices of pages
#define UNIT_BLOCK_HEADS 3         // R32UI: node index of the head of each instance's block
#define UNIT_INSTANCES 4           // RGBA32F: BlockInstance rows
#define UNIT_TRIANGLES 5           // RGBA32UI: TraceTables::triangles
#define UNIT_POSITIONS 6           // RGB32F: TraceTables::positions
#define UNIT_VERTICES 7            // RGBA32F: vertex attribute rows
#define UNIT_MATERIALS 8           // RGBA32F: material rows
#define UNIT_TEXTURES 9            // RGBA32UI: texture descriptors
#define UNIT_COLOR_TEXELS 10       // RGBA16F: linear colour; further banks below
#define UNIT_DATA_TEXELS 11        // RGBA8: normals, roughness, masks; further banks below
#define UNIT_LIGHTS 12             // RGBA32F: light rows
#define UNIT_LIGHT_ALIAS 13        // RG32F: alias table over lights
#define UNIT_LIGHT_OF_TRIANGLE 14  // R32UI: light of an emissive triangle
#define UNIT_ENVIRONMENT 15        // RGB32F: texels of the environment map, row-major from the top
#define UNIT_ENVIRONMENT_WARP 16   // RGBA32F: hierarchy of environment cells
#define UNIT_ALBEDO 17             // RG32F: directional albedo (E_A, E_B), row-major
#define UNIT_LIGHT_TREE 18         // RGBA32F: light tree
#define UNIT_COLOR_BANKS 19        // RGBA16F: banks 1 to 3 of the colour texels
#define UNIT_DATA_BANKS 22         // RGBA8: banks 1 to 3 of the data texels
#define UNIT_TILE_SLOTS 25         // R32UI: slot of each tile of textures
#define UNIT_LIGHT_GROUPS 26       // R32UI: light group of each light
#define UNIT_FREE 27               // first unit for a kernel's own textures
