#include <ImfChannelList.h>
#include <ImfChromaticitiesAttribute.h>
#include <ImfFloatAttribute.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfIntAttribute.h>
#include <ImfMatrixAttribute.h>
#include <ImfMultiPartOutputFile.h>
#include <ImfMultiView.h>
#include <ImfName.h>
#include <ImfOutputFile.h>
#include <ImfOutputPart.h>
#include <ImfPartType.h>
#include <ImfStandardAttributes.h>
#include <ImfStringAttribute.h>
#include <ImfTiledOutputFile.h>
#include <ImfTiledOutputPart.h>
#include <fmt/ranges.h>
#include <half.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <ctime>

#include "engine/core/error.h"
#include "engine/core/names.h"
#include "engine/core/suggestion.h"
#include "engine/io/exr.h"
#include "engine/io/exr_common.h"

namespace halflight {
namespace {

Imf::PixelType pixel_type(ExrType type) {
    return type == ExrType::half ? Imf::HALF : type == ExrType::uint32 ? Imf::UINT : Imf::FLOAT;
}

half to_half(float value) {
    if (std::isinf(value)) return half(value);
    return half(std::clamp(value, -float(HALF_MAX), float(HALF_MAX)));  // NaN stays NaN
}

/// Converts a matrix. Two transposes cancel: from column vectors to row vectors, and from GLM's column-major storage to
/// Imath's row-major storage.
Imath::M44f row_vector_form(const dmat4& m) {
    Imath::M44f result;
    for (int i = 0; i < 4; ++i)
        for (int j = 0; j < 4; ++j) result[i][j] = static_cast<float>(m[i][j]);
    return result;
}

Imath::V2f v2f(const glm::dvec2& v) {
    return {static_cast<float>(v.x), static_cast<float>(v.y)};
}

void add_attributes(Imf::Header& header, const ExrAttributes& attributes) {
    if (const auto& c = attributes.chromaticities)
        Imf::addChromaticities(header, {v2f(c->red), v2f(c->green), v2f(c->blue), v2f(c->white)});
    if (attributes.world_to_camera)
        Imf::addWorldToCamera(header, row_vector_form(exr_camera_from_camera() * *attributes.world_to_camera));
    if (attributes.world_to_clip)
        Imf::addWorldToNDC(header, row_vector_form(exr_ndc_from_clip() * *attributes.world_to_clip));
    if (const auto& rate = attributes.frame_rate) Imf::addFramesPerSecond(header, {rate->numerator, rate->denominator});
    if (const auto& t = attributes.time_code)
        Imf::addTimeCode(header, {t->hours, t->minutes, t->seconds, t->frame, false, false, t->second_of_pair});
    if (!attributes.capture_date.empty()) Imf::addCapDate(header, attributes.capture_date);
    if (!attributes.comments.empty()) Imf::addComments(header, attributes.comments);
    if (!attributes.software.empty()) header.insert("software", Imf::StringAttribute(attributes.software));
    for (const auto& [name, value] : attributes.extra) header.insert(name, Imf::StringAttribute(value));
    for (const auto& [name, value] : attributes.numbers) header.insert(name, Imf::FloatAttribute(value));
    for (const auto& [name, value] : attributes.counts) header.insert(name, Imf::IntAttribute(value));
}

/// Returns the compression of a layer. Throws Error if it would change values that must stay exact.
ExrCompression compression_of(const std::string& subject, const ExrLayerView& layer, const ExrLayout& layout) {
    if (!layer.exact || !is_lossy(layout.compression)) return layout.compression;
    if (layout.parts) return ExrCompression::zip;
    throw Error(subject, "compression {} would change data in channel {}, unless layers are parts of their own",
                name(layout.compression), layer.channels.front());
}

/// Returns the layers with the names of their views in those of channels, as files of one part have them.
std::vector<ExrLayerView> with_views(std::span<const ExrLayerView> layers, const ExrAttributes& attributes) {
    std::vector<ExrLayerView> named(layers.begin(), layers.end());
    for (ExrLayerView& layer : named)
        for (std::string& channel : layer.channels)
            if (layer.view >= 0) channel = Imf::insertViewName(channel, attributes.views, layer.view);
    return named;
}

void check_layers(const std::string& subject, std::span<const ExrLayerView> layers) {
    if (layers.empty()) throw Error(subject, "no layers to write");
    const Image& first = layers.front().image;
    if (first.width < 1 || first.height < 1) throw Error(subject, "no pixels to write");
    std::vector<std::string> names;
    for (const ExrLayerView& layer : layers) {
        if (layer.channels.empty() || layer.channels.size() != static_cast<std::size_t>(layer.image.channels))
            throw Error(subject, "layer with {} channel names has an image of {} channels", layer.channels.size(),
                        layer.image.channels);
        if (layer.color != mat3(1) && layer.image.channels < 3)
            throw Error(subject, "channel {} is no colour of three channels", layer.channels.front());
        if (layer.image.width != first.width || layer.image.height != first.height)
            throw Error(subject, "channel {} is {} x {}, but {} is {} x {}", layer.channels.front(), layer.image.width,
                        layer.image.height, layers.front().channels.front(), first.width, first.height);
        names.insert(names.end(), layer.channels.begin(), layer.channels.end());
    }
    for (const std::string& name : names)  // OpenEXR would cut the name
        if (name.size() > Imf::Name::MAX_LENGTH)
            throw Error(subject, "channel {} has a name of more than {} bytes", name, int{Imf::Name::MAX_LENGTH});
    std::sort(names.begin(), names.end());
    const auto twice = std::adjacent_find(names.begin(), names.end());
    if (twice != names.end()) throw Error(subject, "channel {} comes twice", *twice);
}

/// Number of rows that are converted at once: whole blocks of the compression.
constexpr int kRows = 256;

/// Converter of a layer's rows to the types of the file, if the image differs.
class Rows {
  public:
    Rows(const ExrLayerView& layer, const ivec2& origin) : layer_(layer), origin_(origin) {}

