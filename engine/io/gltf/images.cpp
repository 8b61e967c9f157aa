#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <map>
#include <optional>
#include <set>

#include "engine/io/file_kind.h"
#include "engine/io/gltf/material.h"
#include "engine/io/jpeg.h"
#include "engine/io/ktx2.h"
#include "engine/io/png.h"
#include "engine/io/texture_store.h"
#include "engine/io/webp.h"
#include "engine/scene/material_lobes.h"
#include "engine/scene/texture_levels.h"

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

/// A format of images; content decides which applies, not the media type or the extension that names an image.
struct ImageFormat {
    bool (*is)(std::string_view bytes);
    ImageHeader (*read_header)(const std::string& subject, std::string_view bytes, std::uint64_t file_bytes,
                               int max_side);
    void (*read)(const std::string& subject, std::string_view bytes, int max_side, TextureImage& image);
};
constexpr ImageFormat kFormats[] = {{is_png, read_png_header, read_png},
                                    {is_jpeg, read_jpeg_header, read_jpeg},
                                    {is_webp, read_webp_header, read_webp},
                                    {is_ktx2, read_ktx2_header, read_ktx2}};

/// Throws Error about `subject` for other formats.
const ImageFormat& format_of(const std::string& subject, std::string_view bytes) {
    const auto* format = std::ranges::find_if(kFormats, [&](const ImageFormat& f) { return f.is(bytes); });
    if (format != std::end(kFormats)) return *format;
    const std::string_view kind = kind_of_file(bytes, bytes.size());
    throw Error(subject, "is {}; textures are PNG, JPEG, WebP or KTX2", kind.empty() ? "of an unknown format" : kind);
}

/// Reads the header of an encoded image. A file counts as memory for decoding, which reads it whole. Throws Error about
/// `subject` if there is no header.
ImageHeader read_header(const std::string& subject, const ByteSource& encoded, int max_side) {
    const auto read = [&](std::uint64_t count) {
        std::string buffer;
        const std::string_view bytes = encoded.read(0, std::min(count, encoded.size()), buffer);
        ImageHeader header = format_of(subject, bytes).read_header(subject, bytes, encoded.size(), max_side);
        if (encoded.is_file()) header.decoding_bytes += encoded.size();
        return header;
    };
    constexpr std::uint64_t kMostHeaders = 1 << 16, kLongest = 1 << 24;  // bytes; long ones have profiles and previews
    if (encoded.size() > kMostHeaders) {
        try {
            return read(kMostHeaders);
        } catch (const Error&) {
        }
    }
    return read(kLongest);
}

/// An image of the document, or the reason why it cannot be read.
struct DecodedImage {
    TextureImage image;
    ImageHeader header;
    std::uint64_t key = 0;  // TextureStore::key()
    std::string error;      // reason why the image could not be read; empty: it was read
};

/// Decodes an image and makes its levels, or takes both from the cache of the store.
void decode(const GltfDocument& document, std::size_t image, const ByteSource& encoded, const LevelUses& uses,
            DecodedImage& result) {
    const std::string subject = document.file + ": " + element_name(document, image);
    const int max_side = document.options.max_image_side;
    result.image.name = document.images[image].label;
    result.header = read_header(subject, encoded, max_side);
    std::string buffer;
    const std::string_view bytes = encoded.read(0, encoded.size(), buffer);
    if (TextureStore* store = document.options.textures.get()) {
        result.key = TextureStore::key(bytes, uses);
        if (store->find(result.key, result.image)) return;
    }
    format_of(subject, bytes).read(subject, bytes, max_side, result.image);
    add_levels(result.image, uses);
}

