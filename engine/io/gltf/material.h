// Materials and the images that they use.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "engine/io/gltf/document.h"

namespace halflight {

/// A material, and what only its loading needs.
struct GltfMaterial {
    Material material;
    std::array<int, 2> uv_sets{0, 1};  // which TEXCOORD_n the uv sets 0 and 1 are
    std::optional<float> glossiness;   // factor for A of the specular colour texture, which makes the roughness
};

/// Calls `f` with every texture reference; those that tangents depend on come early.
template <class M, class F>
void for_each_texture(M& m, F f) {
    f(m.base_color_texture), f(m.normal_texture), f(m.metallic_roughness_texture), f(m.emission_texture);
    f(m.specular_texture), f(m.specular_color_texture), f(m.clearcoat_texture), f(m.clearcoat_roughness_texture);
    f(m.clearcoat_normal_texture), f(m.transmission_texture);
}

/// In the file's order; texture references hold glTF image indices until load_images() has run.
std::vector<GltfMaterial> convert_materials(GltfDocument& document);

/// Decodes the images that materials refer to (PNG, JPEG), and points the materials at them. Throws Error that names
/// the image and its URI: missing, not decodable, too large, of another format.
std::vector<TextureImage> load_images(GltfDocument& document, std::vector<GltfMaterial>& materials);

}  // namespace halflight
