#include "tools/measure/compare/layers.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <new>

#include "engine/core/error.h"
#include "engine/core/image_tools.h"
#include "engine/core/memory_ledger.h"
#include "engine/io/files.h"
#include "engine/io/jpeg.h"
#include "engine/io/png.h"
#include "engine/io/radiance.h"
#include "engine/io/tiff.h"

namespace halflight::compare {
namespace {

using Strings = std::vector<std::string>;

/// Removes the channels of one layer from `group` and returns them: colour, a vector, or the first one alone.
Strings take_layer(Strings& group) {
    for (const Strings& together : {Strings{"R", "G", "B"}, Strings{"X", "Y", "Z"}, Strings{"X", "Y"}}) {
        const auto in_group = [&](const std::string& c) { return std::ranges::find(group, c) != group.end(); };
        if (!std::ranges::all_of(together, in_group)) continue;
        std::erase_if(group, [&](const std::string& c) { return std::ranges::find(together, c) != together.end(); });
        return together;
    }
    const Strings alone{group.front()};
    group.erase(group.begin());
    return alone;
}

std::string joined(const std::string& prefix, const Strings& channels) {
    std::string name = prefix;
    for (const std::string& channel : channels) name += channel;
    return name;
}

/// Throws Error if an image of this size is larger than the limits of pictures.
void check_pixels(const std::string& subject, std::size_t channels, const ivec2& size) {
    if (const int limit = limits_of_renders().max_side; std::max(size.x, size.y) > limit)
        throw Error(subject, "has windows that span {} x {} pixels, more than the limit of {}", size.x, size.y, limit);
    MemoryLedger::process().check(
        sizeof(float) * channels * static_cast<std::size_t>(size.x) * static_cast<std::size_t>(size.y), subject,
        "pixels");
}

std::vector<Layer> layers_of(const std::string& subject, const ExrFile& file) {
    // Keyed by the name up to and including the last dot, and whether the channels are UINT.
    std::map<std::pair<std::string, bool>, Strings> groups;
    for (const ExrChannel& channel : file.channels) {
        const std::size_t point = channel.name.rfind('.') + 1;
        groups[{channel.name.substr(0, point), channel.type == ExrType::uint32}].push_back(channel.name.substr(point));
    }
    std::vector<Layer> layers;
    for (auto& [key, group] : groups) {
        const auto& [prefix, whole_numbers] = key;
        const bool only = !groups.contains({prefix, !whole_numbers});
        for (bool whole = true; !group.empty(); whole = false) {
            const Strings channels = take_layer(group);
            Layer& layer = layers.emplace_back();
            for (const std::string& channel : channels) layer.channels.push_back(prefix + channel);
            // The only group of a layer has the layer's name.
            const bool named =
                only && whole && group.empty() && !prefix.empty() && (channels.size() > 1 || channels[0] == "Y");
            layer.name = named ? prefix.substr(0, prefix.size() - 1) : joined(prefix, channels);
            const bool ids = whole_numbers || file.is_cryptomatte(prefix);
            const bool color = channels.size() == 3 && channels[0] == "R" && !prefix.starts_with("variance");
            layer.kind = ids ? LayerKind::ids : color ? LayerKind::color : LayerKind::data;
            layer.whole_numbers = whole_numbers;
            const ExrWindow window = file.window_of(layer.channels);  // channels of other parts may have other windows
            check_pixels(subject, layer.channels.size(), window.size);
            layer.image = file.image(layer.channels, window, true);
            layer.origin = window.origin;
        }
    }
    return layers;
}

/// Returns the layers of an image, the last of whose two or four channels is alpha.
std::vector<Layer> layers_of(const Image& image) {
    const bool alpha = image.channels % 2 == 0;
    const auto of = [&](std::string name, Strings channels, LayerKind kind, std::size_t first) {
        Layer layer{std::move(name), std::move(channels), kind, false, {}, ivec2(0)};
        const auto count = layer.channels.size(), stride = static_cast<std::size_t>(image.channels);
        layer.image = Image(image.width, image.height, static_cast<int>(count));
        for (std::size_t i = 0; i < layer.image.pixels.size(); ++i)
            layer.image.pixels[i] = image.pixels[i / count * stride + first + i % count];
        return layer;
    };
    std::vector<Layer> layers;
    if (image.channels > 2)
        layers.push_back(of("RGB", {"R", "G", "B"}, LayerKind::color, 0));
    else
        layers.push_back(of("Y", {"Y"}, LayerKind::color, 0));
    if (alpha) layers.push_back(of("A", {"A"}, LayerKind::data, static_cast<std::size_t>(image.channels) - 1));
    return layers;
}

}  // namespace

const Layer* PictureFile::find(const std::string& layer) const {
    const auto found = std::ranges::find(layers, layer, &Layer::name);
    return found == layers.end() ? nullptr : &*found;
}

std::string align(PictureFile& image, PictureFile& reference) {
    const auto size_of = [](const PictureFile& file) { return ivec2(file.width, file.height); };
    for (auto [file, other] : {std::pair(&image, &reference), std::pair(&reference, &image)}) {
        if (file->display) continue;
        const bool alike = other->display && size_of(*file) == size_of(*other);
        file->display = alike ? *other->display : size_of(*file);
        if (!alike) continue;
        file->origin = other->origin;
        for (Layer& layer : file->layers) layer.origin = other->origin;
    }
    for (PictureFile* file : {&image, &reference}) file->own = {file->origin, size_of(*file)};
    const ivec2 sides = *image.display, others = *reference.display;
    if (sides != others)
        throw SizesDiffer(image.name, "is {} x {} pixels, {} is {} x {}", sides.x, sides.y, reference.name, others.x,
                          others.y);
    std::vector<std::string> windows;
    const auto add = [&](const PictureFile& file, const ivec2& origin, const ivec2& size) {
        const ivec2 end = origin + size;
        std::string phrase =
            fmt::format("{} has the pixels {},{} to {},{}", file.name, origin.x, origin.y, end.x, end.y);
        if (std::ranges::find(windows, phrase) == windows.end()) windows.push_back(std::move(phrase));
    };
    const ivec2 first = glm::min(image.origin, reference.origin);
    const ivec2 size = glm::max(image.origin + size_of(image), reference.origin + size_of(reference)) - first;
    for (PictureFile* file : {&image, &reference}) {
        if (file->origin != first || size_of(*file) != size) add(*file, file->origin, size_of(*file));
        file->origin = first, file->width = size.x, file->height = size.y;
    }
    const auto size_of_layer = [](const Layer& layer) { return ivec2(layer.image.width, layer.image.height); };
    for (Layer& a : image.layers) {
        const auto found = std::ranges::find(reference.layers, a.name, &Layer::name);
        if (found == reference.layers.end()) continue;
        Layer& b = *found;
        const ivec2 start = glm::min(a.origin, b.origin);
        const ivec2 both = glm::max(a.origin + size_of_layer(a), b.origin + size_of_layer(b)) - start;
        for (auto [layer, file] : {std::pair(&a, &image), std::pair(&b, &reference)}) {
            if (layer->origin == start && size_of_layer(*layer) == both) continue;
            add(*file, layer->origin, size_of_layer(*layer));
            check_pixels(file->name, layer->channels.size(), both);
            layer->image = placed(layer->image, layer->origin - start, both);
            layer->origin = start;
        }
    }
    return windows.empty() ? "" : fmt::format("{}; the others count as 0", fmt::join(windows, "; "));
}

PictureFile read_picture(const std::filesystem::path& path) try {
    const ExrLimits limits = limits_of_renders();
    PictureFile file;
    file.name = path.string();
    const std::string bytes = read_file(path, limits.max_bytes);
    if (is_lfs_pointer(bytes)) throw Error(file.name, "is a Git LFS pointer, not the file itself");
    if (is_exr(bytes)) {
        const ExrFile exr = read_exr(path, limits);
        file.width = exr.width, file.height = exr.height;
        file.origin = exr.attributes.origin, file.display = exr.attributes.display;
        file.deep_parts = exr.deep_parts;
        file.primaries = exr.attributes.chromaticities.value_or(kRec709);
        file.layers = layers_of(file.name, exr);
        return file;
    }
    Image image;
    // Decoded values, and floats for them.
    const auto check = [&](const ImageHeader& header) {
        MemoryLedger::process().check(4 * (sizeof(std::uint16_t) + sizeof(float)) * header.width * header.height,
                                      file.name, "pixels");
    };
    if (is_png(bytes)) {
        check(read_png_header(file.name, bytes, bytes.size(), limits.max_side));
        image = read_png(file.name, bytes, limits.max_side);
        file.encoded = true;
    } else if (is_jpeg(bytes)) {
        check(read_jpeg_header(file.name, bytes, bytes.size(), limits.max_side));
        TextureImage decoded;
        read_jpeg(file.name, bytes, limits.max_side, decoded);
        image = Image(decoded.width, decoded.height, 3);
        for (std::size_t i = 0; i < image.pixels.size(); ++i)
            image.pixels[i] = static_cast<float>(decoded.rgba[i / 3 * 4 + i % 3]) / 255.0f;
        file.encoded = true;
    } else if (is_tiff(bytes)) {
        TiffFile tiff = read_tiff(file.name, bytes, limits.max_side);
        image = std::move(tiff.image);
        file.encoded = tiff.type != TiffType::float32;
        if (!file.encoded) file.primaries = tiff.primaries.value_or(kRec709);
    } else if (is_radiance(bytes)) {
        RadiancePicture picture = read_radiance(file.name, bytes, limits);
        image = std::move(picture.image);
        file.primaries = picture.primaries.value_or(kRec709);
    } else {
        throw Error(file.name, "is neither an OpenEXR, a PNG, a JPEG, a TIFF nor a Radiance file");
    }
    file.width = image.width, file.height = image.height;
    file.layers = layers_of(image);
    return file;
} catch (const std::bad_alloc&) {
    throw Error(path.string(), "has more pixels than memory holds");
}

}  // namespace halflight::compare