/// Returns the lookups that choose mip levels, by glTF image. Rays and light samples look up colours of surfaces with
/// alpha tests, and emission, at level 0 without a footprint. Therefore these textures get no levels.
std::map<int, LevelUses> level_uses(const GltfDocument& document, const std::vector<GltfMaterial>& materials) {
    std::map<int, LevelUses> uses;
    std::set<int> without;
    if (!document.options.mip_levels) return uses;
    // Calls f(image) for an image and its fallbacks until it returns false. Fallbacks may form a ring.
    const auto for_chain = [&](int image, auto f) {
        while (image != kNone && f(image)) image = document.images[static_cast<std::size_t>(image)].fallback;
    };
    for (const GltfMaterial& m : materials) {
        for (const MaterialTexture& texture : material_textures()) {
            const TextureRef& t = m.material.*texture.field;
            if (!t) continue;
            const bool color = texture.use == TextureUse::color;
            const LevelUses use{color, !color, texture.use == TextureUse::normal_map};
            const bool fixed =
                texture.field == &Material::emission_texture ||
                (texture.field == &Material::base_color_texture && m.material.alpha_mode != AlphaMode::opaque);
            for_chain(t.image, [&](int image) {
                LevelUses& all = uses[image];
                const LevelUses before = all;
                all |= use;
                return all != before;
            });
            if (fixed) for_chain(t.image, [&](int image) { return without.insert(image).second; });
        }
    }
    for (const int image : without) uses[image].color = false;
    return uses;
}

/// Returns the bytes of the mip levels of an image.
std::size_t level_bytes(const ImageHeader& header, const LevelUses& uses) {
    const std::size_t chains = (uses.color ? 1 : 0) + (uses.data || uses.normal ? 1 : 0);
    const std::size_t texels = level_texels(static_cast<int>(header.width), static_cast<int>(header.height));
    return (header.deep ? 8 : 4) * chains * texels;
}

using DecodedImages = std::map<int, DecodedImage>;  // by glTF image

/// Returns the number of images to decode at once if a store takes them: as many as half of the memory that is left
/// holds, at most one per core.
int threads_for_decoding(const GltfDocument& document, const std::vector<ByteSource>& encoded) {
    std::size_t largest = 1;
    for (const ByteSource& source : encoded) {
        try {
            const ImageHeader header = read_header("", source, document.options.max_image_side);
            const std::size_t with_levels = document.options.mip_levels ? 2 : 1;  // at most, as colour and as data
            largest = std::max(largest, with_levels * header.texels_bytes() + header.decoding_bytes);
        } catch (const Error&) {  // decoding reports the error
        }
    }
    const std::size_t threads = MemoryLedger::process().free() / 2 / largest;
    const auto cores = static_cast<std::size_t>(tbb::this_task_arena::max_concurrency());
    return static_cast<int>(std::clamp(threads, std::size_t{1}, cores));
}

/// Decodes images, and the fallbacks of those that cannot be read. Throws the error of an image that its textures need.
DecodedImages decode_all(GltfDocument& document, std::set<int> wanted, const std::map<int, LevelUses>& uses) {
    DecodedImages decoded;
    while (!wanted.empty()) {
        const std::vector<int> round(wanted.begin(), wanted.end());
        wanted.clear();
        std::vector<ByteSource> encoded(round.size());
        std::vector<DecodedImage> results(round.size());
        const auto attempt = [&](std::size_t i, auto f) {
            const auto image = static_cast<std::size_t>(round[i]);
            try {
                if (results[i].error.empty()) f(image);
            } catch (const Error& e) {
                if (!document.images[image].optional || document.options.strict) throw;
                results[i].error = e.what();
            }
        };
        for (std::size_t i = 0; i < round.size(); ++i)
            attempt(i, [&](std::size_t image) { encoded[i] = open_encoded(document, image); });
        TextureStore* const store = document.options.textures.get();
        const auto decode_round = [&] {
            tbb::parallel_for(std::size_t{0}, round.size(), [&](std::size_t i) {
                const auto use = uses.find(round[i]);
                attempt(i, [&](std::size_t image) {
                    decode(document, image, encoded[i], use == uses.end() ? LevelUses() : use->second, results[i]);
                });
                if (store && results[i].error.empty() && !results[i].image.tiles)
                    store->take(results[i].image, results[i].key);
            });
        };
        if (store)
            tbb::task_arena(threads_for_decoding(document, encoded)).execute(decode_round);
        else
            decode_round();
        for (std::size_t i = 0; i < round.size(); ++i) {
            const GltfImageSource& source = document.images[static_cast<std::size_t>(round[i])];
            if (!results[i].error.empty() && source.fallback != kNone) wanted.insert(source.fallback);
            decoded[round[i]] = std::move(results[i]);
        }
        std::erase_if(wanted, [&](int image) { return decoded.contains(image); });
        if (store) store->trim();
    }
    return decoded;
}

