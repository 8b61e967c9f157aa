// Tests image operations, bytes that copies share, the cache folder, and hashes.
#include "engine/core/image_tools.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/core/cache_folder.h"
#include "engine/core/hash.h"
#include "engine/core/shared_bytes.h"
#include "tests/unit/core/environment_variable.h"

namespace halflight {
namespace {

Image numbered(int width, int height, int channels) {
    Image image(width, height, channels);
    for (std::size_t i = 0; i < image.pixels.size(); ++i) image.pixels[i] = std::sin(static_cast<float>(i * i));
    return image;
}

TEST(ImageTools, AlphaIsDropped) {
    const Image rgba = numbered(5, 3, 4), without = rgb(rgba);
    EXPECT_EQ(without.channels, 3);
    for (int y = 0; y < 3; ++y)
        for (int x = 0; x < 5; ++x)
            for (int c = 0; c < 3; ++c) EXPECT_EQ(without.at(x, y)[c], rgba.at(x, y)[c]);
}

TEST(ImageTools, BitsAreCompared) {
    Image a = numbered(4, 6, 3), b = a;
    EXPECT_TRUE(same_bits(a, b));
    a.pixels[7] = b.pixels[7] = std::numeric_limits<float>::quiet_NaN();
    EXPECT_TRUE(same_bits(a, b));
    a.pixels[7] = 0.0f, b.pixels[7] = -0.0f;
    EXPECT_FALSE(same_bits(a, b));
    EXPECT_FALSE(same_bits(Image(4, 6, 3), Image(6, 4, 3)));
    EXPECT_FALSE(same_bits(Image(4, 6, 3), Image(4, 5, 3)));
}

TEST(ImageTools, BlurIsTheMeanOfTheSquare) {
    for (const int radius : {0, 2, 9}) {
        const Image image = numbered(7, 12, 2), blurred = box_blur(image, radius);
        for (std::size_t i = 0; i < image.pixels.size(); ++i) {
            const int c = int(i) % 2, x = int(i) / 2 % 7, y = int(i) / 14;
            double sum = 0, count = 0;
            for (int v = std::max(y - radius, 0); v <= std::min(y + radius, 11); ++v)
                for (int u = std::max(x - radius, 0); u <= std::min(x + radius, 6); ++u)
                    sum += image.at(u, v)[c], ++count;
            EXPECT_NEAR(blurred.pixels[i], sum / count, 1e-6) << radius << ' ' << x << ' ' << y;
        }
    }
}

TEST(CacheFolder, FollowsTheEnvironment) {
    test::EnvironmentVariable cache("XDG_CACHE_HOME", "/caches"), home("HOME", "/home/somebody");
    EXPECT_EQ(cache_folder("things"), "/caches/halflight/things");
    cache.set("relative");
    EXPECT_EQ(cache_folder("things"), "/home/somebody/.cache/halflight/things");
    cache.set(nullptr);
    home.set("relative");
    EXPECT_EQ(cache_folder("things"), "");
    home.set(nullptr);
    EXPECT_EQ(cache_folder("things"), "");
}

TEST(SharedBytes, CopiesShareUntilOneIsEdited) {
    SharedBytes a;
    EXPECT_TRUE(a.empty());
    EXPECT_EQ(a.begin(), a.end());
    for (const std::uint8_t byte : {1, 2, 3}) a.edit().push_back(byte);
    const SharedBytes b = a;
    EXPECT_EQ(a.data(), b.data());
    a.edit()[1] = 9;
    EXPECT_EQ(a.get(), (std::vector<std::uint8_t>{1, 9, 3}));
    EXPECT_EQ(b.get(), (std::vector<std::uint8_t>{1, 2, 3}));
    EXPECT_FALSE(a == b);
    const std::uint8_t* const own = a.data();
    a.edit()[1] = 2;
    EXPECT_EQ(a.data(), own) << "bytes that nobody shares stay where they are";
    EXPECT_TRUE(a == b);
    a = {};
    EXPECT_TRUE(a.empty());
    EXPECT_EQ(b.size(), 3u);
}

TEST(HashOfBytes, IsFnv1a) {
    // The expected values are test vectors of draft-eastlake-fnv.
    EXPECT_EQ(hash_of(""), 0xcbf29ce484222325u);
    EXPECT_EQ(hash_of("a"), 0xaf63dc4c8601ec8cu);
    EXPECT_EQ(hash_of("foobar"), 0x85944171f73967e8u);
}

TEST(ImageTools, PartsAndStraightColours) {
    Image image(4, 3, 4);
    for (std::size_t i = 0; i < image.pixels.size(); ++i) image.pixels[i] = static_cast<float>(i);
    const Image part = part_of(image, {1, 1}, {2, 2});
    EXPECT_EQ(part.width, 2);
    EXPECT_EQ(part.height, 2);
    EXPECT_EQ(part.at(0, 0)[0], image.at(1, 1)[0]);
    EXPECT_EQ(part.at(1, 1)[3], image.at(2, 2)[3]);

    Image colors(2, 1, 4);
    colors.pixels = {0.25f, 0.5f, 2, 0.5f, 3, 3, 3, 0};
    EXPECT_EQ(straight(colors).pixels, (std::vector<float>{0.5f, 1, 4, 0.5f, 0, 0, 0, 0}));
}

}  // namespace
}  // namespace halflight
