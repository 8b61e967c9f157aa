#include <tbb/parallel_for.h>

#include <algorithm>
#include <map>
#include <set>

#include "engine/io/gltf/material.h"
#include "engine/io/jpeg.h"
#include "engine/io/png.h"

namespace halflight {
namespace {

/// Returns "images[3] (wood.png)".
std::string element_name(const GltfDocument& document, std::size_t image) {
    return fmt::format("images[{}] ({})", image, document.images[image].label);
}

ByteSource open_encoded(GltfDocument& document, std::size_t image) {
    const GltfImageSource& source = document.images[image];
    if (source.buffer_view == kNone) return document.open_uri(source.uri, element_name(document, image));
    return document.view_bytes(source.buffer_view);
}

/// Reads the header of an encoded image. Throws Error where there is none.
ImageHeader read_header(const ByteSource& encoded, int max_side) {
    const auto read = [&](std::uint64_t count) {
        std::string buffer;
        const std::string_view bytes = encoded.read(0, count, buffer);
        return is_png(bytes) ? read_png_header("", bytes, encoded.size(), max_side)
                             : read_jpeg_header("", bytes, encoded.size(), max_side);
    };
    constexpr std::uint64_t kMostHeaders = 1 << 16;  // bytes; only long profiles and previews make longer headers
    if (encoded.size() > kMostHeaders) {
        try {
            return read(kMostHeaders);
        } catch (const Error&) {
        }
    }
    return read(encoded.size());
}

TextureImage decode(const GltfDocument& document, std::size_t image, const ByteSource& encoded) {
    std::string buffer;
    const std::string_view bytes = encoded.read(0, encoded.size(), buffer);
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

ImageSizes measure_images(GltfDocument& document, const std::vector<GltfMaterial>& materials) {
    std::map<int, std::size_t> texels;  // bytes, by glTF image
    ImageSizes sizes;
    const auto measure = [&](int image) {
        const auto [it, is_new] = texels.try_emplace(image, 0);
        if (!is_new) return it->second;
        try {
            const ImageHeader header =
                read_header(open_encoded(document, static_cast<std::size_t>(image)), document.options.max_image_side);
            it->second = 4 * header.width * header.height;
            sizes.texels += it->second;
            sizes.largest_decoder = std::max(sizes.largest_decoder, header.decoding_bytes);
        } catch (const Error&) {
        }
        return it->second;
    };
    std::set<std::pair<int, float>> roughness;
    for (const GltfMaterial& m : materials) {
        for_each_texture(m.material, [&](const TextureRef& t) {
            if (t) measure(t.image);
        });
        const TextureRef& from = m.material.specular_color_texture;
        if (m.glossiness && roughness.emplace(from.image, *m.glossiness).second) sizes.texels += measure(from.image);
    }
    return sizes;
}

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

    std::vector<ByteSource> encoded;
    for (const std::size_t image : used) encoded.push_back(open_encoded(document, image));
    std::vector<TextureImage> images(used.size());
    tbb::parallel_for(std::size_t{0}, used.size(),
                      [&](std::size_t i) { images[i] = decode(document, used[i], encoded[i]); });

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