/// Returns for each image itself, or the first of its fallbacks that has been read; kNone: none.
std::map<int, int> readable_images(const GltfDocument& document, const DecodedImages& decoded) {
    std::map<int, int> readable;
    for (const auto& [first, result] : decoded) {
        std::vector<int> passed;
        int image = first;
        for (; image != kNone && !readable.contains(image);
             image = document.images[static_cast<std::size_t>(image)].fallback) {
            const bool read = decoded.at(image).error.empty();
            readable[image] = read ? image : kNone;  // kNone also ends a ring of fallbacks
            if (read) break;
            passed.push_back(image);
        }
        for (const int other : passed) readable[other] = image == kNone ? kNone : readable.at(image);
    }
    return readable;
}

void warn_of_unreadable(const GltfDocument& document, const DecodedImages& decoded, const std::map<int, int>& readable,
                        GltfWarnings& warnings) {
    for (const auto& [image, result] : decoded) {
        if (result.error.empty()) continue;
        const std::string element = element_name(document, static_cast<std::size_t>(image));
        std::string_view reason = result.error;
        for (const std::string& prefix : {document.file + ": ", element + ": "})
            if (reason.starts_with(prefix)) reason.remove_prefix(prefix.size());
        const int other = readable.at(image);
        warnings.add(other == kNone ? fmt::format("{}; textures do without it (--strict: an error)", reason)
                                    : fmt::format("{}; textures use {} instead", reason,
                                                  element_name(document, static_cast<std::size_t>(other))),
                     element);
    }
}

/// KHR_texture_basisu demands that primaries and transfer function fit the use; glTF 2.0 says how texels are read.
void warn_of_colors(TextureUse use, const ImageHeader& header, const std::string& element, GltfWarnings& warnings) {
    const bool color = use == TextureUse::color;
    const char* const read_as = color ? "sRGB" : "linear";
    if (header.srgb && *header.srgb != color)
        warnings.add(fmt::format("is marked as {}, but used as {}; its texels are read as {}",
                                 color ? "linear" : "sRGB", color ? "a colour" : "data", read_as),
                     element);
    if (!header.transfer.empty())
        warnings.add(fmt::format("has the transfer function {}, which glTF does not allow; its texels are read as {}",
                                 header.transfer, read_as),
                     element);
    if (color && !header.primaries.empty())
        warnings.add(
            fmt::format("has the colour primaries {}, which glTF does not allow; its colours are read as BT.709",
                        header.primaries),
            element);
}

/// Returns a metallic-roughness texture: roughness 1 - factor * A in G, no metalness.
TextureImage roughness_from(const TextureImage& specular_glossiness, float factor) {
    TextureImage result{.name = specular_glossiness.name + " (roughness)",
                        .width = specular_glossiness.width,
                        .height = specular_glossiness.height,
                        .rgba = {},
                        .deep = specular_glossiness.deep};
    std::vector<std::uint8_t> rgba = all_texels(specular_glossiness);
    const float largest = static_cast<float>(result.largest());
    for (std::size_t i = 0; i < rgba.size(); i += result.texel_bytes()) {
        const float glossiness = factor * static_cast<float>(result.code(&rgba[i], 3));
        const auto roughness = static_cast<std::uint32_t>(largest + 0.5f - glossiness);
        const std::array<std::uint32_t, 4> codes = {0, roughness, 0, result.largest()};
        for (std::size_t c = 0; c < 4; ++c) {
            rgba[i + c] = static_cast<std::uint8_t>(result.deep ? codes[c] >> 8 : codes[c]);
            if (result.deep) rgba[i + c + 4] = static_cast<std::uint8_t>(codes[c] & 255);
        }
    }
    result.rgba = std::move(rgba);
    return result;
}

}  // namespace

std::size_t measure_image(GltfDocument& document, std::size_t image) {
    const std::string subject = document.file + ": " + element_name(document, image);
    const ImageHeader header = read_header(subject, open_encoded(document, image), document.options.max_image_side);
    return header.width * header.height;
}

TextureImage read_image(GltfDocument& document, std::size_t image) {
    const std::string subject = document.file + ": " + element_name(document, image);
    const ByteSource encoded = open_encoded(document, image);
    const int max_side = document.options.max_image_side;
    const ImageHeader header = read_header(subject, encoded, max_side);
    MemoryLedger::process().check(header.texels_bytes() + header.decoding_bytes, subject, "image");
    std::string buffer;
    const std::string_view bytes = encoded.read(0, encoded.size(), buffer);
    TextureImage result;
    format_of(subject, bytes).read(subject, bytes, max_side, result);
    return result;
}

