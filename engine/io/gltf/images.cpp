#include <tbb/parallel_for.h>

#include <map>

#include "engine/io/gltf/material.h"
#include "engine/io/jpeg.h"
#include "engine/io/png.h"

namespace halflight {
namespace {

/// Returns "images[3] (wood.png)".
std::string element_name(const GltfDocument& document, std::size_t image) {
    return fmt::format("images[{}] ({})", image, document.images[image].label);
}

/// An encoded image: in a buffer, or in a file that has been read.
struct Encoded {
    std::string file;
    std::string_view bytes;
};

Encoded read_encoded(GltfDocument& document, std::size_t image) {
    const GltfImageSource& source = document.images[image];
    Encoded encoded;
    if (source.buffer_view == kNone) {
        encoded.file = document.read_uri(source.uri, element_name(document, image));
        return encoded;
    }
    encoded.bytes = document.view_bytes(source.buffer_view);
    return encoded;
}

TextureImage decode(const GltfDocument& document, std::size_t image, std::string_view bytes) {
    const std::string element = element_name(document, image);
    const bool png = is_png(bytes);
    if (!png && !is_jpeg(bytes)) document.fail(element, "is neither PNG nor JPEG");
    TextureImage result;
    result.name = document.images[image].label;
    const std::string subject = document.file + ": " + element;
    const int max_side = document.options.max_image_side;
    png ? read_png(subject, bytes, max_side, result) : read_jpeg(subject, bytes, max_side, result);
    return result;
}

/// Returns a metallic-roughness texture: roughness 1 - factor * A in G, no metalness.
TextureImage roughness_from(const TextureImage& specular_glossiness, float factor) {
    TextureImage result = specular_glossiness;
    result.name += " (roughness)";
    for (std::size_t i = 0; i < result.rgba.size(); i += 4) {
        const float glossiness = factor * static_cast<float>(result.rgba[i + 3]);
        result.rgba[i] = result.rgba[i + 2] = 0;
        result.rgba[i + 1] = static_cast<std::uint8_t>(255.5f - glossiness);
        result.rgba[i + 3] = 255;
    }
    return result;
}

}  // namespace

std::vector<TextureImage> load_images(GltfDocument& document, std::vector<GltfMaterial>& materials) {
    std::map<int, int> place;  // index among the images in use, by glTF image
    std::vector<std::size_t> used;
    for (GltfMaterial& m : materials) {
        for_each_texture(m.material, [&](TextureRef& t) {
            if (!t) return;
            const auto [it, is_new] = place.try_emplace(t.image, static_cast<int>(used.size()));
            if (is_new) used.push_back(static_cast<std::size_t>(t.image));
            t.image = it->second;
        });
    }

    std::vector<Encoded> encoded;
    for (const std::size_t image : used) encoded.push_back(read_encoded(document, image));
    std::vector<TextureImage> images(used.size());
    tbb::parallel_for(std::size_t{0}, used.size(), [&](std::size_t i) {
        images[i] = decode(document, used[i], encoded[i].file.empty() ? encoded[i].bytes : encoded[i].file);
        encoded[i] = {};
    });

    std::map<std::pair<int, float>, int> roughness;
    for (GltfMaterial& m : materials) {
        if (!m.glossiness) continue;
        TextureRef& t = m.material.metallic_roughness_texture = m.material.specular_color_texture;
        const auto [it, is_new] = roughness.try_emplace({t.image, *m.glossiness}, static_cast<int>(images.size()));
        if (is_new) images.push_back(roughness_from(images[static_cast<std::size_t>(t.image)], *m.glossiness));
        t.image = it->second;
        m.material.roughness = 1;
    }
    return images;
}

}  // namespace halflight
