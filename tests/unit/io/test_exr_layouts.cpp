// Tests layouts of OpenEXR files: compression, parts, tiles, windows, views.
#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfMultiPartInputFile.h>
#include <ImfMultiView.h>
#include <ImfOutputFile.h>
#include <ImfPartType.h>
#include <ImfStandardAttributes.h>
#include <ImfThreading.h>
#include <ImfVersion.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <span>
#include <tuple>

#include "engine/core/error.h"
#include "engine/io/files.h"
#include "tests/support/error_message.h"
#include "tests/unit/io/exr_test.h"

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

class ExrLayouts : public Exr {
  protected:
    static constexpr int kWidth = 70, kHeight = 260;  // more than a tile of 64 pixels and a block of 256 rows

    /// Returns the layers of a picture: colour, half and float, data and ids.
    std::vector<ExrLayerView> layers() const {
        return {{.channels = {"R", "G", "B", "A"}, .image = color, .type = ExrType::half, .name = "rgba"},
                {.channels = {"albedo.R", "albedo.G", "albedo.B"}, .image = albedo, .name = "albedo"},
                {.channels = {"normal.X", "normal.Y", "normal.Z"}, .image = normal, .exact = true, .name = "normal"},
                {.channels = {"ids.instance"}, .image = numbers, .type = ExrType::uint32, .exact = true},
                {.channels = {"matte00.R", "matte00.G"}, .image = matte, .exact = true}};
    }
    ExrFile written(const ExrLayout& layout, const ExrAttributes& attributes = {}) const {
        write_exr_views(path_, layers(), attributes, layout);
        return read_exr(path_);
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

    const Image color = waves(kWidth, kHeight, 4), albedo = waves(kWidth, kHeight, 3),
                normal = waves(kWidth, kHeight, 3), matte = waves(kWidth, kHeight, 2), numbers = ids(kWidth, kHeight);
};

TEST_F(ExrLayouts, DefaultIsASinglePartZippedScanLineFile) {
    written({});
    const Imf::MultiPartInputFile file(path_.c_str());
    EXPECT_EQ(file.parts(), 1);
    EXPECT_EQ(Imf::getVersion(file.version()), 2);
    EXPECT_EQ(Imf::getFlags(file.version()), 0) << "neither tiled, deep nor multi-part, no long names";
    EXPECT_EQ(file.header(0).compression(), Imf::ZIP_COMPRESSION);
    EXPECT_EQ(file.header(0).lineOrder(), Imf::INCREASING_Y);
    EXPECT_EQ(file.header(0).channels()["A"].type, Imf::HALF);
    EXPECT_EQ(file.header(0).channels()["normal.X"].type, Imf::FLOAT);
}

TEST_F(ExrLayouts, EveryCompressionInLinesPartsAndTiles) {
    for (const ExrCompression compression : kExrCompressions) {
        for (const auto& [parts, tile] : {std::pair(false, 0), {false, 64}, {true, 0}, {true, 64}}) {
            const ExrLayout layout{compression, parts, tile};
            SCOPED_TRACE(testing::Message() << name(compression) << ", parts " << parts << ", tiles " << tile);
            if (is_lossy(compression) && !parts) {
                EXPECT_NE(error_message([&] { written(layout); }).find("normal.X"), std::string::npos);
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

            const Imf::MultiPartInputFile plain(path_.c_str());
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

TEST_F(ExrLayouts, BytesDoNotDependOnThreads) {
    written({});  // starts OpenEXR's thread pool
    const int usual = Imf::globalThreadCount();
    for (const ExrLayout& layout : {ExrLayout{}, {ExrCompression::piz, true, 0}, {ExrCompression::dwab, true, 128}}) {
        std::set<std::string> files;
        for (const int threads : {0, 1, 5}) {
            Imf::setGlobalThreadCount(threads);
            written(layout);
            files.insert(read_file(path_, 1 << 30));
        }
        EXPECT_EQ(files.size(), 1u);
    }
    Imf::setGlobalThreadCount(usual);
}

TEST_F(ExrLayouts, WindowsAndNumbers) {
    ExrAttributes attributes;
    attributes.origin = {-20, 30};
    attributes.display = ivec2(100, 400);
    attributes.numbers = {{"aperture", 2.8f}, {"renderTime", 12.5f}};
    attributes.counts = {{"samples", 64}};
    for (const ExrLayout& layout : {ExrLayout{}, {ExrCompression::zip, true, 0}, {ExrCompression::zip, false, 32}}) {
        const ExrFile file = written(layout, attributes);
        EXPECT_EQ(ivec2(file.width, file.height), ivec2(kWidth, kHeight));
        const ExrAttributes& read = file.attributes;
        EXPECT_EQ(std::tie(read.origin, read.display, read.numbers, read.counts),
                  std::tie(attributes.origin, attributes.display, attributes.numbers, attributes.counts));
        EXPECT_EQ(difference(file, "albedo.B", albedo, 2), 0);
        const Imf::MultiPartInputFile plain(path_.c_str());
        for (int part = 0; part < plain.parts(); ++part) {
            EXPECT_EQ(plain.header(part).displayWindow(), Imath::Box2i({0, 0}, {99, 399}));
            EXPECT_EQ(plain.header(part).dataWindow(), Imath::Box2i({-20, 30}, {-20 + kWidth - 1, 30 + kHeight - 1}));
        }
    }
}

TEST_F(ExrLayouts, DisplayWindowsOfOthersBeginAnywhere) {
    Imf::Header header(Imath::Box2i({10, 20}, {109, 219}), Imath::Box2i({5, 40}, {8, 41}));
    header.channels().insert("Y", Imf::Channel(Imf::FLOAT));
    std::vector<float> values(8, 1.0f);
    Imf::FrameBuffer buffer;
    buffer.insert("Y", Imf::Slice::Make(Imf::FLOAT, values.data(), header.dataWindow()));
    {
        Imf::OutputFile file(path_.c_str(), header);
        file.setFrameBuffer(buffer);
        file.writePixels(2);
    }
    const ExrAttributes read = read_exr(path_).attributes;
    EXPECT_EQ(read.origin, ivec2(-5, 20));
    EXPECT_EQ(read.display, ivec2(100, 200));
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
        write_exr_views(path_, eyes, attributes, {ExrCompression::zip, parts, 0});
        const ExrFile file = read_exr(path_);
        EXPECT_EQ(file.attributes.views, names);
        for (const ExrChannel& channel : file.channels) {
            channels[parts].push_back(channel.name);
            EXPECT_NE(Imf::viewFromChannelName(channel.name, names), "") << channel.name;
        }
        std::ranges::sort(channels[parts]);
        EXPECT_EQ(difference(file, "albedo.right.G", albedo, 1), 0);
        // Readers of OpenEXR find the view in the attribute of a part.
        const Imf::MultiPartInputFile plain(path_.c_str());
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
    EXPECT_THROW(written({ExrCompression::zip, false, 8}), Error);
    const ExrLayerView twice[] = {{.channels = {"a.R"}, .image = numbers}, {.channels = {"a.G"}, .image = numbers}};
    EXPECT_THROW(write_exr_views(path_, twice, {}, {ExrCompression::zip, true, 0}), Error);
    EXPECT_NE(error_message([] { exr_compression_named("pizz"); }).find("did you mean 'piz'?"), std::string::npos);
    EXPECT_TRUE(folder_.entries().empty());
}

}  // namespace
}  // namespace halflight