ImageSizes measure_images(GltfDocument& document, const std::vector<GltfMaterial>& materials) {
    std::map<int, std::size_t> texels;  // bytes of level 0, by glTF image
    ImageSizes sizes;
    const std::map<int, LevelUses> uses = level_uses(document, materials);
    const auto measure = [&](int image) {
        for (; image != kNone; image = document.images[static_cast<std::size_t>(image)].fallback) {
            const auto [it, is_new] = texels.try_emplace(image, 0);
            if (!is_new) return it->second;
            try {
                const ImageHeader header = read_header("", open_encoded(document, static_cast<std::size_t>(image)),
                                                       document.options.max_image_side);
                it->second = header.texels_bytes();
                const auto use = uses.find(image);
                const std::size_t with_levels =
                    it->second + level_bytes(header, use == uses.end() ? LevelUses() : use->second);
                sizes.texels += with_levels;
                if (header.deep) sizes.deep += with_levels / 2;
                sizes.largest = std::max(sizes.largest, with_levels);
                sizes.largest_decoder = std::max(sizes.largest_decoder, header.decoding_bytes);
                return it->second;
            } catch (const Error&) {
            }
        }
        return std::size_t{0};
    };
    std::set<std::pair<int, float>> roughness;
    std::set<int> pinned;
    for (const GltfMaterial& m : materials) {
        for_each_texture(m.material, [&](const TextureRef& t) {
            if (t) measure(t.image);
            if (t && is_pane(m.material)) pinned.insert(t.image);
        });
        const TextureRef& coverage = m.material.base_color_texture;
        if (coverage && m.material.alpha_mode != AlphaMode::opaque) pinned.insert(coverage.image);
        if (m.material.emission_texture) pinned.insert(m.material.emission_texture.image);
        const TextureRef& from = m.material.specular_color_texture;
        if (m.glossiness && roughness.emplace(from.image, *m.glossiness).second)
            sizes.texels += measure(from.image) * (document.options.mip_levels ? 2 : 1);
    }
    for (const int image : pinned) sizes.pinned += measure(image);
    return sizes;
}

std::vector<TextureImage> load_images(GltfDocument& document, std::vector<GltfMaterial>& materials,
                                      GltfWarnings& warnings) {
    std::set<int> used;
    for (const GltfMaterial& m : materials) {
        for_each_texture(m.material, [&](const TextureRef& t) {
            if (t) used.insert(t.image);
        });
    }
    DecodedImages decoded = decode_all(document, std::move(used), level_uses(document, materials));
    const std::map<int, int> readable = readable_images(document, decoded);
    warn_of_unreadable(document, decoded, readable, warnings);

    std::vector<TextureImage> images;
    std::map<int, int> place;  // index into `images`, by glTF image
    for (GltfMaterial& m : materials) {
        for (const MaterialTexture& texture : material_textures()) {
            TextureRef& t = m.material.*texture.field;
            if (!t) continue;
            const int image = readable.at(t.image);
            if (image == kNone) {
                t = {};
                continue;
            }
            DecodedImage& source = decoded.at(image);
            warn_of_colors(texture.use, source.header, element_name(document, static_cast<std::size_t>(image)),
                           warnings);
            const auto [it, is_new] = place.try_emplace(image, static_cast<int>(images.size()));
            if (is_new) images.push_back(std::move(source.image));
            t.image = it->second;
        }
    }

    std::map<std::pair<int, float>, int> roughness;
    for (GltfMaterial& m : materials) {
        if (!m.glossiness || !m.material.specular_color_texture) continue;
        TextureRef& t = m.material.metallic_roughness_texture = m.material.specular_color_texture;
        const auto [it, is_new] = roughness.try_emplace({t.image, *m.glossiness}, static_cast<int>(images.size()));
        if (is_new) {
            images.push_back(roughness_from(images[static_cast<std::size_t>(t.image)], *m.glossiness));
            if (document.options.mip_levels) add_levels(images.back(), {.data = true});
            if (document.options.textures) document.options.textures->take(images.back());
        }
        t.image = it->second;
        m.material.roughness = 1;
    }
    return images;
}

}  // namespace halflight
