#include "engine/io/jpeg.h"

#include <csetjmp>
#include <cstddef>
#include <cstdio>

// jpeglib.h needs the two headers above.
#include <jerror.h>
#include <jpeglib.h>

#include "engine/core/error.h"

namespace halflight {
namespace {

// Maximum number of scans. Encoders use a dozen; each costs a pass over all blocks for a few bytes in the file.
constexpr int kMaxScans = 256;
// Maximum number of pixels per byte: a block of 8 x 8 pixels takes at least one bit.
constexpr std::size_t kPixelsPerByte = 512;

/// Decoder of one file. libjpeg reports errors by calls that must not return, so these jump back to setjmp(). Nothing
/// between setjmp() and the jump may have a destructor.
class Decoder {
  public:
    explicit Decoder(std::string_view bytes) : bytes_(bytes) {
        info_.err = jpeg_std_error(&errors_);
        errors_.error_exit = [](j_common_ptr info) { fail(info); };
        errors_.emit_message = [](j_common_ptr info, int) {
            const int code = info->err->msg_code;  // warnings of other kinds leave the picture whole
            if (code == JWRN_JPEG_EOF || code == JWRN_HIT_MARKER || code == JWRN_HUFF_BAD_CODE) fail(info);
        };
        progress_.progress_monitor = [](j_common_ptr info) {
            if (reinterpret_cast<j_decompress_ptr>(info)->input_scan_number <= kMaxScans) return;
            self(info).message_ = "has too many scans";
            std::longjmp(self(info).back_, 1);
        };
        info_.client_data = this;
    }
    Decoder(const Decoder&) = delete;
    Decoder& operator=(const Decoder&) = delete;
    ~Decoder() { jpeg_destroy_decompress(&info_); }

    /// Returns false after an error; message() tells why.
    bool read_header() {
        if (setjmp(back_)) return false;
        jpeg_create_decompress(&info_);
        info_.progress = &progress_;
        jpeg_mem_src(&info_, reinterpret_cast<const unsigned char*>(bytes_.data()), bytes_.size());
        jpeg_read_header(&info_, TRUE);
        return true;
    }
    bool read_texels(std::uint8_t* rgba) {
        if (setjmp(back_)) return false;
        info_.out_color_space = JCS_EXT_RGBA;
        jpeg_start_decompress(&info_);
        while (info_.output_scanline < info_.output_height) {
            JSAMPROW row = rgba + std::size_t{4} * info_.output_width * info_.output_scanline;
            jpeg_read_scanlines(&info_, &row, 1);
        }
        jpeg_finish_decompress(&info_);
        return true;
    }

    std::size_t width() const { return info_.image_width; }
    std::size_t height() const { return info_.image_height; }
    /// Returns the bytes of the coefficients, which progressive files keep until their last scan.
    std::size_t coefficient_bytes() {
        if (!jpeg_has_multiple_scans(&info_)) return 0;
        std::size_t blocks = 0;
        for (int i = 0; i < info_.num_components; ++i)
            blocks += std::size_t{info_.comp_info[i].width_in_blocks} * info_.comp_info[i].height_in_blocks;
        return blocks * sizeof(JBLOCK);
    }
    const char* message() const { return message_; }

  private:
    static Decoder& self(j_common_ptr info) { return *static_cast<Decoder*>(info->client_data); }
    [[noreturn]] static void fail(j_common_ptr info) {
        static_assert(sizeof message_buffer_ >= JMSG_LENGTH_MAX);
        self(info).message_ = self(info).message_buffer_;
        info->err->format_message(info, self(info).message_buffer_);
        std::longjmp(self(info).back_, 1);
    }

    std::string_view bytes_;
    jpeg_decompress_struct info_{};
    jpeg_error_mgr errors_{};
    jpeg_progress_mgr progress_{};
    std::jmp_buf back_{};
    char message_buffer_[JMSG_LENGTH_MAX] = {};
    const char* message_ = "";
};

/// Reads the header and checks that the picture is within the limit and not larger than the file can hold.
void open(Decoder& decoder, const std::string& subject, std::uint64_t bytes, int max_side) {
    if (!decoder.read_header()) throw Error(subject, "cannot be decoded: {}", decoder.message());
    const std::size_t width = decoder.width(), height = decoder.height(), limit = static_cast<std::size_t>(max_side);
    if (width > limit || height > limit)
        throw Error(subject, "{} x {} texels are more than {} a side", width, height, limit);
    if (width * height / kPixelsPerByte > bytes)
        throw Error(subject, "is truncated: {} bytes cannot hold {} x {} texels", bytes, width, height);
}

}  // namespace

bool is_jpeg(std::string_view bytes) {
    return bytes.starts_with("\xff\xd8\xff");
}

ImageHeader read_jpeg_header(const std::string& subject, std::string_view bytes, std::uint64_t file_bytes,
                             int max_side) {
    Decoder decoder(bytes);
    open(decoder, subject, file_bytes, max_side);
    return {decoder.width(), decoder.height(), decoder.coefficient_bytes()};
}

void read_jpeg(const std::string& subject, std::string_view bytes, int max_side, TextureImage& image) {
    Decoder decoder(bytes);
    open(decoder, subject, bytes.size(), max_side);
    image.width = static_cast<int>(decoder.width());
    image.height = static_cast<int>(decoder.height());
    std::vector<std::uint8_t> rgba(4 * decoder.width() * decoder.height());
    if (!decoder.read_texels(rgba.data())) throw Error(subject, "cannot be decoded: {}", decoder.message());
    image.rgba = std::move(rgba);
}

}  // namespace halflight