    /// Adds the layer's channels to `buffer`, for rows [y, y + rows). The values stay until the next call.
    void prepare(int y, int rows, Imf::FrameBuffer& buffer) {
        const Image& image = layer_.image;
        const auto width = static_cast<std::size_t>(image.width);
        const float* from = image.at(0, y);
        const std::size_t count = width * static_cast<std::size_t>(rows) * layer_.channels.size();
        if (layer_.color != mat3(1)) from = multiplied(from, count);
        const char* base = reinterpret_cast<const char*>(from);
        std::size_t sample = sizeof(float);  // a uint32 has the same size
        if (layer_.type == ExrType::half) {
            halves_.resize(count);
            std::transform(from, from + count, halves_.begin(), to_half);
            base = reinterpret_cast<const char*>(halves_.data());
            sample = sizeof(half);
        }
        const std::size_t pixel = sample * layer_.channels.size();
        for (std::size_t c = 0; c < layer_.channels.size(); ++c)
            buffer.insert(layer_.channels[c],
                          Imf::Slice::Make(pixel_type(layer_.type), base + c * sample, {origin_.x, origin_.y + y},
                                           image.width, rows, pixel, pixel * width));
    }

  private:
    const float* multiplied(const float* from, std::size_t count) {
        colors_.assign(from, from + count);
        for (float* p = colors_.data(); p != colors_.data() + count; p += layer_.channels.size()) {
            const vec3 color = layer_.color * vec3(p[0], p[1], p[2]);
            p[0] = color.x, p[1] = color.y, p[2] = color.z;
        }
        return colors_.data();
    }

    const ExrLayerView& layer_;
    ivec2 origin_;
    std::vector<float> colors_;
    std::vector<half> halves_;
};

constexpr int kLeastTile = 16, kMostTile = 4096;

constexpr Imf::Compression kImfCompressions[] = {Imf::NO_COMPRESSION,   Imf::RLE_COMPRESSION, Imf::ZIPS_COMPRESSION,
                                                 Imf::ZIP_COMPRESSION,  Imf::PIZ_COMPRESSION, Imf::PXR24_COMPRESSION,
                                                 Imf::DWAA_COMPRESSION, Imf::DWAB_COMPRESSION};

/// A part of a file: its header and its layers.
struct Part {
    Imf::Header header;
    std::vector<Rows> layers{};
    int height = 0;

