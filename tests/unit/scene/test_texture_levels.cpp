// Tests mip levels of images: sizes, means of areas, and means of colours and normals.
#include <gtest/gtest.h>

#include <array>
#include <random>

#include "engine/scene/texture_levels.h"

namespace halflight {
namespace {

using Texel = std::array<std::uint8_t, 4>;
constexpr LevelUses kColor{.color = true}, kData{.data = true}, kNormal{.data = true, .normal = true};

TextureImage image_of(int width, int height, const std::vector<Texel>& texels) {
    TextureImage image{.name = "image", .width = width, .height = height, .rgba = {}};
    for (const Texel& t : texels) image.rgba.edit().insert(image.rgba.edit().end(), t.begin(), t.end());
    return image;
}

TextureImage with_levels(TextureImage image, const LevelUses& uses) {
    add_levels(image, uses);
    return image;
}

/// Returns an image of 16 bits with the codes of one of 8 bits, times 257: the same values.
TextureImage deepened(const TextureImage& image) {
    TextureImage deep{.name = image.name, .width = image.width, .height = image.height, .rgba = {}, .deep = true};
    for (std::size_t i = 0; i < image.rgba.size(); i += 4)
        for (int twice = 0; twice < 2; ++twice)
            deep.rgba.edit().insert(deep.rgba.edit().end(), &image.rgba[i], &image.rgba[i] + 4);
    return deep;
}

std::array<double, 4> values(const TextureImage& image, std::size_t index) {
    std::array<double, 4> v;
    for (std::size_t c = 0; c < 4; ++c)
        v[c] = double(image.code(&image.rgba[index * image.texel_bytes()], c)) / image.largest();
    return v;
}

Texel texel(const TextureImage& image, std::size_t index) {
    return {image.rgba[4 * index], image.rgba[4 * index + 1], image.rgba[4 * index + 2], image.rgba[4 * index + 3]};
}

TEST(TextureLevels, HalveUntilOneTexelIsLeft) {
    for (const ivec2 size : {ivec2(1, 1), ivec2(2, 1), ivec2(64, 64), ivec2(37, 23), ivec2(1, 129), ivec2(100, 3)}) {
        SCOPED_TRACE(testing::Message() << size.x << " x " << size.y);
        const std::size_t texels = static_cast<std::size_t>(size.x * size.y);
        const TextureImage image = with_levels(image_of(size.x, size.y, std::vector<Texel>(texels)), kData);
        EXPECT_EQ(image.data_levels.size() + 1, static_cast<std::size_t>(level_count(size.x, size.y)));
        std::size_t sum = 0;
        ivec2 last = size;
        for (const TextureImage& level : image.data_levels) {
            last = glm::max(last / 2, ivec2(1));
            EXPECT_EQ(ivec2(level.width, level.height), last);
            EXPECT_EQ(level.rgba.size(), static_cast<std::size_t>(4 * last.x * last.y));
            sum += level.rgba.size() / 4;
        }
        EXPECT_EQ(last, ivec2(1));
        EXPECT_EQ(sum, level_texels(size.x, size.y));
        EXPECT_TRUE(image.color_levels.empty());
    }
}

TEST(TextureLevels, KeepConstantImages) {
    for (int value = 0; value < 256; ++value) {
        const auto v = static_cast<std::uint8_t>(value);
        const Texel constant = {v, static_cast<std::uint8_t>(255 - value), 128, v};
        const std::vector<Texel> texels(15, constant);
        const TextureImage image = with_levels(image_of(5, 3, texels), {.color = true, .data = true});
        for (const auto* levels : {&image.color_levels, &image.data_levels})
            for (const TextureImage& level : *levels)
                for (std::size_t i = 0; i < level.rgba.size() / 4; ++i) EXPECT_EQ(texel(level, i), constant);
    }
}

TEST(TextureLevels, AverageAreas) {
    // The single texel of level 1 covers three texels.
    const TextureImage row = image_of(3, 1, {{0, 0, 0, 0}, {30, 60, 90, 120}, {240, 240, 240, 255}});
    EXPECT_EQ(texel(with_levels(row, kData).data_levels[0], 0), (Texel{90, 100, 110, 125}));
    const TextureImage five =
        image_of(5, 1, {{10, 0, 0, 0}, {20, 0, 0, 0}, {100, 0, 0, 0}, {200, 0, 0, 0}, {250, 0, 0, 0}});
    const TextureImage half = with_levels(five, kData).data_levels[0];
    EXPECT_EQ(texel(half, 0)[0], (2 * 10 + 2 * 20 + 1 * 100 + 2) / 5);
    EXPECT_EQ(texel(half, 1)[0], (1 * 100 + 2 * 200 + 2 * 250 + 2) / 5);

    std::mt19937 random(1);
    TextureImage noise{.name = "noise", .width = 37, .height = 23, .rgba = {}};
    double sum = 0;
    for (int i = 0; i < 4 * 37 * 23; ++i) {
        noise.rgba.edit().push_back(static_cast<std::uint8_t>(random()));
        sum += noise.rgba.get().back();
    }
    noise = with_levels(noise, kData);
    const Texel last = texel(noise.data_levels.back(), 0);
    EXPECT_NEAR((last[0] + last[1] + last[2] + last[3]) / 4.0, sum / (4 * 37 * 23), 1);
}

TEST(TextureLevels, AverageColoursAsLinearValues) {
    const TextureImage checks = image_of(2, 2, {{0, 0, 0, 0}, {255, 255, 0, 255}, {255, 0, 0, 255}, {0, 0, 255, 0}});
    EXPECT_EQ(texel(with_levels(checks, kColor).color_levels[0], 0), (Texel{188, 137, 137, 128}));
    EXPECT_EQ(texel(with_levels(checks, kData).data_levels[0], 0), (Texel{128, 64, 64, 128}));
}

TEST(TextureLevels, AverageNormalsAsUnitVectors) {
    const Texel left = {38, 128, 218, 255}, right = {218, 128, 218, 255};  // 45 degrees to both sides
    EXPECT_EQ(texel(with_levels(image_of(2, 1, {left, right}), kNormal).data_levels[0], 0), (Texel{128, 128, 255, 255}))
        << "longer than the mean";
    const Texel east = {255, 128, 128, 255}, west = {0, 127, 127, 255};
    EXPECT_EQ(texel(with_levels(image_of(2, 1, {east, west}), kNormal).data_levels[0], 0), (Texel{128, 128, 255, 255}))
        << "normals that cancel out";
}

TEST(TextureLevels, KeepSixteenBits) {
    std::mt19937 random(1);
    TextureImage noise{.name = "noise", .width = 37, .height = 20, .rgba = {}};
    for (int i = 0; i < 4 * 37 * 20; ++i) noise.rgba.edit().push_back(static_cast<std::uint8_t>(random()));
    for (const LevelUses& uses : {kColor, kData, kNormal}) {
        const TextureImage shallow = with_levels(noise, uses), deep = with_levels(deepened(noise), uses);
        for (const auto levels : {&TextureImage::color_levels, &TextureImage::data_levels}) {
            ASSERT_EQ((deep.*levels).size(), (shallow.*levels).size());
            if ((deep.*levels).empty()) continue;
            const TextureImage &fine = (deep.*levels)[0], &coarse = (shallow.*levels)[0];
            ASSERT_TRUE(fine.deep);
            ASSERT_EQ(fine.rgba.size(), 2 * coarse.rgba.size());
            for (std::size_t i = 0; i < coarse.rgba.size() / 4; ++i)
                for (std::size_t c = 0; c < 4; ++c)
                    EXPECT_NEAR(values(fine, i)[c], values(coarse, i)[c], 0.51 / 255) << i << ' ' << c;
        }
    }
    // A dark ramp, finer than 8 bits: the mean of two neighbours lies between them.
    TextureImage ramp{.name = "ramp", .width = 64, .height = 1, .rgba = {}, .deep = true};
    for (unsigned x = 0; x < 64; ++x)
        for (const unsigned byte : {2u, 2u, 2u, 2u, 3 * x, 3 * x, 3 * x, 3 * x})
            ramp.rgba.edit().push_back(static_cast<std::uint8_t>(byte));
    for (const auto& [uses, levels] :
         {std::pair(kColor, &TextureImage::color_levels), std::pair(kData, &TextureImage::data_levels)}) {
        const TextureImage half = (with_levels(ramp, uses).*levels)[0];
        for (std::size_t x = 0; x < 32; ++x)
            EXPECT_NEAR(65535 * values(half, x)[0], 512 + 3 * (2.0 * double(x) + 0.5), 0.51) << x;
    }
}

}  // namespace
}  // namespace halflight
