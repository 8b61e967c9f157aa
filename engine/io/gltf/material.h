// Conversion of materials and the images that they use.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "engine/io/gltf/document.h"
#include "engine/scene/material_properties.h"

namespace halflight {

/// A material and the values that only loading needs.
struct GltfMaterial {
    Material material;
    std::array<int, 2> uv_sets{0, 1};  // n of the TEXCOORD_n that uv sets 0 and 1 hold
    bool anisotropic = false;          // has KHR_materials_anisotropy, so meshes need tangents in all poses
    std::optional<float> glossiness;   // factor for A of the specular colour texture, from which roughness is made
};

/// Calls `f` with every texture reference, in the order of material_textures().
template <class M, class F>
void for_each_texture(M& m, F f) {
    for (const MaterialTexture& texture : material_textures()) f(m.*texture.field);
}

/// Returns the materials in the file's order. Texture references hold glTF image indices until load_images() has run.
std::vector<GltfMaterial> convert_materials(GltfDocument& document);

struct ImageSizes {
    std::size_t texels = 0;           // bytes of all textures
    std::size_t deep = 0;             // those that images of 16 bits take beyond 8 bits
    std::size_t pinned = 0;           // bytes of textures that tests of alpha and lights look up
    std::size_t largest = 0;          // bytes of the largest image
    std::size_t largest_decoder = 0;  // bytes that one decoder needs at most besides its texels
};

/// Returns the sizes of the images that materials refer to, from the headers of the files. Images that load_images()
/// refuses count as empty.
ImageSizes measure_images(GltfDocument& document, const std::vector<GltfMaterial>& materials);

/// Returns the number of texels of an image of the file. Throws Error if it has no readable header.
std::size_t measure_image(GltfDocument& document, std::size_t image);

/// Decodes an image of the file, without mip levels. Throws Error if it cannot be read, or if it does not fit into the
/// memory budget.
TextureImage read_image(GltfDocument& document, std::size_t image);

/// Decodes the images that materials refer to (PNG, JPEG, WebP, KTX2) and points the materials at them. Throws Error
/// that names image and URI if one is missing, cannot be decoded, is too large or has another format. Fallbacks
/// replace images of optional extensions; textures without a readable image are left out, with a warning.
std::vector<TextureImage> load_images(GltfDocument& document, std::vector<GltfMaterial>& materials,
                                      GltfWarnings& warnings);

}  // namespace halflight