    void add(const ExrLayerView& layer, const ivec2& origin) {
        for (const std::string& channel : layer.channels)
            header.channels().insert(channel, Imf::Channel(pixel_type(layer.type)));
        layers.emplace_back(layer, origin);
        height = layer.image.height;
    }
    /// Returns the buffer of rows [y, y + rows).
    Imf::FrameBuffer rows(int y, int rows) {
        Imf::FrameBuffer buffer;
        for (Rows& layer : layers) layer.prepare(y, rows, buffer);
        return buffer;
    }
};

/// Returns a part without layers. first: its first layer.
Part part_of(const ExrLayerView& first, ExrCompression compression, const ExrAttributes& attributes,
             const ExrLayout& layout) {
    const ivec2 size(first.image.width, first.image.height), display = attributes.display.value_or(size);
    const ivec2 last = attributes.origin + size - 1;
    Part part{.header = Imf::Header(Imath::Box2i({0, 0}, {display.x - 1, display.y - 1}),
                                    Imath::Box2i({attributes.origin.x, attributes.origin.y}, {last.x, last.y}))};
    part.header.compression() = kImfCompressions[static_cast<std::size_t>(compression)];
    part.header.lineOrder() = Imf::INCREASING_Y;
    if (layout.tile > 0) {
        const auto side = static_cast<unsigned>(layout.tile);
        part.header.setTileDescription(Imf::TileDescription(side, side));
    }
    if (layout.parts) {
        const std::string& channel = first.channels.front();
        std::string name = first.name.empty() ? channel.substr(0, channel.find('.')) : first.name;
        if (first.view >= 0) {
            const std::string& view = attributes.views[static_cast<std::size_t>(first.view)];
            name += "." + view;
            part.header.setView(view);
        }
        part.header.setName(name);
        part.header.setType(layout.tile > 0 ? Imf::TILEDIMAGE : Imf::SCANLINEIMAGE);
    }
    add_attributes(part.header, attributes);
    if (!attributes.views.empty() && !layout.parts) Imf::addMultiView(part.header, attributes.views);
    return part;
}

/// Throws Error if two parts have the same name.
void check_names(const std::string& subject, const std::vector<Part>& parts) {
    std::vector<std::string> names;
    for (const Part& part : parts)
        if (part.header.hasName()) names.push_back(part.header.name());
    std::sort(names.begin(), names.end());
    const auto twice = std::adjacent_find(names.begin(), names.end());
    if (twice != names.end()) throw Error(subject, "part {} comes twice", *twice);
}

template <class File>
void write_lines(File&& file, Part& part) {
    for (int y = 0; y < part.height; y += kRows) {
        const int count = std::min(kRows, part.height - y);
        file.setFrameBuffer(part.rows(y, count));
        file.writePixels(count);
    }
}

template <class File>
void write_tiles(File&& file, Part& part, int tile) {
    const int at_once = std::max(kRows / tile, 1);  // rows of tiles
    for (int row = 0; row < file.numYTiles(); row += at_once) {
        const int end = std::min(row + at_once, file.numYTiles());
        file.setFrameBuffer(part.rows(row * tile, std::min(end * tile, part.height) - row * tile));
        file.writeTiles(0, file.numXTiles() - 1, row, end - 1);
    }
}

/// Returns N for N, or N 1000/1001, frames per second; none for other rates.
std::optional<std::uint32_t> nominal_rate(const FrameRate& rate) {
    for (const std::int64_t slower : {1000, 1001}) {
        const std::int64_t numerator = rate.numerator * slower, denominator = rate.denominator * std::int64_t{1000};
        if (numerator % denominator == 0) return static_cast<std::uint32_t>(numerator / denominator);
    }
    return std::nullopt;
}

}  // namespace

std::optional<TimeCode> time_code(const FrameRate& rate, FrameNumber frame) {
    const std::optional<std::uint32_t> nominal = nominal_rate(rate);
    if (!nominal || *nominal > 60 || (*nominal > 30 && *nominal % 2 != 0)) return std::nullopt;
    const FrameNumber together = *nominal > 30 ? 2 : 1, per_second = *nominal / together;
    const FrameNumber day = FrameNumber{24} * 3600 * *nominal;
    const FrameNumber of_day = (frame % day + day) % day;  // frames before 0 are those of the day before
    const FrameNumber count = of_day / together, seconds = count / per_second;
    const auto part = [](FrameNumber value) { return static_cast<int>(value); };
    return TimeCode{part(seconds / 3600), part(seconds / 60 % 60), part(seconds % 60), part(count % per_second),
                    of_day % together == 1};
}

std::string capture_date_now() {
    std::time_t now = std::time(nullptr);
    const char* const epoch = std::getenv("SOURCE_DATE_EPOCH");
    if (epoch) {
        constexpr std::int64_t kEnd = 253'402'300'800;  // year 10000, which the attribute cannot hold
        std::int64_t seconds = -1;
        const std::string_view text = epoch;
        const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), seconds);
        if (error != std::errc() || end != text.data() + text.size() || seconds < 0 || seconds >= kEnd)
            throw Error("SOURCE_DATE_EPOCH", "expects seconds since 1970, not '{}'", text);
        now = static_cast<std::time_t>(seconds);
    }
    std::tm parts{};
    epoch ? gmtime_r(&now, &parts) : localtime_r(&now, &parts);
    char text[32];
    return {text, std::strftime(text, sizeof text, "%Y:%m:%d %H:%M:%S", &parts)};
}

