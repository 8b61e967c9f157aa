// The scene's materials, textures, vertex attributes and lights, packed for shaders/lib. This code uses no OpenGL.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <vector>

#include "engine/core/image.h"
#include "engine/core/math.h"
#include "engine/tables/lights.h"
#include "engine/tables/needs.h"
#include "engine/tables/tables.h"

namespace halflight {

/// An image in one of the texel pools.
struct PooledImage {
    int image = 0;          // index into Scene::images
    bool is_color = false;  // true: in color_texels, decoded from sRGB; false: in data_texels
    bool pinned = false;  // kernels other than shaders/resolve.comp look it up: for tests of alpha, at lights, at panes
    bool operator==(const PooledImage&) const = default;
};

/// Texels of images, one image after the other, as the device stores them. They are converted when they are read, so
/// that a second copy of all textures is never in memory. The scene must keep its images until then.
template <class Channel>
class TexelPool {
  public:
    using Texel = std::array<Channel, 4>;

    void add(const TextureImage& image);
    std::size_t size() const { return size_; }
    bool empty() const { return size_ == 0; }
    /// Converts texels from `first` on. Precondition: first + texels.size() <= size().
    void read(std::size_t first, std::span<Texel> texels) const;

  private:
    static std::size_t bytes_of_place(const TextureImage& image);

    std::map<std::size_t, const TextureImage*> images_;  // images by the index of their first texel
    std::size_t size_ = 0;
};

/// A use of an image whose texels are loaded in tiles. Uses of the same texels have tiles of their own.
struct TiledTexture {
    std::shared_ptr<const ImageTiles> tiles;
    ivec2 size{0};          // texels; deep ones of data take two columns
    bool is_color = false;  // PooledImage::is_color
    bool deep = false;      // TextureImage::deep
    bool pinned = false;    // PooledImage::pinned
    std::uint32_t first_tile = 0;

    /// Returns the texels of a tile along its edges (shaders/shared/texture_rows.h).
    ivec2 tile_size() const;
    ivec2 tile_count() const;  ///< Returns the tiles along both edges.
};

/// Packed tables. shaders/shared/{vertex,texture,light,environment}.h define their layouts, and
/// shaders/lib/material_properties.glsl that of materials. Tables that the scene does not need stay empty.
struct ShadingTables {
    SceneNeeds needs;
    std::vector<vec4> vertices;                     // RGBA32F: vertex_stride() texels per vertex
    std::vector<vec4> materials;                    // RGBA32F: rows of materials
    std::vector<uvec4> textures;                    // RGBA32UI: texture descriptors
    std::vector<PooledImage> pooled;                // images in the order of their texels
    bool texels_left_out = false;                   // true: the pools equal those of `last`
    TexelPool<std::uint16_t> color_texels;          // RGBA16F: pool of linear colours
    TexelPool<std::uint8_t> data_texels;            // RGBA8: pool of data; texels of 16 bits take two places
    std::vector<TiledTexture> tiled;                // in place of both pools, for scenes with tiled textures
    std::vector<vec4> lights;                       // RGBA32F: rows of lights
    std::vector<vec2> light_alias;                  // RG32F: alias table over lights
    std::vector<uvec4> light_tree;                  // RGBA32UI: light tree
    LightChoice light_choice = LightChoice::power;  // choice in use, never `automatic`
    std::vector<std::uint32_t> light_of_triangle;   // R32UI: light of each triangle
    std::vector<std::uint32_t> light_groups;        // R32UI: LightTables::groups
    std::vector<uvec4> light_links;                 // RGBA32UI: LightTables::links
    Image environment;                              // map of 3 channels, times the colour; 1x1 if constant
    std::vector<vec4> environment_warp;             // RGBA32F: hierarchy of cells
    Image albedo;                                   // table of 2 channels (albedo.h); empty unless glossy
};

/// Returns the tables. Precondition: validate(scene) passes, `trace` was built from it. Throws Error if a table
/// would exceed 2^32 texels or 2^31 lights. `kept` are features that get tables although the scene does not need them;
/// such tables change no picture. A light tree cannot be kept. `last` is `pooled` of another pose with the same images,
/// or null. If the pools are equal, texels are left out.
ShadingTables build_shading_tables(const Scene& scene, const TraceTables& trace, const SceneNeeds& kept = {},
                                   LightChoice choice = LightChoice::automatic, SunChoice sun = SunChoice::among,
                                   const std::vector<PooledImage>* last = nullptr);

/// Returns the needs that these tables would have, without texels and vertices.
SceneNeeds shading_needs(const Scene& scene, const TraceTables& trace, LightChoice choice, SunChoice sun);

}  // namespace halflight
