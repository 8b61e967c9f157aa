#include "engine/io/webp.h"

#include <gtest/gtest.h>
#include <webp/encode.h>

#include <random>

#include "tests/support/error_message.h"

namespace halflight {
namespace {

std::string refusal(std::string_view bytes, int max_side = 16384) {
    TextureImage image;
    return error_message([&] { read_webp("a.webp", bytes, max_side, image); });
}

/// Returns random texels. With `alpha`, no texel is invisible, since encoders change the colour of those.
std::vector<std::uint8_t> random_texels(int side, bool alpha) {
    std::mt19937 random(static_cast<unsigned>(side));
    std::vector<std::uint8_t> rgba(4u * static_cast<unsigned>(side * side));
    for (std::size_t i = 0; i < rgba.size(); ++i)
        rgba[i] = static_cast<std::uint8_t>(i % 4 == 3 ? (alpha ? 1 + random() % 255 : 255) : random());
    return rgba;
}

std::string encode(const std::vector<std::uint8_t>& rgba, int side, bool lossless) {
    std::uint8_t* bytes = nullptr;
    const std::size_t size = lossless ? WebPEncodeLosslessRGBA(rgba.data(), side, side, 4 * side, &bytes)
                                      : WebPEncodeRGBA(rgba.data(), side, side, 4 * side, 90, &bytes);
    const std::string file(reinterpret_cast<const char*>(bytes), size);
    WebPFree(bytes);
    return file;
}

TEST(WebP, LosslessFilesKeepEveryTexel) {
    for (const bool alpha : {false, true}) {
        const std::vector<std::uint8_t> rgba = random_texels(37, alpha);
        const std::string bytes = encode(rgba, 37, true);
        ASSERT_TRUE(is_webp(bytes));
        TextureImage image;
        read_webp("a.webp", bytes, 37, image);
        EXPECT_EQ(image.width, 37);
        EXPECT_EQ(image.height, 37);
        EXPECT_EQ(image.rgba, rgba);
    }
}

TEST(WebP, LossyFilesKeepTheirColour) {
    std::vector<std::uint8_t> rgba;
    for (int i = 0; i < 40 * 40; ++i) rgba.insert(rgba.end(), {200, 100, 50, 128});
    TextureImage image;
    read_webp("a.webp", encode(rgba, 40, false), 40, image);
    ASSERT_EQ(image.rgba.size(), rgba.size());
    for (std::size_t i = 0; i < rgba.size(); ++i) ASSERT_NEAR(image.rgba[i], rgba[i], 4) << i;
}

TEST(WebP, EveryTruncationIsAnError) {
    for (const bool lossless : {false, true}) {
        const std::string bytes = encode(random_texels(24, true), 24, lossless);
        for (std::size_t length = 0; length + 1 < bytes.size(); ++length)  // the last byte may be padding
            EXPECT_TRUE(refusal(bytes.substr(0, length)).starts_with("a.webp: cannot be decoded: "))
                << length << " of " << bytes.size();
    }
}

TEST(WebP, DamageGivesOneLine) {
    std::mt19937 random(1);
    for (const bool lossless : {false, true}) {
        const std::string bytes = encode(random_texels(24, true), 24, lossless);
        for (int i = 0; i < 5000; ++i) {
            std::string damaged = bytes;
            damaged[random() % bytes.size()] = static_cast<char>(random());
            const std::string message = refusal(damaged, 1024);
            EXPECT_TRUE(message.empty() || message.starts_with("a.webp: ")) << message;
            EXPECT_EQ(message.find('\n'), std::string::npos) << message;
        }
    }
}

TEST(WebP, SizesAreCheckedBeforeDecoding) {
    const std::string bytes = encode(random_texels(40, false), 40, true);
    EXPECT_EQ(refusal(bytes, 39), "a.webp: 40 x 40 texels are more than 39 a side");
    std::string claim = bytes;
    claim.replace(21, 3, "\xff\xff\xff", 3);  // 14 bits each of width - 1 and height - 1 (RFC 9649, section 3.4)
    claim[24] = static_cast<char>(claim[24] | 0xf);
    EXPECT_EQ(refusal(claim), fmt::format("a.webp: is refused: {} bytes claim 16384 x 16384 texels", claim.size()));
    const ImageHeader header = read_webp_header("a.webp", bytes.substr(0, 64), bytes.size(), 40);
    EXPECT_EQ(header.width, 40u);
    EXPECT_GE(header.decoding_bytes, 4u * 40 * 40);
}

}  // namespace
}  // namespace halflight
