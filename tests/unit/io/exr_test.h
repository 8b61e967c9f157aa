// A file of OpenEXR in a folder of its own, and pictures to write.
#pragma once

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "engine/core/image.h"
#include "engine/io/exr.h"
#include "tools/common/temporary_folder.h"

namespace halflight {

class Exr : public testing::Test {
  protected:
    std::size_t entries() const { return folder_.entries().size(); }
    /// Returns values of both signs and many magnitudes.
    static Image noise(int width, int height, int channels, unsigned seed = 1) {
        Image image(width, height, channels);
        for (float& v : image.pixels) {
            seed = seed * 1664525u + 1013904223u;
            v = std::ldexp(static_cast<float>(seed >> 8), static_cast<int>(seed % 13) - 26);
        }
        return image;
    }
    /// Returns a channel of bits.
    static Image ids(int width, int height) {
        Image image(width, height, 1);
        for (std::size_t i = 0; i < image.pixels.size(); ++i)
            image.pixels[i] = std::bit_cast<float>(static_cast<std::uint32_t>(i * 2654435761u));
        return image;
    }
    /// Compares values bit for bit, including NaN and -0.
    static void expect_same(const ExrFile& file, const std::vector<std::string>& names, const Image& image) {
        for (std::size_t c = 0; c < names.size(); ++c) {
            const ExrChannel* channel = file.find(names[c]);
            ASSERT_TRUE(channel) << names[c];
            ASSERT_EQ(channel->values.size() * names.size(), image.pixels.size());
            std::size_t differing = 0;
            for (std::size_t i = 0; i < channel->values.size(); ++i)
                differing += std::bit_cast<std::uint32_t>(channel->values[i]) !=
                             std::bit_cast<std::uint32_t>(image.pixels[i * names.size() + c]);
            EXPECT_EQ(differing, 0u) << names[c];
        }
    }

    const TemporaryFolder folder_;
    const std::filesystem::path path_ = folder_ / "image.exr";
};

}  // namespace halflight
