#include "engine/io/png.h"

#include <algorithm>
#include <cmath>

#include "engine/core/error.h"
#include "engine/io/files.h"
#include "engine/io/png_errors.h"

namespace halflight {
namespace {

constexpr int kColorTypes[] = {PNG_COLOR_TYPE_GRAY, PNG_COLOR_TYPE_GRAY_ALPHA, PNG_COLOR_TYPE_RGB,
                               PNG_COLOR_TYPE_RGB_ALPHA};  // indexed by channels - 1

class Encoder : public PngErrors {
  public:
    Encoder()
        : png_(png_create_write_struct(PNG_LIBPNG_VER_STRING, errors(), fail, ignore)),
          info_(png_create_info_struct(png_)) {
        if (!info_) throw std::bad_alloc();
    }
    ~Encoder() { png_destroy_write_struct(&png_, &info_); }

    /// Writes rows of bytes; 16 bits have the high byte first. Returns false after an error; message() tells why.
    bool write(int width, int height, int channels, const std::uint8_t* bytes, const PngOptions& options,
               const std::string& profile, png_textp text) {
        if (setjmp(png_jmpbuf(png_))) return false;
        png_set_write_fn(png_, this, append, nullptr);
        png_set_IHDR(png_, info_, static_cast<png_uint_32>(width), static_cast<png_uint_32>(height), options.bits,
                     kColorTypes[channels - 1], PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT,
                     PNG_FILTER_TYPE_DEFAULT);
        if (text != nullptr) png_set_text(png_, info_, text, 1);
        if (!profile.empty())
            png_set_iCCP(png_, info_, "display", PNG_COMPRESSION_TYPE_BASE,
                         reinterpret_cast<png_const_bytep>(profile.data()), static_cast<png_uint_32>(profile.size()));
        png_write_info_before_PLTE(png_, info_);
        if (options.encoding && options.encoding->exact()) {
            const png_byte code[] = {options.encoding->primaries, static_cast<png_byte>(options.encoding->curve), 0, 1};
            png_write_chunk(png_, reinterpret_cast<png_const_bytep>("cICP"), code, sizeof(code));
        }
        png_write_info(png_, info_);
        const std::size_t row = static_cast<std::size_t>(width) * static_cast<std::size_t>(channels * options.bits / 8);
        for (int y = 0; y < height; ++y) png_write_row(png_, bytes + row * static_cast<std::size_t>(y));
        png_write_end(png_, nullptr);
        return true;
    }

    std::string take() { return std::move(file_); }

  private:
    /// Appends bytes. No exception may pass through libpng, and no jump may leave one behind.
    static void append(png_structp png, png_bytep data, std::size_t count) {
        bool done = true;
        try {
            static_cast<Encoder*>(png_get_io_ptr(png))->file_.append(reinterpret_cast<const char*>(data), count);
        } catch (const std::exception&) {
            done = false;
        }
        if (!done) png_error(png, "not enough memory");
    }

    std::string file_;
    png_structp png_;
    png_infop info_;
};

}  // namespace

std::uint8_t quantize_8bit(float value) {
    if (std::isnan(value)) return 0;
    return static_cast<std::uint8_t>(std::lround(std::clamp(value, 0.0f, 1.0f) * 255.0f));
}

std::uint16_t quantize_16bit(float value) {
    if (std::isnan(value)) return 0;
    return static_cast<std::uint16_t>(std::lround(std::clamp(value, 0.0f, 1.0f) * 65535.0f));
}

std::vector<std::uint8_t> quantize_8bit(const Image& image) {
    std::vector<std::uint8_t> bytes(image.pixels.size());
    std::transform(image.pixels.begin(), image.pixels.end(), bytes.begin(), [](float v) { return quantize_8bit(v); });
    return bytes;
}

namespace {

std::string encode(const std::string& subject, int width, int height, int channels,
                   const std::vector<std::uint8_t>& bytes, const PngOptions& options) {
    if (width < 1 || height < 1) throw Error(subject, "no pixels to write");
    if (channels < 1 || channels > 4 ||
        bytes.size() != static_cast<std::size_t>(width) * static_cast<std::size_t>(height) *
                            static_cast<std::size_t>(channels * options.bits / 8))
        throw Error(subject, "{} bytes are no image of {} x {} x {}", bytes.size(), width, height, channels);
    Encoder encoder;
    const std::string profile = options.encoding ? icc_profile(*options.encoding) : "";
    std::string keyword = options.text.keyword, value = options.text.text;
    ::png_text chunk{};
    chunk.compression = PNG_TEXT_COMPRESSION_NONE;
    chunk.key = keyword.data(), chunk.text = value.data(), chunk.text_length = value.size();
    if (!encoder.write(width, height, channels, bytes.data(), options, profile, keyword.empty() ? nullptr : &chunk))
        throw Error(subject, "cannot be written as PNG of {} x {} pixels: {}", width, height, encoder.message());
    return encoder.take();
}

}  // namespace

std::string encode_png(const std::string& subject, const Image& image, const PngOptions& options) {
    std::vector<std::uint8_t> bytes;
    if (options.bits == 8) {
        bytes = quantize_8bit(image);
    } else {
        bytes.reserve(2 * image.pixels.size());
        for (const float value : image.pixels) {
            const std::uint16_t level = quantize_16bit(value);
            bytes.push_back(static_cast<std::uint8_t>(level >> 8));
            bytes.push_back(static_cast<std::uint8_t>(level & 0xff));
        }
    }
    return encode(subject, image.width, image.height, image.channels, bytes, options);
}

std::string encode_png(const std::string& subject, int width, int height, int channels,
                       const std::vector<std::uint8_t>& bytes, const PngText& text) {
    return encode(subject, width, height, channels, bytes, {.text = text});
}

void write_png(const std::filesystem::path& path, int width, int height, int channels,
               const std::vector<std::uint8_t>& bytes) {
    write_file(path, encode_png(path.string(), width, height, channels, bytes));
}

void write_png(const std::filesystem::path& path, const Image& image) {
    write_png(path, image.width, image.height, image.channels, quantize_8bit(image));
}

}  // namespace halflight
