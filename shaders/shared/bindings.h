// Binding points, one place for C++ and GLSL. Texture units are shared by every kernel; storage blocks belong to the
// kernel that declares them, at most 16 (GL promises 8; accumulate.comp may take all).
#ifndef HALFLIGHT_SHARED_BINDINGS_H
#define HALFLIGHT_SHARED_BINDINGS_H

// Texture units (texture buffers unless said otherwise).
#define UNIT_NODES 0               // RGBA32UI or RGBA32F: BVH4 nodes of all blocks and of the top level
#define UNIT_TRIANGLE_VERTICES 1   // RGBA32F: pairs of triangles in leaf order
#define UNIT_INSTANCES 2           // RGBA32F: BlockInstance rows
#define UNIT_TRIANGLES 3           // RGBA32UI: TraceTables::triangles
#define UNIT_POSITIONS 4           // RGB32F: TraceTables::positions
#define UNIT_VERTICES 5            // RGBA32F: vertex attribute rows
#define UNIT_MATERIALS 6           // RGBA32F: material rows
#define UNIT_TEXTURES 7            // RGBA32UI: texture descriptors
#define UNIT_COLOR_TEXELS 8        // RGBA16F: linear colour
#define UNIT_DATA_TEXELS 9         // RGBA8: normals, roughness, masks
#define UNIT_LIGHTS 10             // RGBA32F: light rows
#define UNIT_LIGHT_ALIAS 11        // RG32F: alias table over lights
#define UNIT_LIGHT_OF_TRIANGLE 12  // R32UI: light of an emissive triangle
#define UNIT_ENVIRONMENT 13        // 2D RGB32F
#define UNIT_ENVIRONMENT_ALIAS 14  // RGBA32F: alias table over environment cells
#define UNIT_ALBEDO 15             // 2D RG32F: directional albedo (E_A, E_B)
#define UNIT_LIGHT_TREE 16         // RGBA32F: light tree
#define UNIT_FREE 17               // first unit for a kernel's own textures

// Uniform blocks.
#define BLOCK_FRAME 0  // struct Frame of shaders/shared/frame.h

#endif
