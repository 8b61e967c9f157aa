#include <csetjmp>
#include <cstddef>
#include <cstdio>
#include <new>
#include <utility>

// jpeglib.h needs the headers above.
#include <jerror.h>
#include <jpeglib.h>

#include "engine/core/error.h"
#include "engine/io/jpeg.h"

namespace halflight {
namespace {

/// Encoder of one file. libjpeg reports errors by calls that must not return, so these jump back to setjmp(). Nothing
/// between setjmp() and the jump may have a destructor.
class Encoder {
  public:
    Encoder() {
        info_.err = jpeg_std_error(&errors_);
        errors_.error_exit = [](j_common_ptr info) {
            Encoder& self = *static_cast<Encoder*>(info->client_data);
            info->err->format_message(info, self.message_);
            std::longjmp(self.back_, 1);
        };
        errors_.emit_message = [](j_common_ptr, int) {};
        info_.client_data = this;
        destination_.init_destination = [](j_compress_ptr info) { of(info).restart(); };
        destination_.empty_output_buffer = [](j_compress_ptr info) {
            keep(info, kPiece);
            of(info).restart();
            return boolean(TRUE);
        };
        destination_.term_destination = [](j_compress_ptr info) { keep(info, kPiece - info->dest->free_in_buffer); };
    }
    Encoder(const Encoder&) = delete;
    Encoder& operator=(const Encoder&) = delete;
    ~Encoder() { jpeg_destroy_compress(&info_); }

    /// Returns false after an error; message() tells why.
    bool write(int width, int height, const std::uint8_t* rgb, int quality, std::string_view comment,
               std::string_view profile) {
        if (setjmp(back_)) return false;
        jpeg_create_compress(&info_);
        info_.dest = &destination_;
        info_.image_width = static_cast<JDIMENSION>(width), info_.image_height = static_cast<JDIMENSION>(height);
        info_.input_components = 3, info_.in_color_space = JCS_RGB;
        jpeg_set_defaults(&info_);
        jpeg_set_quality(&info_, quality, TRUE);
        info_.optimize_coding = TRUE;
        for (int i = 0; i < info_.num_components; ++i)  // chroma has the resolution of luma
            info_.comp_info[i].h_samp_factor = info_.comp_info[i].v_samp_factor = 1;
        jpeg_start_compress(&info_, TRUE);
        if (!profile.empty())
            jpeg_write_icc_profile(&info_, reinterpret_cast<const JOCTET*>(profile.data()),
                                   static_cast<unsigned int>(profile.size()));
        if (!comment.empty())
            jpeg_write_marker(&info_, JPEG_COM, reinterpret_cast<const JOCTET*>(comment.data()),
                              static_cast<unsigned int>(comment.size()));
        while (info_.next_scanline < info_.image_height) {
            auto* row = const_cast<JSAMPLE*>(rgb + std::size_t{3} * info_.image_width * info_.next_scanline);
            jpeg_write_scanlines(&info_, &row, 1);
        }
        jpeg_finish_compress(&info_);
        return true;
    }

    std::string take() { return std::move(bytes_); }
    const char* message() const { return message_; }

  private:
    static constexpr std::size_t kPiece = std::size_t{1} << 16;  // bytes

    static Encoder& of(j_compress_ptr info) { return *static_cast<Encoder*>(info->client_data); }
    void restart() {
        destination_.next_output_byte = piece_;
        destination_.free_in_buffer = kPiece;
    }
    /// Appends bytes of `piece_`. No exception may leave it, since libjpeg is C.
    static void keep(j_compress_ptr info, std::size_t count) {
        bool kept = true;
        try {
            of(info).bytes_.append(reinterpret_cast<const char*>(of(info).piece_), count);
        } catch (const std::bad_alloc&) {
            kept = false;
        }
        if (!kept) ERREXIT1(info, JERR_OUT_OF_MEMORY, 0);
    }

    jpeg_compress_struct info_{};
    jpeg_error_mgr errors_{};
    std::jmp_buf back_{};
    jpeg_destination_mgr destination_{};
    JOCTET piece_[kPiece];
    std::string bytes_;
    char message_[JMSG_LENGTH_MAX] = {};
};

}  // namespace

static_assert(kMostJpegSide == JPEG_MAX_DIMENSION);

std::string encode_jpeg(const std::string& subject, int width, int height, const std::vector<std::uint8_t>& rgb,
                        int quality, std::string_view comment, std::string_view profile) {
    if (width < 1 || height < 1) throw Error(subject, "no pixels to write");
    if (rgb.size() != std::size_t{3} * static_cast<std::size_t>(width) * static_cast<std::size_t>(height))
        throw Error(subject, "{} bytes are no image of {} x {} x 3", rgb.size(), width, height);
    Encoder encoder;
    if (!encoder.write(width, height, rgb.data(), quality, comment, profile))
        throw Error(subject, "cannot be written as JPEG of {} x {} pixels: {}", width, height, encoder.message());
    return encoder.take();
}

std::string comment_of_jpeg(std::string_view bytes) {
    constexpr unsigned char kScan = 0xda;
    const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(bytes[i]); };
    // Segments before the first scan: 0xff, kind, and a length that includes its own two bytes.
    for (std::size_t at = 2; at + 4 <= bytes.size() && byte(at) == 0xff && byte(at + 1) != kScan;) {
        const std::size_t length = 256u * byte(at + 2) + byte(at + 3);
        if (length < 2 || at + 2 + length > bytes.size()) break;
        if (byte(at + 1) == JPEG_COM) return std::string(bytes.substr(at + 4, length - 2));
        at += 2 + length;
    }
    return "";
}

}  // namespace halflight
