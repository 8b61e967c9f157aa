// Tests PNG files: compatibility with libpng, pixel formats, rounding, failures.
#include <gtest/gtest.h>
#include <png.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <limits>

#include "engine/core/error.h"
#include "engine/io/files.h"
#include "engine/io/png.h"
#include "tests/support/error_message.h"

namespace halflight {
namespace {

namespace fs = std::filesystem;

fs::path temporary(const char* name) {
    return fs::path(testing::TempDir()) / fmt::format("halflight-{}-{}", getpid(), name);
}

TEST(Png, RoundTripOfEveryChannelCount) {
    const fs::path path = temporary("round.png");
    constexpr int kWidth = 37, kHeight = 23;
    for (int channels = 1; channels <= 4; ++channels) {
        std::vector<std::uint8_t> bytes(static_cast<std::size_t>(kWidth * kHeight * channels));
        for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<std::uint8_t>(i * i + 7 * i);
        write_png(path, kWidth, kHeight, channels, bytes);
        const std::string file = read_file(path, 1 << 20);
        TextureImage read;
        read_png("round.png", file, 37, read);
        ASSERT_EQ(read.width, kWidth);
        ASSERT_EQ(read.height, kHeight);
        const int colors = channels < 3 ? 1 : 3;
        for (std::size_t i = 0; i < read.rgba.size(); ++i) {
            const std::size_t pixel = i / 4, c = i % 4;
            const bool stored = c < 3 || colors < channels;
            const std::size_t channel = c < 3 ? std::min<std::size_t>(c, static_cast<std::size_t>(colors) - 1)
                                              : static_cast<std::size_t>(colors);
            const int expected = stored ? bytes[pixel * static_cast<std::size_t>(channels) + channel] : 255;
            ASSERT_EQ(read.rgba[i], expected) << channels << " channels, byte " << i;
        }
        write_png(path, kWidth, kHeight, channels, bytes);
        EXPECT_EQ(read_file(path, 1 << 20), file) << "the same bytes give the same file";
    }
    fs::remove(path);
}

TEST(Png, ReadsWhatItWrote) {
    const fs::path path = temporary("read.png");
    for (int channels = 1; channels <= 4; ++channels) {
        Image image(5, 3, channels);
        for (std::size_t i = 0; i < image.pixels.size(); ++i) image.pixels[i] = static_cast<float>(i % 256) / 255;
        write_png(path, image);
        const Image read = read_png("read.png", read_file(path, 1 << 20), 16);
        EXPECT_EQ(read.width, 5);
        EXPECT_EQ(read.height, 3);
        EXPECT_EQ(read.channels, channels);
        EXPECT_EQ(read.pixels, image.pixels);
    }
    const std::string file = read_file(path, 1 << 20);
    EXPECT_THROW(read_png("read.png", file, 4), Error);
    EXPECT_THROW(read_png("read.png", file.substr(0, file.size() / 2), 16), Error);
    EXPECT_THROW(read_png("read.png", "no picture", 16), Error);
    fs::remove(path);
}

struct Kind {
    int depth;
    int color_type;
    int interlace = PNG_INTERLACE_NONE;
};

/// Encodes rows without a conversion.
std::string encode(int side, const Kind& kind, std::vector<std::vector<std::uint8_t>> rows) {
    png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
    png_infop info = png_create_info_struct(png);
    std::string bytes;
    const auto write = [](png_structp self, png_bytep data, std::size_t size) {
        static_cast<std::string*>(png_get_io_ptr(self))->append(reinterpret_cast<const char*>(data), size);
    };
    png_set_write_fn(png, &bytes, write, nullptr);
    const auto pixels = static_cast<png_uint_32>(side);
    png_set_IHDR(png, info, pixels, pixels, kind.depth, kind.color_type, kind.interlace, PNG_COMPRESSION_TYPE_DEFAULT,
                 PNG_FILTER_TYPE_DEFAULT);
    png_set_gAMA(png, info, 0.2);  // the reader must ignore gamma
    if (kind.color_type == PNG_COLOR_TYPE_PALETTE) {
        const png_color palette[] = {{1, 2, 3}, {4, 5, 6}};
        const png_byte alpha[] = {128};
        png_set_PLTE(png, info, palette, 2);
        png_set_tRNS(png, info, alpha, 1, nullptr);
    }
    std::vector<png_bytep> pointers;
    for (auto& row : rows) pointers.push_back(row.data());
    png_set_rows(png, info, pointers.data());
    png_write_png(png, info, PNG_TRANSFORM_IDENTITY, nullptr);
    png_destroy_write_struct(&png, &info);
    return bytes;
}

std::vector<std::uint8_t> decode(const std::string& bytes) {
    TextureImage image;
    read_png("a.png", bytes, 16384, image);
    return image.rgba;
}

TEST(Png, EveryPixelFormatIsRead) {
    using Bytes = std::vector<std::uint8_t>;
    EXPECT_EQ(decode(encode(2, {1, PNG_COLOR_TYPE_GRAY}, {{0x40}, {0x80}})),
              (Bytes{0, 0, 0, 255, 255, 255, 255, 255, 255, 255, 255, 255, 0, 0, 0, 255}));
    EXPECT_EQ(decode(encode(1, {16, PNG_COLOR_TYPE_GRAY}, {{0x7e, 0xff}})), (Bytes{0x7f, 0x7f, 0x7f, 255}));
    EXPECT_EQ(decode(encode(1, {16, PNG_COLOR_TYPE_RGB_ALPHA}, {{1, 255, 2, 255, 3, 255, 4, 255}})),
              (Bytes{2, 3, 4, 5}));  // 16 bits are rounded to 8
    EXPECT_EQ(decode(encode(2, {2, PNG_COLOR_TYPE_PALETTE}, {{0x10}, {0x40}})),
              (Bytes{1, 2, 3, 128, 4, 5, 6, 255, 4, 5, 6, 255, 1, 2, 3, 128}));
    EXPECT_EQ(
        decode(encode(2, {8, PNG_COLOR_TYPE_RGB, PNG_INTERLACE_ADAM7}, {{1, 2, 3, 4, 5, 6}, {7, 8, 9, 10, 11, 12}})),
        (Bytes{1, 2, 3, 255, 4, 5, 6, 255, 7, 8, 9, 255, 10, 11, 12, 255}));
}

TEST(Png, EveryTruncationIsAnError) {
    const std::string bytes = encode(3, {8, PNG_COLOR_TYPE_GRAY}, {{1, 2, 3}, {4, 5, 6}, {7, 8, 9}});
    for (std::size_t length = 0; length < bytes.size(); ++length)
        EXPECT_TRUE(error_message([&] { decode(bytes.substr(0, length)); }).starts_with("a.png: cannot be decoded: "))
            << length;
    TextureImage image;
    EXPECT_EQ(error_message([&] { read_png("a.png", bytes, 2, image); }), "a.png: 3 x 3 texels are more than 2 a side");
}

TEST(Png, TextDoesNotChangeThePixels) {
    const std::vector<std::uint8_t> pixels = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12};
    const std::string plain = encode_png("a.png", 2, 2, 3, pixels);
    const std::string marked = encode_png("a.png", 2, 2, 3, pixels, {"Title", "one"});
    EXPECT_EQ(text_of_png(plain, "Title"), "");
    EXPECT_EQ(text_of_png(marked, "Title"), "one");
    EXPECT_EQ(text_of_png(marked, "Titl"), "");
    // libpng checks the CRC of every chunk that it knows.
    EXPECT_EQ(read_png("a.png", marked, 16).pixels, read_png("a.png", plain, 16).pixels);
    for (std::size_t length = 0; length < marked.size(); ++length) text_of_png(marked.substr(0, length), "Title");
    EXPECT_EQ(text_of_png(marked.substr(0, 60), "IHDR"), "");
}

TEST(Png, QuantizationRoundsToNearest) {
    for (int i = 0; i < 256; ++i) {
        EXPECT_EQ(quantize_8bit(static_cast<float>(i) / 255), i);
        if (i < 255) {
            EXPECT_EQ(quantize_8bit((static_cast<float>(i) + 0.499f) / 255), i);
            EXPECT_EQ(quantize_8bit((static_cast<float>(i) + 0.501f) / 255), i + 1);
        }
    }
    EXPECT_EQ(quantize_8bit(-1), 0);
    EXPECT_EQ(quantize_8bit(7), 255);
    EXPECT_EQ(quantize_8bit(std::numeric_limits<float>::infinity()), 255);
    EXPECT_EQ(quantize_8bit(std::numeric_limits<float>::quiet_NaN()), 0);
}

TEST(Png, RefusesOtherFiles) {
    EXPECT_THROW(write_png(temporary("bad.png"), 0, 1, 3, {}), Error);
    EXPECT_THROW(write_png(temporary("bad.png"), 2, 2, 3, {1, 2, 3}), Error);
    EXPECT_THROW(write_png(temporary("bad.png"), 1, 1, 5, {1, 2, 3, 4, 5}), Error);
    EXPECT_THROW(write_png(temporary("no/such.png"), 1, 1, 1, {1}), Error);
    EXPECT_FALSE(fs::exists(temporary("bad.png")));
}

}  // namespace
}  // namespace halflight
