#include <ImfChannelList.h>
#include <ImfChromaticitiesAttribute.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfMatrixAttribute.h>
#include <ImfOutputFile.h>
#include <ImfStandardAttributes.h>
#include <ImfStringAttribute.h>
#include <half.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <ctime>

#include "engine/core/error.h"
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
    std::sort(names.begin(), names.end());
    const auto twice = std::adjacent_find(names.begin(), names.end());
    if (twice != names.end()) throw Error(subject, "channel {} comes twice", *twice);
}

/// Number of rows that are converted at once: whole blocks of the compression.
constexpr int kRows = 256;

/// Converter of a layer's rows to the types of the file, where the image differs.
class Rows {
  public:
    explicit Rows(const ExrLayerView& layer) : layer_(layer) {}

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
            buffer.insert(layer_.channels[c], Imf::Slice::Make(pixel_type(layer_.type), base + c * sample, {0, y},
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
    std::vector<float> colors_;
    std::vector<half> halves_;
};

/// Returns N for N, or N 1000/1001, frames per second; none for other rates.
std::optional<std::uint32_t> nominal_rate(const FrameRate& rate) {
    for (const std::int64_t slower : {1000, 1001}) {
        const std::int64_t numerator = rate.numerator * slower, denominator = rate.denominator * std::int64_t{1000};
        if (numerator % denominator == 0) return static_cast<std::uint32_t>(numerator / denominator);
    }
    return std::nullopt;
}

}  // namespace

std::optional<TimeCode> time_code(const FrameRate& rate, std::uint32_t frame) {
    const std::optional<std::uint32_t> nominal = nominal_rate(rate);
    if (!nominal || *nominal > 60 || (*nominal > 30 && *nominal % 2 != 0)) return std::nullopt;
    const std::uint32_t together = *nominal > 30 ? 2 : 1, per_second = *nominal / together;
    const std::uint32_t count = frame / together, seconds = count / per_second;
    const auto part = [](std::uint32_t value) { return static_cast<int>(value); };
    return TimeCode{part(seconds / 3600 % 24), part(seconds / 60 % 60), part(seconds % 60), part(count % per_second),
                    frame % together == 1};
}

std::string capture_date_now() {
    std::time_t now = std::time(nullptr);
    const char* const epoch = std::getenv("SOURCE_DATE_EPOCH");
    if (epoch) now = static_cast<std::time_t>(std::strtoll(epoch, nullptr, 10));
    std::tm parts{};
    epoch ? gmtime_r(&now, &parts) : localtime_r(&now, &parts);
    char text[32];
    return {text, std::strftime(text, sizeof text, "%Y:%m:%d %H:%M:%S", &parts)};
}

void write_exr(const std::filesystem::path& path, const std::vector<ExrLayer>& layers,
               const ExrAttributes& attributes) {
    std::vector<ExrLayerView> views;
    for (const ExrLayer& layer : layers) views.push_back({layer.channels, layer.image, layer.type});
    write_exr_views(path, views, attributes);
}

void write_exr_views(const std::filesystem::path& path, std::span<const ExrLayerView> layers,
                     const ExrAttributes& attributes) {
    const std::string subject = path.string();
    check_layers(subject, layers);
    const int width = layers.front().image.width;
    const int height = layers.front().image.height;
    try {
        Imf::Header header(width, height);
        header.compression() = Imf::ZIP_COMPRESSION;
        header.lineOrder() = Imf::INCREASING_Y;
        add_attributes(header, attributes);
        for (const ExrLayerView& layer : layers)
            for (const std::string& name : layer.channels)
                header.channels().insert(name, Imf::Channel(pixel_type(layer.type)));
        std::vector<Rows> rows(layers.begin(), layers.end());
        write_atomically(path, [&](const std::filesystem::path& temporary) {
            ExrOutput stream(temporary, subject);
            {
                Imf::OutputFile file(stream, header, exr_threads());
                for (int y = 0; y < height; y += kRows) {
                    const int count = std::min(kRows, height - y);
                    Imf::FrameBuffer buffer;
                    for (Rows& of_layer : rows) of_layer.prepare(y, count, buffer);
                    file.setFrameBuffer(buffer);
                    file.writePixels(count);
                }
            }  // the destructor writes the table of lines
            stream.close();
        });
    } catch (const Error&) {
        throw;
    } catch (const std::exception& e) {
        throw Error(subject, "cannot write OpenEXR: {}", e.what());
    }
}

}  // namespace halflight
