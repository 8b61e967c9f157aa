// The scene's materials, textures, vertex attributes and lights, packed for shaders/lib. Pure: no OpenGL.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "engine/core/image.h"
#include "engine/core/math.h"
#include "engine/scene/tables.h"

namespace halflight {

/// What the scene has that a shader must know of. On a software driver an untaken branch costs as much as a taken one,
/// so everything that is false here is compiled away (shader_defines).
struct SceneNeeds {
    bool instances = false;  // some block is not in world space
    bool vertex_colors = false;
    bool normal_maps = false;  // with tangents to go with them
    bool texture_transforms = false;
    bool alpha = false;  // alpha decides some hit
    bool unlit = false;
    bool diffuse = false;  // some material scatters diffusely
    bool glossy = false;   // some material reflects specularly, has a coat or transmits
    bool clearcoat = false;
    bool transmission = false;
    bool specular_color = false;  // some material is not white there
    bool emission = false;        // some surface glows, unlit ones included
    bool area_lights = false;
    bool punctual_lights = false;
    bool environment = false;      // not black
    bool environment_map = false;  // not constant

    // Texture slots in use.
    bool base_color_texture = false;
    bool metallic_roughness_texture = false;
    bool normal_texture = false;
    bool emission_texture = false;
    bool specular_texture = false;
    bool specular_color_texture = false;
    bool clearcoat_texture = false;
    bool clearcoat_roughness_texture = false;
    bool clearcoat_normal_texture = false;
    bool transmission_texture = false;

    /// Whether anything can be picked by next-event estimation.
    bool lights() const { return area_lights || punctual_lights || environment; }
    bool textures() const;
    /// Texels per vertex (shaders/shared/vertex.h).
    int vertex_stride() const;
};

/// Macros (name, value) that select the variant of shaders/lib for a scene; sorted by name.
std::vector<std::pair<std::string, std::string>> shader_defines(const SceneNeeds& needs);

/// Layouts: shaders/shared/{vertex,material,texture,light,environment}.h. What is not needed stays empty.
struct ShadingTables {
    SceneNeeds needs;
    std::vector<vec4> vertices;                              // RGBA32F, vertex_stride() texels each
    std::vector<vec4> materials;                             // RGBA32F
    std::vector<uvec4> textures;                             // RGBA32UI
    std::vector<std::array<std::uint16_t, 4>> color_texels;  // RGBA16F
    std::vector<std::array<std::uint8_t, 4>> data_texels;    // RGBA8
    std::vector<vec4> lights;                                // RGBA32F
    std::vector<vec2> light_alias;                           // RG32F
    std::vector<std::uint32_t> light_of_triangle;            // R32UI
    Image environment;                                       // 3 channels, colour multiplied in; 1x1 where constant
    std::vector<vec4> environment_cells;                     // RGBA32F
    Image albedo;                                            // 2 channels (albedo.h); empty unless glossy
};

/// Precondition: validate(scene) passes, `trace` was built from it. Throws Error where a table exceeds 2^32 texels or
/// 2^31 lights.
ShadingTables build_shading_tables(const Scene& scene, const TraceTables& trace);

}  // namespace halflight
