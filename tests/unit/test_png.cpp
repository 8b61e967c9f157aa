// PNG: what is written is what stb_image reads; rounding; failures.
#include <gtest/gtest.h>
#include <stb/stb_image.h>
#include <unistd.h>

#include <filesystem>
#include <limits>
#include <memory>

#include "engine/core/error.h"
#include "engine/io/files.h"
#include "engine/io/png.h"

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
        int width = 0, height = 0, stored = 0;
        const std::unique_ptr<stbi_uc, void (*)(void*)> read(
            stbi_load_from_memory(reinterpret_cast<const stbi_uc*>(file.data()), static_cast<int>(file.size()), &width,
                                  &height, &stored, 0),
            stbi_image_free);
        ASSERT_TRUE(read);
        EXPECT_EQ(width, kWidth);
        EXPECT_EQ(height, kHeight);
        EXPECT_EQ(stored, channels);
        EXPECT_TRUE(std::equal(bytes.begin(), bytes.end(), read.get())) << channels << " channels";
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

TEST(Png, RefusesWhatIsNoImage) {
    EXPECT_THROW(write_png(temporary("bad.png"), 0, 1, 3, {}), Error);
    EXPECT_THROW(write_png(temporary("bad.png"), 2, 2, 3, {1, 2, 3}), Error);
    EXPECT_THROW(write_png(temporary("bad.png"), 1, 1, 5, {1, 2, 3, 4, 5}), Error);
    EXPECT_THROW(write_png(temporary("no/such.png"), 1, 1, 1, {1}), Error);
    EXPECT_FALSE(fs::exists(temporary("bad.png")));
}

}  // namespace
}  // namespace halflight
