#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <vector>

#include "engine/core/error.h"
#include "engine/io/png.h"
#include "engine/io/png_errors.h"

namespace halflight {
namespace {

// Maximum texels per byte: one-bit texels at the maximum compression (1032:1, zlib's technical details).
constexpr std::size_t kTexelsPerByte = 8 * 1032;

class Decoder : public PngErrors {
  public:
    /// Prepares decoding to RGBA of 8 or 16 bits if `rgba` is set, else to 16 bits with the channels of the file.
    Decoder(std::string_view bytes, bool rgba)
        : rest_(bytes),
          rgba_(rgba),
          png_(png_create_read_struct(PNG_LIBPNG_VER_STRING, errors(), fail, ignore)),
          info_(png_create_info_struct(png_)) {
        if (!info_) throw std::bad_alloc();
    }
    ~Decoder() { png_destroy_read_struct(&png_, &info_, nullptr); }

    /// Returns false after an error; message() tells why.
    bool read_header() {
        if (setjmp(png_jmpbuf(png_))) return false;
        png_set_read_fn(png_, this, [](png_structp png, png_bytep out, std::size_t count) {
            std::string_view& rest = static_cast<Decoder*>(png_get_io_ptr(png))->rest_;
            if (count > rest.size()) png_error(png, "the file ends too early");
            std::memcpy(out, rest.data(), count);
            rest.remove_prefix(count);
        });
        // Profiles and text are skipped; they could decompress to any size.
        png_set_keep_unknown_chunks(png_, PNG_HANDLE_CHUNK_NEVER, nullptr, -1);
        png_read_info(png_, info_);
        png_set_expand(png_);
        if (rgba_) {
            png_set_gray_to_rgb(png_);
            png_set_add_alpha(png_, deep() ? 65535 : 255, PNG_FILLER_AFTER);
        } else {
            png_set_expand_16(png_);
            if (std::endian::native == std::endian::little) png_set_swap(png_);
        }
        png_set_interlace_handling(png_);
        png_read_update_info(png_, info_);
        return true;
    }
    bool read_rows(png_bytepp rows) {
        if (setjmp(png_jmpbuf(png_))) return false;
        png_read_image(png_, rows);
        png_read_end(png_, nullptr);
        return true;
    }

    std::size_t width() const { return png_get_image_width(png_, info_); }
    std::size_t height() const { return png_get_image_height(png_, info_); }
    bool deep() const { return png_get_bit_depth(png_, info_) == 16; }
    std::size_t channels() const { return png_get_channels(png_, info_); }

  private:
    std::string_view rest_;
    bool rgba_;
    png_structp png_;
    png_infop info_;
};

/// Reads the header and checks that the picture is within the limit and not larger than the file can hold.
void open(Decoder& decoder, const std::string& subject, std::uint64_t bytes, int max_side) {
    if (!decoder.read_header()) throw Error(subject, "cannot be decoded: {}", decoder.message());
    const std::size_t width = decoder.width(), height = decoder.height(), limit = static_cast<std::size_t>(max_side);
    if (width > limit || height > limit)
        throw Error(subject, "{} x {} texels are more than {} a side", width, height, limit);
    if (width * height / kTexelsPerByte > bytes)
        throw Error(subject, "is truncated: {} bytes cannot hold {} x {} texels", bytes, width, height);
}

/// Reads width x height x channels numbers into `values`, or bytes if they have 16 bits.
template <class T>
void read(Decoder& decoder, const std::string& subject, std::vector<T>& values) {
    const std::size_t row = decoder.channels() * decoder.width() * (decoder.deep() && sizeof(T) == 1 ? 2 : 1);
    values.resize(row * decoder.height());
    std::vector<png_bytep> rows(decoder.height());
    for (std::size_t y = 0; y < rows.size(); ++y) rows[y] = reinterpret_cast<png_bytep>(values.data() + row * y);
    if (!decoder.read_rows(rows.data())) throw Error(subject, "cannot be decoded: {}", decoder.message());
}

/// Sorts texels of 16 bits, whose values have the high byte first, as TextureImage has them. If all values are
/// multiples of 257, as of pictures that had 8 bits before, the high bytes alone stay.
void split(std::vector<std::uint8_t>& rgba, bool& deep) {
    deep = false;
    for (std::size_t i = 0; i < rgba.size() && !deep; i += 2) deep = rgba[i] != rgba[i + 1];
    for (std::size_t i = 0; i < rgba.size(); i += 8) {
        std::array<std::uint8_t, 8> from;
        std::memcpy(from.data(), &rgba[i], from.size());
        std::uint8_t* const to = &rgba[deep ? i : i / 2];
        for (std::size_t c = 0; c < 4; ++c) {
            to[c] = from[2 * c];
            if (deep) to[c + 4] = from[2 * c + 1];
        }
    }
    if (deep) return;
    rgba.resize(rgba.size() / 2);
    rgba.shrink_to_fit();
}

}  // namespace

bool is_png(std::string_view bytes) {
    return bytes.starts_with("\x89PNG\r\n\x1a\n");
}

ImageHeader read_png_header(const std::string& subject, std::string_view bytes, std::uint64_t file_bytes,
                            int max_side) {
    Decoder decoder(bytes, true);
    open(decoder, subject, file_bytes, max_side);
    ImageHeader header{.width = decoder.width(), .height = decoder.height(), .deep = decoder.deep()};
    // Texels of 16 bits whose low bytes say nothing are copied to 8 bits.
    if (header.deep) header.decoding_bytes = std::size_t{4} * header.width * header.height;
    return header;
}

void read_png(const std::string& subject, std::string_view bytes, int max_side, TextureImage& image) {
    Decoder decoder(bytes, true);
    open(decoder, subject, bytes.size(), max_side);
    image.width = static_cast<int>(decoder.width());
    image.height = static_cast<int>(decoder.height());
    std::vector<std::uint8_t> rgba;
    read(decoder, subject, rgba);
    if (decoder.deep()) split(rgba, image.deep);
    image.rgba = std::move(rgba);
}

Image read_png(const std::string& subject, std::string_view bytes, int max_side) {
    Decoder decoder(bytes, false);
    open(decoder, subject, bytes.size(), max_side);
    std::vector<std::uint16_t> values;
    read(decoder, subject, values);
    Image image(static_cast<int>(decoder.width()), static_cast<int>(decoder.height()),
                static_cast<int>(decoder.channels()));
    std::ranges::transform(values, image.pixels.begin(),
                           [](std::uint16_t v) { return static_cast<float>(v) / 65535.0f; });  // 8 bits give v * 257
    return image;
}

std::string text_of_png(std::string_view png, std::string_view keyword) {
    constexpr std::size_t kSignature = 8;
    constexpr std::size_t kFrame = 12;  // bytes: length, type and checksum of a chunk
    const auto length_at = [&](std::size_t at) {
        std::size_t value = 0;
        for (const char c : png.substr(at, 4)) value = value << 8 | static_cast<unsigned char>(c);
        return value;
    };
    for (std::size_t at = kSignature; at + kFrame <= png.size();) {
        const std::size_t length = length_at(at);
        if (length > png.size() - at - kFrame) break;
        const std::string_view type = png.substr(at + 4, 4), body = png.substr(at + 8, length);
        const std::size_t end = body.find('\0');
        if (type == "tEXt" && end != std::string_view::npos && body.substr(0, end) == keyword)
            return std::string(body.substr(end + 1));
        at += kFrame + length;
    }
    return "";
}

}  // namespace halflight
