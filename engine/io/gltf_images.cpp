#include <stb/stb_image.h>
#include <tbb/parallel_for.h>

#include <map>
#include <memory>

#include "engine/io/gltf_material.h"

namespace halflight {
namespace {

/// "images[3] (wood.png)"
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

bool is_png_or_jpeg(std::string_view bytes) {
    return bytes.starts_with("\x89PNG\r\n\x1a\n") || bytes.starts_with("\xff\xd8\xff");
}

TextureImage decode(const GltfDocument& document, std::size_t image, std::string_view bytes) {
    const std::string element = element_name(document, image);
    if (!is_png_or_jpeg(bytes)) document.fail(element, "is neither PNG nor JPEG");
    if (bytes.size() > std::numeric_limits<int>::max()) document.fail(element, "is larger than 2 GiB");
    const auto* data = reinterpret_cast<const stbi_uc*>(bytes.data());
    const int size = static_cast<int>(bytes.size());

    TextureImage result;
    result.name = document.images[image].label;
    int channels = 0;
    if (!stbi_info_from_memory(data, size, &result.width, &result.height, &channels))
        document.fail(element, "cannot be decoded: {}", stbi_failure_reason());
    const int limit = document.options.max_image_side;
    if (result.width > limit || result.height > limit)
        document.fail(element, "{} x {} texels are more than {} a side", result.width, result.height, limit);
    const std::unique_ptr<stbi_uc, decltype(&stbi_image_free)> texels(
        stbi_load_from_memory(data, size, &result.width, &result.height, &channels, STBI_rgb_alpha), stbi_image_free);
    if (!texels) document.fail(element, "cannot be decoded: {}", stbi_failure_reason());
    const std::size_t count =
        std::size_t{4} * static_cast<std::size_t>(result.width) * static_cast<std::size_t>(result.height);
    result.rgba.assign(texels.get(), texels.get() + count);
    return result;
}

/// Roughness in G, as metallic-roughness textures have it: 1 - factor * A. Metalness is none.
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
    std::map<int, int> place;  // of a glTF image among those in use
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
