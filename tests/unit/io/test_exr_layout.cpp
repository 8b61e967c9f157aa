// Tests compression, parts, tiles, windows and further attributes of OpenEXR files.
#include <ImfChannelList.h>
#include <ImfHeader.h>
#include <ImfMultiPartInputFile.h>
#include <ImfMultiView.h>
#include <ImfPartType.h>
#include <ImfStandardAttributes.h>
#include <ImfThreading.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <filesystem>

#include "engine/core/error.h"
#include "engine/io/exr.h"
#include "engine/io/files.h"
#include "tests/support/error_message.h"
#include "tools/common/temporary_folder.h"

namespace halflight {
namespace {

/// Returns smooth values with some noise, in (0, 2).
Image waves(int width, int height, int channels) {
    Image image(width, height, channels);
    unsigned seed = 1;
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
            for (int c = 0; c < channels; ++c) {
                seed = seed * 1664525u + 1013904223u;
                const float noise = static_cast<float>(seed >> 8) * 0x1p-24f;
                image.at(x, y)[c] = 1 + 0.9f * std::sin(0.05f * static_cast<float>(x + 2 * y + 9 * c)) * noise;
            }
    return image;
}

Image ids(int width, int height) {
    Image image(width, height, 1);
    for (std::size_t i = 0; i < image.pixels.size(); ++i)
        image.pixels[i] = std::bit_cast<float>(static_cast<std::uint32_t>(i * 2654435761u));
    return image;
}

class ExrLayouts : public testing::Test {
  protected:
    /// Returns the layers of a picture: colour, half and float, data and ids.
    std::vector<ExrLayerView> layers() const {
        return {{.channels = {"R", "G", "B", "A"}, .image = color, .type = ExrType::half, .name = "rgba"},
                {.channels = {"albedo.R", "albedo.G", "albedo.B"}, .image = albedo, .name = "albedo"},
                {.channels = {"normal.X", "normal.Y", "normal.Z"}, .image = normal, .exact = true, .name = "normal"},
                {.channels = {"ids.instance"}, .image = numbers, .type = ExrType::uint32, .exact = true},
                {.channels = {"matte00.R", "matte00.G"}, .image = matte, .exact = true}};
    }
    ExrFile written(const ExrLayout& layout, const ExrAttributes& attributes = {}) const {
        write_exr_views(path, layers(), attributes, layout);
        return read_exr(path);
    }
    /// Returns the largest difference of a channel from an image, relative to 1.
    static double difference(const ExrFile& file, const std::string& channel, const Image& image, int number) {
        const ExrChannel* const found = file.find(channel);
        if (!found) return INFINITY;
        double most = 0;
        for (std::size_t i = 0; i < found->values.size(); ++i)
            most = std::max(most, std::abs(double{found->values[i]} -
                                           image.pixels[i * std::size_t(image.channels) + std::size_t(number)]));
        return most;
    }
    static bool same_ids(const ExrFile& file, const Image& image) {
        const ExrChannel* const found = file.find("ids.instance");
        return found &&
               std::ranges::equal(std::as_bytes(std::span(found->values)), std::as_bytes(std::span(image.pixels)));
    }