bool date_is_fixed() {
    return std::getenv("SOURCE_DATE_EPOCH") != nullptr;
}

const char* name(ExrCompression compression) {
    constexpr const char* kNames[] = {"none", "rle", "zips", "zip", "piz", "pxr24", "dwaa", "dwab"};
    return name_among(kExrCompressions, kNames, compression);
}

ExrCompression exr_compression_named(const std::string& wanted) {
    std::vector<std::string> names;
    for (const ExrCompression compression : kExrCompressions) names.emplace_back(name(compression));
    const auto found = std::ranges::find(names, wanted);
    if (found == names.end())
        throw Error("OpenEXR compression", "expects {}, not '{}'{}", fmt::join(names, ", "), wanted,
                    did_you_mean(wanted, names));
    return kExrCompressions[found - names.begin()];
}

bool is_lossy(ExrCompression compression) {
    return compression >= ExrCompression::pxr24;
}

ExrCompression lossless(ExrCompression compression) {
    return is_lossy(compression) ? ExrCompression::zip : compression;
}

void write_exr(const std::filesystem::path& path, const std::vector<ExrLayer>& layers, const ExrAttributes& attributes,
               const ExrLayout& layout) {
    std::vector<ExrLayerView> views;
    for (const ExrLayer& layer : layers)
        views.push_back({.channels = layer.channels, .image = layer.image, .type = layer.type, .name = layer.name});
    write_exr_views(path, views, attributes, layout);
}

void write_exr_views(const std::filesystem::path& path, std::span<const ExrLayerView> layers,
                     const ExrAttributes& attributes, const ExrLayout& layout) {
    const std::string subject = path.string();
    const std::vector<ExrLayerView> named = with_views(layers, attributes);
    check_layers(subject, named);
    if (!layout.parts) layers = named;
    if (layout.tile != 0 && (layout.tile < kLeastTile || layout.tile > kMostTile))
        throw Error(subject, "has tiles of {} pixels, not {} to {}", layout.tile, kLeastTile, kMostTile);
    try {
        // Parts of integers come last: Blender 3.4 reads nothing of what follows them.
        std::vector<const ExrLayerView*> in_order;
        for (const ExrLayerView& layer : layers) in_order.push_back(&layer);
        std::stable_partition(in_order.begin(),
                              in_order.end(),  // clang 14 cannot compile std::ranges::stable_partition
                              [](const ExrLayerView* l) { return l->type != ExrType::uint32; });
        std::vector<Part> parts;
        for (const ExrLayerView* const each : in_order) {
            const ExrLayerView& layer = *each;
            const ExrCompression compression = compression_of(subject, layer, layout);
            if (parts.empty() || layout.parts) parts.push_back(part_of(layer, compression, attributes, layout));
            parts.back().add(layer, attributes.origin);
        }
        check_names(subject, parts);
        write_atomically(path, [&](const std::filesystem::path& temporary) {
            ExrOutput stream(temporary, subject);
            if (parts.size() > 1) {
                std::vector<Imf::Header> headers;
                for (const Part& part : parts) headers.push_back(part.header);
                Imf::MultiPartOutputFile file(stream, headers.data(), static_cast<int>(headers.size()), false,
                                              exr_threads());
                for (int i = 0; i < file.parts(); ++i) {
                    Part& part = parts[static_cast<std::size_t>(i)];
                    if (layout.tile > 0)
                        write_tiles(Imf::TiledOutputPart(file, i), part, layout.tile);
                    else
                        write_lines(Imf::OutputPart(file, i), part);
                }
            } else if (layout.tile > 0) {
                write_tiles(Imf::TiledOutputFile(stream, parts[0].header, exr_threads()), parts[0], layout.tile);
            } else {
                write_lines(Imf::OutputFile(stream, parts[0].header, exr_threads()), parts[0]);
            }  // destructors write the table of lines
            stream.close();
        });
    } catch (const Error&) {
        throw;
    } catch (const std::exception& e) {
        throw Error(subject, "cannot write OpenEXR: {}", e.what());
    }
}

}  // namespace halflight
