#include "engine/io/webp.h"

#include <webp/decode.h>

#include "engine/core/error.h"

namespace halflight {
namespace {

const std::uint8_t* data(std::string_view bytes) {
    return reinterpret_cast<const std::uint8_t*>(bytes.data());
}

const char* reason(VP8StatusCode status) {
    switch (status) {
        case VP8_STATUS_OUT_OF_MEMORY:
            return "it needs more memory than there is";
        case VP8_STATUS_UNSUPPORTED_FEATURE:
            return "it uses an unsupported feature";
        case VP8_STATUS_NOT_ENOUGH_DATA:
        case VP8_STATUS_SUSPENDED:
            return "the file ends too early";
        default:
            return "its bitstream is damaged";
    }
}

}  // namespace

bool is_webp(std::string_view bytes) {
    return bytes.starts_with("RIFF") && bytes.substr(0, 12).ends_with("WEBP") && bytes.size() >= 12;
}

ImageHeader read_webp_header(const std::string& subject, std::string_view bytes, std::uint64_t file_bytes,
                             int max_side) {
    WebPBitstreamFeatures features;
    const VP8StatusCode status = WebPGetFeatures(data(bytes), bytes.size(), &features);
    if (status != VP8_STATUS_OK) throw Error(subject, "cannot be decoded: {}", reason(status));
    if (features.has_animation) throw Error(subject, "is an animated WebP, which textures cannot use");
    ImageHeader header;
    header.width = static_cast<std::size_t>(features.width);
    header.height = static_cast<std::size_t>(features.height);
    check_image_size(subject, header, file_bytes, max_side);
    // Lossless files, and the alpha of lossy ones, are decoded to 4 bytes per texel before they become RGBA.
    constexpr std::size_t kRows = std::size_t{1} << 20;  // bytes for caches of rows and for code tables, rounded up
    constexpr int kLossy = 1;
    const bool whole = features.format != kLossy || features.has_alpha;
    header.decoding_bytes = kRows + (whole ? 5 * header.width * header.height : 0);
    return header;
}

void read_webp(const std::string& subject, std::string_view bytes, int max_side, TextureImage& image) {
    const ImageHeader header = read_webp_header(subject, bytes, bytes.size(), max_side);
    image.width = static_cast<int>(header.width);
    image.height = static_cast<int>(header.height);
    std::vector<std::uint8_t> rgba(4 * header.width * header.height);
    WebPDecoderConfig config;
    if (!WebPInitDecoderConfig(&config)) throw Error(subject, "cannot be decoded: libwebp has another version");
    config.output.colorspace = MODE_RGBA;
    config.output.is_external_memory = 1;
    config.output.u.RGBA = {rgba.data(), 4 * image.width, rgba.size()};
    const VP8StatusCode status = WebPDecode(data(bytes), bytes.size(), &config);
    WebPFreeDecBuffer(&config.output);
    if (status != VP8_STATUS_OK) throw Error(subject, "cannot be decoded: {}", reason(status));
    image.rgba = std::move(rgba);
}

}  // namespace halflight
