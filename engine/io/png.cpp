#include "engine/io/png.h"

#include <stb/stb_image_write.h>

#include <algorithm>
#include <cmath>

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

}  // namespace halflight
