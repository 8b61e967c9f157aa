#include "engine/io/png.h"

#include <stb/stb_image.h>
#include <stb/stb_image_write.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "engine/core/error.h"
#include "engine/io/files.h"

namespace halflight {
namespace {

constexpr std::size_t kLargest = std::size_t{1} << 30;  // bytes: the encoder counts in int, also what it adds

}  // namespace

std::uint8_t quantize_8bit(float value) {
    if (std::isnan(value)) return 0;
    return static_cast<std::uint8_t>(std::lround(std::clamp(value, 0.0f, 1.0f) * 255.0f));
}

std::vector<std::uint8_t> quantize_8bit(const Image& image) {
    std::vector<std::uint8_t> bytes(image.pixels.size());
    std::transform(image.pixels.begin(), image.pixels.end(), bytes.begin(), [](float v) { return quantize_8bit(v); });
    return bytes;
}

std::string encode_png(const std::string& subject, int width, int height, int channels,
                       const std::vector<std::uint8_t>& bytes) {
    if (width < 1 || height < 1) throw Error(subject, "no pixels to write");
    if (channels < 1 || channels > 4 ||
        bytes.size() !=
            static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * static_cast<std::size_t>(channels))
        throw Error(subject, "{} bytes are no image of {} x {} x {}", bytes.size(), width, height, channels);
    if (bytes.size() > kLargest) throw Error(subject, "{} x {} pixels are too many for a PNG", width, height);
    std::string file;
    const auto append = [](void* out, void* data, int size) {
        static_cast<std::string*>(out)->append(static_cast<const char*>(data), static_cast<std::size_t>(size));
    };
    if (!stbi_write_png_to_func(append, &file, width, height, channels, bytes.data(), width * channels))
        throw Error(subject, "cannot compress {} x {} pixels", width, height);
    return file;
}

void write_png(const std::filesystem::path& path, int width, int height, int channels,
               const std::vector<std::uint8_t>& bytes) {
    write_file(path, encode_png(path.string(), width, height, channels, bytes));
}

void write_png(const std::filesystem::path& path, const Image& image) {
    write_png(path, image.width, image.height, image.channels, quantize_8bit(image));
}

bool is_png(std::string_view bytes) {
    return bytes.starts_with("\x89PNG\r\n\x1a\n");
}

Image read_png(const std::string& subject, std::string_view bytes, int max_side) {
    if (!is_png(bytes)) throw Error(subject, "is no PNG file");
    if (bytes.size() > kLargest) throw Error(subject, "is larger than a gigabyte");
    const auto* data = reinterpret_cast<const stbi_uc*>(bytes.data());
    const int size = static_cast<int>(bytes.size());
    Image image;
    if (!stbi_info_from_memory(data, size, &image.width, &image.height, &image.channels))
        throw Error(subject, "cannot be decoded: {}", stbi_failure_reason());
    if (image.width > max_side || image.height > max_side)
        throw Error(subject, "{} x {} pixels are more than {} a side", image.width, image.height, max_side);
    const std::unique_ptr<stbi_us, decltype(&stbi_image_free)> values(
        stbi_load_16_from_memory(data, size, &image.width, &image.height, &image.channels, 0), stbi_image_free);
    if (!values) throw Error(subject, "cannot be decoded: {}", stbi_failure_reason());
    image = Image(image.width, image.height, image.channels);
    std::transform(values.get(), values.get() + image.pixels.size(), image.pixels.begin(),
                   [](stbi_us v) { return static_cast<float>(v) / 65535.0f; });  // 8 bits come as v * 257
    return image;
}

}  // namespace halflight