    const TemporaryFolder folder;
    const std::filesystem::path path = folder / "a.exr";
    const Image color = waves(150, 300, 4), albedo = waves(150, 300, 3), normal = waves(150, 300, 3),
                matte = waves(150, 300, 2), numbers = ids(150, 300);
};

TEST_F(ExrLayouts, EveryCompressionInLinesPartsAndTiles) {
    for (const ExrCompression compression : kExrCompressions) {
        for (const bool parts : {false, true}) {
            for (const int tile : {0, 64}) {
                const ExrLayout layout{compression, parts, tile};
                SCOPED_TRACE(testing::Message() << name(compression) << ", parts " << parts << ", tiles " << tile);
                if (is_lossy(compression) && !parts) {
                    EXPECT_EQ(error_message([&] { written(layout); }),
                              path.string() + ": compression " + name(compression) +
                                  " would change data in channel normal.X, unless layers are parts of their own");
                    continue;
                }
                const ExrFile file = written(layout);
                EXPECT_EQ(file.channels.size(), 4u + 3 + 3 + 2 + 1);
                EXPECT_EQ(difference(file, "normal.Y", normal, 1), 0);
                EXPECT_EQ(difference(file, "matte00.G", matte, 1), 0);
                EXPECT_TRUE(same_ids(file, numbers));
                const double of_half = 1.0 / 1024, lossy = compression >= ExrCompression::dwaa ? 0.05 : of_half;
                EXPECT_LE(difference(file, "G", color, 1), lossy);
                EXPECT_LE(difference(file, "albedo.B", albedo, 2), is_lossy(compression) ? lossy : 0);
                EXPECT_EQ(difference(file, "albedo.B", albedo, 2) > 0, is_lossy(compression));

                const Imf::MultiPartInputFile plain(path.c_str());
                ASSERT_EQ(plain.parts(), parts ? 5 : 1);
                EXPECT_EQ(plain.header(0).compression(),
                          Imf::Compression(std::array{0, 1, 2, 3, 4, 5, 8, 9}[std::size_t(compression)]));
                EXPECT_EQ(plain.header(0).hasTileDescription(), tile > 0);
                if (!parts) continue;
                EXPECT_EQ(plain.header(1).name(), "albedo");
                EXPECT_EQ(plain.header(3).name(), "matte00");
                EXPECT_EQ(plain.header(4).name(), "ids") << "integers are last";
                EXPECT_EQ(plain.header(1).type(), tile > 0 ? Imf::TILEDIMAGE : Imf::SCANLINEIMAGE);
                EXPECT_EQ(plain.header(2).compression(),
                          is_lossy(compression) ? Imf::ZIP_COMPRESSION : plain.header(0).compression());
            }
        }
    }
}

TEST_F(ExrLayouts, BytesDoNotDependOnThreads) {
    for (const ExrLayout& layout : {ExrLayout{ExrCompression::piz, true, 0}, {ExrCompression::dwab, true, 128}}) {
        std::vector<std::string> files;
        for (const int threads : {0, 1, 5}) {
            written(layout);  // starts OpenEXR's thread pool
            Imf::setGlobalThreadCount(threads);
            written(layout);
            files.push_back(read_file(path, 1 << 30));
        }
        EXPECT_EQ(files[0], files[1]);
        EXPECT_EQ(files[0], files[2]);
    }
}

TEST_F(ExrLayouts, WindowsAndNumbers) {
    ExrAttributes attributes;
    attributes.origin = {-20, 30};
    attributes.display = ivec2(100, 400);
    attributes.numbers = {{"aperture", 2.8f}, {"renderTime", 12.5f}};
    attributes.counts = {{"samples", 64}};
    for (const ExrLayout& layout : {ExrLayout{}, {ExrCompression::zip, true, 0}, {ExrCompression::zip, false, 32}}) {
        const ExrFile file = written(layout, attributes);
        EXPECT_EQ(file.width, 150);
        EXPECT_EQ(file.height, 300);
        EXPECT_EQ(file.attributes.origin, attributes.origin);
        EXPECT_EQ(file.attributes.display, attributes.display);
        EXPECT_EQ(file.attributes.numbers, attributes.numbers);
        EXPECT_EQ(file.attributes.counts, attributes.counts);
        EXPECT_EQ(difference(file, "albedo.B", albedo, 2), 0);
        const Imf::MultiPartInputFile plain(path.c_str());
        for (int part = 0; part < plain.parts(); ++part) {
            EXPECT_EQ(plain.header(part).displayWindow(), Imath::Box2i({0, 0}, {99, 399}));
            EXPECT_EQ(plain.header(part).dataWindow(), Imath::Box2i({-20, 30}, {129, 329}));
        }
    }
}

TEST_F(ExrLayouts, EveryTruncationOfPartsIsAnError) {
    written({ExrCompression::zip, true, 0});
    const std::string whole = read_file(path, 1 << 30);
    for (std::size_t length = 100; length < whole.size(); length += whole.size() / 40) {
        write_file(path, whole.substr(0, length));
        EXPECT_THROW(read_exr(path), Error) << length << " of " << whole.size() << " bytes";
    }
}

TEST_F(ExrLayouts, EveryChannelHasAView) {
    const std::vector<std::string> names{"left", "right"};
    std::vector<ExrLayerView> eyes;
    for (const int view : {0, 1})
        for (ExrLayerView layer : layers()) {
            layer.view = view;
            eyes.push_back(layer);
        }
    ExrAttributes attributes;
    attributes.views = names;
    std::vector<std::string> channels[2];
    for (const bool parts : {false, true}) {
        write_exr_views(path, eyes, attributes, {ExrCompression::zip, parts, 0});
        const ExrFile file = read_exr(path);
        EXPECT_EQ(file.attributes.views, names);
        for (const ExrChannel& channel : file.channels) {
            channels[parts].push_back(channel.name);
            EXPECT_NE(Imf::viewFromChannelName(channel.name, names), "") << channel.name;
        }
        std::ranges::sort(channels[parts]);
        EXPECT_EQ(difference(file, "albedo.right.G", albedo, 1), 0);
        // Readers of OpenEXR find the view in the attribute of a part.
        const Imf::MultiPartInputFile plain(path.c_str());
        EXPECT_EQ(plain.parts(), parts ? 10 : 1);
        EXPECT_EQ(Imf::hasMultiView(plain.header(0)), !parts);
        if (!parts) continue;
        EXPECT_EQ(plain.header(5).view(), "right");
        EXPECT_EQ(plain.header(5).name(), "albedo.right");
        EXPECT_TRUE(plain.header(5).channels().findChannel("albedo.R"));
    }
    EXPECT_EQ(channels[0], channels[1]);
    EXPECT_TRUE(Imf::areCounterparts("albedo.left.R", "albedo.right.R", names));
}

TEST_F(ExrLayouts, WrongLayoutsAreRefused) {
    EXPECT_NE(error_message([&] {
                  written({ExrCompression::zip, false, 8});
              }).find("tiles of 8 pixels"),
              std::string::npos);
    const ExrLayerView twice[] = {{.channels = {"a.R"}, .image = numbers}, {.channels = {"a.G"}, .image = numbers}};
    EXPECT_NE(error_message([&] {
                  write_exr_views(path, twice, {}, {ExrCompression::zip, true, 0});
              }).find("part a comes twice"),
              std::string::npos);
    EXPECT_NE(error_message([] { exr_compression_named("pizz"); }).find("did you mean 'piz'?"), std::string::npos);
    EXPECT_TRUE(folder.entries().empty());
}

}  // namespace
}  // namespace halflight
