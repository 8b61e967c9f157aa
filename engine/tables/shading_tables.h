// The scene's materials, textures, vertex attributes and lights, packed for shaders/lib. Pure: no OpenGL.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "engine/core/image.h"
#include "engine/core/math.h"
#include "engine/tables/lights.h"
#include "engine/tables/needs.h"
#include "engine/tables/tables.h"

namespace halflight {

/// An image in one of the pools of texels.
struct PooledImage {
    int image = 0;          // index into Scene::images
    bool is_color = false;  // in color_texels, decoded from sRGB; otherwise in data_texels
    bool operator==(const PooledImage&) const = default;
};

/// Layouts: shaders/shared/{vertex,material,texture,light,environment}.h. What is not needed stays empty.
struct ShadingTables {
    SceneNeeds needs;
    std::vector<vec4> vertices;                              // RGBA32F, vertex_stride() texels each
    std::vector<vec4> materials;                             // RGBA32F
    std::vector<uvec4> textures;                             // RGBA32UI
    std::vector<PooledImage> pooled;                         // in the order of their texels
    bool texels_left_out = false;                            // see build_shading_tables
    std::vector<std::array<std::uint16_t, 4>> color_texels;  // RGBA16F
    std::vector<std::array<std::uint8_t, 4>> data_texels;    // RGBA8
    std::vector<vec4> lights;                                // RGBA32F
    std::vector<vec2> light_alias;                           // RG32F
    std::vector<uvec4> light_tree;                           // RGBA32UI
    LightChoice light_choice = LightChoice::power;           // never `automatic`
    std::vector<std::uint32_t> light_of_triangle;            // R32UI
    Image environment;                                       // 3 channels, colour multiplied in; 1x1 where constant
    std::vector<vec4> environment_cells;                     // RGBA32F
    Image albedo;                                            // 2 channels (albedo.h); empty unless glossy
};

/// Precondition: validate(scene) passes, `trace` was built from it. Throws Error where a table exceeds 2^32 texels or
/// 2^31 lights. kept: tables are made as if the scene needed that, too; what they hold then adds nothing to a picture.
/// Precondition: `kept` has no light tree. last: `pooled` of a pose with the same images; where the pools would be the
/// same, texels are left out.
ShadingTables build_shading_tables(const Scene& scene, const TraceTables& trace, const SceneNeeds& kept = {},
                                   LightChoice choice = LightChoice::automatic, SunChoice sun = SunChoice::among,
                                   const std::vector<PooledImage>* last = nullptr);

}  // namespace halflight
