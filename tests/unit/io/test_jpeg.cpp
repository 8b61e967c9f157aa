#include "engine/io/jpeg.h"

#include <gtest/gtest.h>

#include "tests/support/error_message.h"
#include "tests/support/jpeg.h"

namespace halflight {
namespace {

std::string refusal(std::string_view bytes, int max_side = 16384) {
    TextureImage image;
    return error_message([&] { read_jpeg("a.jpg", bytes, max_side, image); });
}

TEST(Jpeg, ColoursAreThoseOfTheFile) {
    for (const bool progressive : {false, true}) {
        for (const std::vector<std::uint8_t>& color : {std::vector<std::uint8_t>{200}, {200, 100, 50}}) {
            const std::string bytes = encode_jpeg(17, color, progressive);
            ASSERT_TRUE(is_jpeg(bytes));
            TextureImage image;
            read_jpeg("a.jpg", bytes, 17, image);
            ASSERT_EQ(image.width, 17);
            ASSERT_EQ(image.height, 17);
            ASSERT_EQ(image.rgba.size(), 4u * 17 * 17);
            for (std::size_t i = 0; i < image.rgba.size(); ++i) {
                const int expected = i % 4 == 3 ? 255 : color[color.size() == 1 ? 0 : i % 4];
                EXPECT_NEAR(image.rgba[i], expected, 2) << i;  // quantization steps of chroma and luma are at most two
            }
        }
    }
}

TEST(Jpeg, EveryTruncationIsAnError) {
    for (const bool progressive : {false, true}) {
        const std::string bytes = encode_jpeg(40, {200, 100, 50}, progressive);
        // The last two bytes are the end marker, without which libjpeg decodes, too.
        for (std::size_t length = 0; length + 2 < bytes.size(); ++length)
            EXPECT_TRUE(refusal(bytes.substr(0, length)).starts_with("a.jpg: cannot be decoded: "))
                << length << " of " << bytes.size();
    }
}

TEST(Jpeg, OversizedFilesAreRefused) {
    EXPECT_EQ(refusal(encode_jpeg(40, {1, 2, 3}), 39), "a.jpg: 40 x 40 texels are more than 39 a side");
    EXPECT_EQ(refusal(encode_jpeg(40, {1, 2, 3}), 40), "");
    std::string claim = encode_jpeg(40, {1, 2, 3});
    const std::size_t frame = claim.find("\xff\xc0");
    for (const std::size_t at : {frame + 5, frame + 7}) claim.replace(at, 2, "\x40\x00", 2);
    EXPECT_EQ(refusal(claim),
              fmt::format("a.jpg: is truncated: {} bytes cannot hold 16384 x 16384 texels", claim.size()));
    EXPECT_TRUE(
        refusal(encode_jpeg(8, {1, 2, 3, 4})).starts_with("a.jpg: cannot be decoded: Unsupported color conversion"));

    std::string scans = encode_jpeg(8, {1}, true);
    const std::size_t first = scans.find("\xff\xda"), second = scans.find("\xff\xda", first + 2);
    const std::string scan = scans.substr(second);  // a refinement scan may be repeated arbitrarily often
    const std::string body = scan.substr(0, scan.find("\xff\xd9"));
    for (int i = 0; i < 400; ++i) scans.insert(second, body);
    EXPECT_EQ(refusal(scans), "a.jpg: cannot be decoded: has too many scans");
}

}  // namespace
}  // namespace halflight
