// Texture units of the scene tables, one place for C++ and GLSL: every kernel shares them. A kernel's own blocks,
// images and textures have no number in the code; they are bound by name (engine/gpu/program_slots.h).
#pragma once

#include "shaders/shared/portable.h"

HALFLIGHT_SHARED_BEGIN

// The textures are texture buffers, for a reason that docs/measuring.md gives (start-up on llvmpipe). Unit 0 stays
// free: samplers without a layout unit read it.
HALFLIGHT_SHARED_CONST int kUnitNodes = 1;             // RGBA32UI: BVH4 nodes of all blocks and of the top level
HALFLIGHT_SHARED_CONST int kUnitTriangleVertices = 2;  // RGBA32F: pairs of triangles; RGB32F: vertices of pages
HALFLIGHT_SHARED_CONST int kUnitBlockHeads = 3;        // R32UI: node index of the head of each instance's block
HALFLIGHT_SHARED_CONST int kUnitInstances = 4;         // RGBA32F: BlockInstance rows
HALFLIGHT_SHARED_CONST int kUnitTriangles = 5;         // RGBA32UI: TraceTables::triangles
HALFLIGHT_SHARED_CONST int kUnitPositions = 6;         // RGB32F: TraceTables::positions
HALFLIGHT_SHARED_CONST int kUnitVertices = 7;          // RGBA32F: vertex attribute rows
HALFLIGHT_SHARED_CONST int kUnitMaterials = 8;         // RGBA32F: material rows
HALFLIGHT_SHARED_CONST int kUnitTextures = 9;          // RGBA32UI: texture descriptors
HALFLIGHT_SHARED_CONST int kUnitColorTexels = 10;      // RGBA16F: linear colour; further banks below
HALFLIGHT_SHARED_CONST int kUnitDataTexels = 11;       // RGBA8: normals, roughness, masks; further banks below
HALFLIGHT_SHARED_CONST int kUnitLights = 12;           // RGBA32F: light rows
HALFLIGHT_SHARED_CONST int kUnitLightAlias = 13;       // RG32F: alias table over lights
HALFLIGHT_SHARED_CONST int kUnitLightOfTriangle = 14;  // R32UI: light of an emissive triangle
HALFLIGHT_SHARED_CONST int kUnitEnvironment = 15;      // RGB32F: texels of the environment map, row-major from the top
HALFLIGHT_SHARED_CONST int kUnitEnvironmentWarp = 16;  // RGBA32F: hierarchy of environment cells
HALFLIGHT_SHARED_CONST int kUnitAlbedo = 17;           // RG32F: directional albedo (E_A, E_B), row-major
HALFLIGHT_SHARED_CONST int kUnitLightTree = 18;        // RGBA32UI: light tree
HALFLIGHT_SHARED_CONST int kUnitColorBanks = 19;       // RGBA16F: banks 1 to 3 of the colour texels
HALFLIGHT_SHARED_CONST int kUnitDataBanks = 22;        // RGBA8: banks 1 to 3 of the data texels
HALFLIGHT_SHARED_CONST int kUnitTileSlots = 25;        // R32UI: slot of each tile of textures
HALFLIGHT_SHARED_CONST int kUnitLightGroups = 26;      // R32UI: light group and links of each light
HALFLIGHT_SHARED_CONST int kUnitLightLinks = 27;       // RGBA32UI: sets of light links, and classes of objects
HALFLIGHT_SHARED_CONST int kUnitFree = 28;             // first unit for a kernel's own textures

HALFLIGHT_SHARED_END
