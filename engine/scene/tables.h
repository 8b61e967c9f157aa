// The scene flattened into the arrays that the GPU reads. Pure: no OpenGL. What a scene does not have stays empty.
//
// Geometry is cut into *blocks*, each with a hierarchy of its own. All meshes that are used exactly once are transformed
// and merged into block 0 (its instance is the identity), so that most scenes need no second level; every mesh used more
// often is a block of its own, kept relative to the centre of its bounds. World positions are relative to `origin` (the
// centre of the scene's bounds, subtracted in double), so that a scene far from the world's origin keeps float precision.
#pragma once

#include <cstdint>
#include <vector>

#include "engine/core/math.h"
#include "engine/scene/scene.h"

namespace halflight {

/// Flags in the top byte of SceneTables::triangles[i].w; the low 24 bits are the material.
inline constexpr std::uint32_t kTriangleMaterialMask = 0x00ffffffu;
inline constexpr std::uint32_t kTriangleAlpha = 0x80000000u;  // alpha mask or blend: a hit needs the alpha test

struct Block {
    std::uint32_t first_triangle = 0;
    std::uint32_t triangle_count = 0;  // > 0
    Bounds bounds;                     // block space
};

struct BlockInstance {
    std::uint32_t block = 0;
    glm::mat4x3 block_to_world{1};  // affine, world relative to SceneTables::origin
    glm::mat4x3 world_to_block{1};  // its inverse, computed in double
    bool identity = false;
};

/// Where a triangle of the tables comes from, for the id outputs.
struct TriangleSource {
    std::uint32_t instance = 0;  // index into Scene::instances; for blocks used more than once: of the first of them
    std::uint32_t triangle = 0;  // within its mesh
};

struct TraceTables {
    dvec3 origin{0};
    Bounds bounds;                     // of everything, relative to origin
    std::vector<vec3> positions;       // block space
    std::vector<uvec4> triangles;      // xyz: indices into positions (and vertex attributes); w: flags | material
    std::vector<Block> blocks;
    std::vector<BlockInstance> instances;  // at least one where there is a triangle
    bool alpha_tested = false;             // whether any triangle has kTriangleAlpha
};
TraceTables build_trace_tables(const Scene& scene);

/// Everything that shading needs, packed as shaders/shared/{material,light,vertex}.h say.
struct ShadingTables;  // the shading tables' owner completes this (materials, textures, vertex attributes, lights, environment)

}  // namespace halflight
