// Tests PNG, JPEG and WebP files: pixel formats, round trips, rounding, and damaged files.
#include <gtest/gtest.h>
#include <png.h>
#include <webp/encode.h>

#include <algorithm>
#include <filesystem>
#include <limits>
#include <random>

#include "engine/core/error.h"
#include "engine/io/files.h"
#include "engine/io/jpeg.h"
#include "engine/io/png.h"
#include "engine/io/webp.h"
#include "tests/support/error_message.h"
#include "tests/support/jpeg.h"
#include "tools/common/temporary_folder.h"

namespace halflight {
namespace {

namespace fs = std::filesystem;

using Bytes = std::vector<std::uint8_t>;
using Read = void(const std::string&, std::string_view, int, TextureImage&);

std::string refusal(Read* read, std::string_view bytes, int max_side = 16384) {
    TextureImage image;
    return error_message([&] { read("a", bytes, max_side, image); });
}

Bytes decode(Read* read, std::string_view bytes) {
    TextureImage image;
    read("a", bytes, 16384, image);
    EXPECT_EQ(image.rgba.size(), 4u * static_cast<std::size_t>(image.pitch() * image.height));
    return image.rgba;
}

struct Kind {
    int depth;
    int color_type;
    int interlace = PNG_INTERLACE_NONE;
};

/// Encodes rows of a PNG without a conversion.
std::string encode_rows(int width, const Kind& kind, std::vector<Bytes> rows) {
    png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
    png_infop info = png_create_info_struct(png);
    std::string bytes;
    const auto write = [](png_structp self, png_bytep data, std::size_t size) {
        static_cast<std::string*>(png_get_io_ptr(self))->append(reinterpret_cast<const char*>(data), size);
    };
    png_set_write_fn(png, &bytes, write, nullptr);
    png_set_IHDR(png, info, static_cast<png_uint_32>(width), static_cast<png_uint_32>(rows.size()), kind.depth,
                 kind.color_type, kind.interlace, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
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

/// Returns random texels. With `alpha`, no texel is invisible, since encoders change the colour of those.
Bytes random_texels(int side, bool alpha) {
    std::mt19937 random(static_cast<unsigned>(side));
    Bytes rgba(4u * static_cast<unsigned>(side * side));
    for (std::size_t i = 0; i < rgba.size(); ++i)
        rgba[i] = static_cast<std::uint8_t>(i % 4 == 3 ? (alpha ? 1 + random() % 255 : 255) : random());
    return rgba;
}

std::string encode_webp(const Bytes& rgba, int side, bool lossless) {
    std::uint8_t* bytes = nullptr;
    const std::size_t size = lossless ? WebPEncodeLosslessRGBA(rgba.data(), side, side, 4 * side, &bytes)
                                      : WebPEncodeRGBA(rgba.data(), side, side, 4 * side, 90, &bytes);
    const std::string file(reinterpret_cast<const char*>(bytes), size);
    WebPFree(bytes);
    return file;
}

TEST(ImageFiles, TruncatedAndOversizedOnesAreRefused) {
    const struct {
        Read* read;
        int side;
        std::string bytes;
        std::size_t optional;  // bytes at the end that decoders do not need: JPEG's end marker, padding of WebP
    } cases[] = {
        {read_png, 3, encode_rows(3, {8, PNG_COLOR_TYPE_GRAY}, {{1, 2, 3}, {4, 5, 6}, {7, 8, 9}}), 0},
        {read_jpeg, 40, encode_jpeg(40, {200, 100, 50}), 2},
        {read_jpeg, 40, encode_jpeg(40, {200, 100, 50}, true), 2},
        {read_webp, 24, encode_webp(random_texels(24, true), 24, true), 1},
        {read_webp, 24, encode_webp(random_texels(24, true), 24, false), 1},
    };
    for (const auto& [read, side, bytes, optional] : cases) {
        for (std::size_t length = 0; length + optional < bytes.size(); ++length)
            EXPECT_TRUE(refusal(read, bytes.substr(0, length)).starts_with("a: cannot be decoded: "))
                << length << " of " << bytes.size();
        EXPECT_EQ(refusal(read, bytes, side), "");
        EXPECT_TRUE(refusal(read, bytes, side - 1).starts_with(fmt::format("a: {0} x {0} texels", side)));
    }
    const std::string tall = encode_rows(1, {8, PNG_COLOR_TYPE_GRAY}, {{1}, {2}, {3}});
    EXPECT_EQ(refusal(read_png, tall, 3), "");
    EXPECT_TRUE(refusal(read_png, tall, 2).starts_with("a: 1 x 3 texels"));
}

TEST(Png, RoundTripOfEveryChannelCount) {
    const TemporaryFolder folder;
    const fs::path path = folder / "a.png";
    for (int channels = 1; channels <= 4; ++channels) {
        Image image(37, 23, channels);
        for (std::size_t i = 0; i < image.pixels.size(); ++i)
            image.pixels[i] = static_cast<float>((i * i + 7 * i) % 256) / 255;
        write_png(path, image);
        const std::string file = read_file(path, 1 << 20);
        const Image read = read_png("a.png", file, 37);
        EXPECT_EQ(read.channels, channels);
        EXPECT_EQ(ivec2(read.width, read.height), ivec2(37, 23));
        EXPECT_EQ(read.pixels, image.pixels);
        write_png(path, image);
        EXPECT_EQ(read_file(path, 1 << 20), file) << "the same bytes give the same file";
        const Bytes rgba = decode(read_png, file);
        const std::size_t colors = channels < 3 ? 1 : 3, n = static_cast<std::size_t>(channels);
        for (std::size_t i = 0; i < rgba.size(); ++i) {
            const std::size_t c = i % 4 == 3 ? colors : std::min(i % 4, colors - 1);
            ASSERT_EQ(rgba[i], c < n ? quantize_8bit(image.pixels[i / 4 * n + c]) : 255) << channels << " " << i;
        }
        EXPECT_THROW(read_png("a.png", file, 36), Error);
        EXPECT_THROW(read_png("a.png", file.substr(0, file.size() / 2), 37), Error);
    }
    EXPECT_THROW(read_png("a.png", "no picture", 16), Error);
    fs::remove(path);
    EXPECT_THROW(write_png(path, 0, 1, 3, {}), Error);
    EXPECT_THROW(write_png(path, 2, 2, 3, {1, 2, 3}), Error);
    EXPECT_THROW(write_png(path, 1, 1, 5, {1, 2, 3, 4, 5}), Error);
    EXPECT_THROW(write_png(folder / "no/such.png", 1, 1, 1, {1}), Error);
    EXPECT_TRUE(folder.entries().empty());
}

TEST(Png, EveryPixelFormatIsRead) {
    const struct {
        int side;
        Kind kind;
        std::vector<Bytes> rows;
        Bytes texels;  // grey values, or all channels; of 16 bits all high bytes of a texel first
    } cases[] = {
        {2, {1, PNG_COLOR_TYPE_GRAY}, {{0x40}, {0x80}}, {0, 255, 255, 0}},
        {1, {16, PNG_COLOR_TYPE_GRAY}, {{0x7e, 0xff}}, {0x7e, 0xff}},
        {1, {16, PNG_COLOR_TYPE_GRAY}, {{0x7e, 0x7e}}, {0x7e}},  // 8 bits hold it
        {1, {16, PNG_COLOR_TYPE_RGB_ALPHA}, {{1, 255, 2, 254, 3, 253, 4, 252}}, {1, 2, 3, 4, 255, 254, 253, 252}},
        {2, {2, PNG_COLOR_TYPE_PALETTE}, {{0x10}, {0x40}}, {1, 2, 3, 128, 4, 5, 6, 255, 4, 5, 6, 255, 1, 2, 3, 128}},
        {2,
         {8, PNG_COLOR_TYPE_RGB, PNG_INTERLACE_ADAM7},
         {{1, 2, 3, 4, 5, 6}, {7, 8, 9, 10, 11, 12}},
         {1, 2, 3, 255, 4, 5, 6, 255, 7, 8, 9, 255, 10, 11, 12, 255}}};
    for (const auto& [side, kind, rows, texels] : cases) {
        Bytes expected = texels;
        if (kind.color_type == PNG_COLOR_TYPE_GRAY) {
            expected.clear();
            for (const std::uint8_t grey : texels) expected.insert(expected.end(), {grey, grey, grey, 255});
        }
        EXPECT_EQ(decode(read_png, encode_rows(side, kind, rows)), expected) << kind.depth << " " << kind.color_type;
    }
}

TEST(Png, TextDoesNotChangeThePixels) {
    const Bytes pixels = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12};
    const std::string plain = encode_png("a.png", 2, 2, 3, pixels);
    const std::string marked = encode_png("a.png", 2, 2, 3, pixels, {"Title", "one"});
    EXPECT_EQ(text_of_png(plain, "Title"), "");
    EXPECT_EQ(text_of_png(marked, "Title"), "one");
    EXPECT_EQ(text_of_png(marked, "Titl"), "");
    // libpng checks the CRC of every chunk that it knows.
    EXPECT_EQ(decode(read_png, marked), decode(read_png, plain));
    for (std::size_t length = 0; length < marked.size(); ++length) text_of_png(marked.substr(0, length), "Title");
    EXPECT_EQ(text_of_png(marked.substr(0, 60), "IHDR"), "");
}

/// Returns the data of a chunk; empty without one.
std::string chunk_of(const std::string& png, const char* kind) {
    const std::size_t at = png.find(kind);
    if (at == std::string::npos) return "";
    std::size_t length = 0;
    for (std::size_t i = at - 4; i < at; ++i) length = 256 * length + static_cast<unsigned char>(png[i]);
    return png.substr(at + 4, length);
}

TEST(Png, EncodingsAreTagged) {
    Image image(2, 1, 3);
    image.pixels = {0, 0.25f, 1, 0.5f, 2, -1};
    const DisplayEncoding p3{12, TransferCurve::srgb}, pq{9, TransferCurve::pq};
    const std::string plain = encode_png("a.png", image, {}), tagged = encode_png("a.png", image, {.encoding = p3});
    EXPECT_EQ(plain, encode_png("a.png", 2, 1, 3, quantize_8bit(image)));
    EXPECT_EQ(chunk_of(plain, "cICP") + chunk_of(plain, "iCCP"), "");
    EXPECT_EQ(chunk_of(tagged, "cICP"), std::string("\14\15\0\1", 4));
    EXPECT_EQ(decode(read_png, tagged), decode(read_png, plain));
    const std::string deep = encode_png("a.png", image, {.bits = 16, .encoding = pq});
    EXPECT_EQ(chunk_of(deep, "cICP"), std::string("\11\20\0\1", 4));
    EXPECT_EQ(chunk_of(deep, "iCCP"), "");
    const Image read = read_png("a.png", deep, 9);
    for (std::size_t i = 0; i < 6; ++i)
        EXPECT_NEAR(read.pixels[i], std::clamp(image.pixels[i], 0.0f, 1.0f), 0.5 / 65535) << i;
}

/// libpng takes only profiles whose header and table are right, and says what it takes.
TEST(Png, ProfilesAreValid) {
    Image image(1, 1, 3);
    for (const std::uint8_t primaries : {1, 9, 11, 12}) {
        for (const TransferCurve curve : {TransferCurve::bt1886, TransferCurve::gamma22, TransferCurve::srgb}) {
            const DisplayEncoding encoding{primaries, curve};
            const std::string profile = icc_profile(encoding), png = encode_png("a.png", image, {.encoding = encoding});
            const std::string chunk = chunk_of(png, "iCCP");
            EXPECT_EQ(chunk.substr(0, 9), std::string("display\0\0", 9));
            EXPECT_EQ(profile.size() % 4, 0u);
            // The columns of the matrix add up to the white of profiles.
            double white[3] = {};
            for (const char* kind : {"rXYZ", "gXYZ", "bXYZ"}) {
                const auto number = [&](std::size_t at) {
                    std::uint32_t value = 0;
                    for (std::size_t i = at; i < at + 4; ++i)
                        value = 256 * value + static_cast<unsigned char>(profile[i]);
                    return value;
                };
                const std::size_t entry = profile.find(kind), place = number(entry + 4);
                EXPECT_EQ(profile.substr(place, 4), "XYZ ");
                for (std::size_t i = 0; i < 3; ++i)
                    white[i] += static_cast<std::int32_t>(number(place + 8 + 4 * i)) / 65536.0;
            }
            EXPECT_NEAR(white[0], 0.9642, 1e-4);
            EXPECT_NEAR(white[1], 1, 1e-4);
            EXPECT_NEAR(white[2], 0.8249, 1e-4);
        }
    }
}

TEST(Png, QuantizationRoundsToNearest) {
    for (int i = 0; i < 256; ++i) {
        EXPECT_EQ(quantize_8bit(static_cast<float>(i) / 255), i);
        EXPECT_EQ(quantize_8bit((static_cast<float>(i) + 0.499f) / 255), i);
        EXPECT_EQ(quantize_8bit((static_cast<float>(i) - 0.499f) / 255), i);
    }
    EXPECT_EQ(quantize_8bit(-1), 0);
    EXPECT_EQ(quantize_8bit(7), 255);
    EXPECT_EQ(quantize_8bit(std::numeric_limits<float>::infinity()), 255);
    EXPECT_EQ(quantize_8bit(std::numeric_limits<float>::quiet_NaN()), 0);
}

TEST(Jpeg, ColoursAreThoseOfTheFile) {
    for (const bool progressive : {false, true}) {
        for (const Bytes& color : {Bytes{200}, {200, 100, 50}}) {
            const std::string bytes = encode_jpeg(17, color, progressive);
            ASSERT_TRUE(is_jpeg(bytes));
            const Bytes rgba = decode(read_jpeg, bytes);
            ASSERT_EQ(rgba.size(), 4u * 17 * 17);
            for (std::size_t i = 0; i < rgba.size(); ++i) {
                const int expected = i % 4 == 3 ? 255 : color[color.size() == 1 ? 0 : i % 4];
                EXPECT_NEAR(rgba[i], expected, 2) << i;  // quantization steps of chroma and luma are at most two
            }
        }
    }
}

TEST(Jpeg, ClaimsAndScansAreLimited) {
    std::string claim = encode_jpeg(40, {1, 2, 3});
    const std::size_t frame = claim.find("\xff\xc0");
    for (const std::size_t at : {frame + 5, frame + 7}) claim.replace(at, 2, "\x40\x00", 2);
    EXPECT_TRUE(refusal(read_jpeg, claim).starts_with("a: is truncated"));
    EXPECT_TRUE(refusal(read_jpeg, encode_jpeg(8, {1, 2, 3, 4})).starts_with("a: cannot be decoded")) << "CMYK";

    std::string scans = encode_jpeg(8, {1}, true);
    const std::size_t first = scans.find("\xff\xda"), second = scans.find("\xff\xda", first + 2);
    const std::string scan = scans.substr(second);  // a refinement scan may be repeated arbitrarily often
    const std::string body = scan.substr(0, scan.find("\xff\xd9"));
    for (int i = 0; i < 400; ++i) scans.insert(second, body);
    EXPECT_EQ(refusal(read_jpeg, scans), "a: cannot be decoded: has too many scans");
}

TEST(WebP, TexelsAreThoseOfTheFile) {
    for (const bool alpha : {false, true}) {
        const Bytes rgba = random_texels(37, alpha);
        const std::string bytes = encode_webp(rgba, 37, true);
        ASSERT_TRUE(is_webp(bytes));
        EXPECT_EQ(decode(read_webp, bytes), rgba);
    }
    Bytes flat;
    for (int i = 0; i < 40 * 40; ++i) flat.insert(flat.end(), {200, 100, 50, 128});
    const Bytes lossy = decode(read_webp, encode_webp(flat, 40, false));
    ASSERT_EQ(lossy.size(), flat.size());
    for (std::size_t i = 0; i < flat.size(); ++i) ASSERT_NEAR(lossy[i], flat[i], 4) << i;
}

TEST(WebP, HeadersTellTheSize) {
    const std::string bytes = encode_webp(random_texels(40, false), 40, true);
    std::string claim = bytes;
    claim.replace(21, 3, "\xff\xff\xff", 3);  // 14 bits each of width - 1 and height - 1 (RFC 9649, section 3.4)
    claim[24] = static_cast<char>(claim[24] | 0xf);
    EXPECT_TRUE(refusal(read_webp, claim).starts_with("a: is refused: "));
    const ImageHeader header = read_webp_header("a", bytes.substr(0, 64), bytes.size(), 40);
    EXPECT_EQ(header.width, 40u);
    EXPECT_GE(header.decoding_bytes, 4u * 40 * 40);
}

}  // namespace
}  // namespace halflight
