// Tests environment maps: values, orientation, repair, and damaged files.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>

#include "engine/core/error.h"
#include "engine/io/environment.h"
#include "engine/io/exr.h"
#include "engine/io/files.h"
#include "engine/io/radiance.h"
#include "tests/support/error_message.h"
#include "tools/common/temporary_folder.h"

namespace halflight {
namespace {

namespace fs = std::filesystem;

const fs::path kAssets = fs::path(HALFLIGHT_SHARED_DIR) / "assets";
constexpr float kInf = std::numeric_limits<float>::infinity();
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

class EnvironmentMap : public testing::Test {
  protected:
    void TearDown() override { fs::remove(path_); }

    Environment load_bytes(const std::string& bytes) {
        std::ofstream(path_, std::ios::binary) << bytes;  // write_file() would wait for the disk
        return load_environment(path_, report_);
    }
    Environment load_exr(const std::vector<ExrLayer>& layers, const ExrAttributes& attributes = {}) {
        write_exr(path_, layers, attributes);
        return load_environment(path_, report_);
    }

    const TemporaryFolder folder_;
    const fs::path path_ = folder_ / "map";
    SceneReport report_;
};

Image image_of(int width, int height, int channels, std::vector<float> pixels) {
    Image image(width, height, channels);
    image.pixels = std::move(pixels);
    return image;
}

std::string hdr(const std::string& header, const std::string& resolution, const std::vector<int>& bytes) {
    std::string file = "#?RADIANCE\n" + header + "FORMAT=32-bit_rle_rgbe\n\n" + resolution + "\n";
    for (int b : bytes) file.push_back(static_cast<char>(b));
    return file;
}

TEST_F(EnvironmentMap, RadianceValuesAndOrientation) {
    // A value is mantissa * 2^(exponent - 136): (128, 64, 255, 129) is 1, 0.5, 1.9921875.
    const std::vector<int> pixels = {128, 64, 255, 129, 200, 100, 50, 128, 10, 20, 30, 140, 7, 7, 7, 0};
    const std::vector<float> expected = {1, 0.5f, 1.9921875f, 0.78125f, 0.390625f, 0.1953125f, 160, 320, 480, 0, 0, 0};
    Environment e = load_bytes(hdr("", "-Y 1 +X 4", pixels));
    EXPECT_EQ(e.map.width, 4);
    EXPECT_EQ(e.map.height, 1);
    EXPECT_EQ(e.map.pixels, expected);
    EXPECT_EQ(e.color, vec3(1));
    EXPECT_EQ(report_.environment_texels_repaired, 0u);
    EXPECT_EQ(report_.warnings.size(), 1u) << "4 x 1 is not 2:1";

    e = load_bytes(hdr("", "+Y 2 -X 2", pixels));  // rows from bottom to top, columns from right to left
    EXPECT_EQ(e.map.pixels,
              (std::vector<float>{0, 0, 0, 160, 320, 480, 0.78125f, 0.390625f, 0.1953125f, 1, 0.5f, 1.9921875f}));
    load_bytes(hdr("EXPOSURE=2\nEXPOSURE= 2\n", "-Y 1 +X 4", pixels));
    EXPECT_NE(report_.warnings.at(report_.warnings.size() - 2).find("EXPOSURE 4"), std::string::npos);
}

TEST_F(EnvironmentMap, RadianceRunLengths) {
    // New encoding: red is 8 times 9, green is 3 times 1 and 5 literals, blue and exponent are 8 times 130.
    const std::vector<int> row = {2, 2, 0, 8, 136, 9, 131, 1, 5, 11, 12, 13, 14, 15, 136, 3, 136, 136};
    EXPECT_EQ(load_bytes(hdr("", "-Y 1 +X 8", row)).map.pixels,
              (std::vector<float>{9, 1,  3, 9, 1,  3, 9, 1,  3, 9, 11, 3,  //
                                  9, 12, 3, 9, 13, 3, 9, 14, 3, 9, 15, 3}));
    // The old encoding holds a pixel, 2 repetitions, then a pixel with 1 + 1 * 256 repetitions.
    std::vector<int> old = {5, 6, 7, 136, 1, 1, 1, 2, 8, 8, 8, 136, 1, 1, 1, 1, 1, 1, 1, 1};
    const Environment repeated = load_bytes(hdr("", "-Y 1 +X 261", old));
    EXPECT_EQ(repeated.map.pixels[3 * 2 + 2], 7);
    EXPECT_EQ(repeated.map.pixels[3 * 3], 8);
    EXPECT_EQ(repeated.map.pixels[3 * 260], 8);
}

TEST_F(EnvironmentMap, DamagedFilesAreErrors) {
    const std::vector<int> row = {2, 2, 0, 8, 136, 9, 136, 1, 136, 3, 136, 136};
    const std::string whole = hdr("", "-Y 1 +X 8", row);
    EXPECT_NO_THROW(load_bytes(whole));
    std::vector<std::string> damaged = {
        hdr("", "-Y 1 +X 8", {2, 2, 0, 9, 136, 9}),               // bad length of a row
        hdr("", "-Y 1 +X 8", {2, 2, 0, 8, 137, 9}),               // bad lengths of runs
        hdr("", "-Y 1 +X 8", {2, 2, 0, 8, 0, 0, 0, 0, 0}),        //
        hdr("", "-Y 1 +X 8", {1, 1, 1, 8}),                       //
        hdr("", "-Y 1 +X 8", {9, 9, 9, 9, 1, 1, 1, 8}),           //
        hdr("", "+X 8 -Y 1", row),                                // columns before rows
        hdr("", "-Y 0 +X 8", row),                                // bad resolutions
        hdr("", "-Y 99999999999 +X 8", row),                      //
        hdr("", "-Y 1 +X 16385", row),                            // beyond the limit
        "#?RADIANCE\nFORMAT=32-bit_rle_xyze\n\n-Y 1 +X 1\nabcd",  // another format of pixels
        "\x89PNG\r\n\x1a\n",
    };
    for (std::size_t length = 0; length < whole.size(); ++length) damaged.push_back(whole.substr(0, length));
    for (const std::string& bytes : damaged)
        EXPECT_TRUE(error_message([&] { load_bytes(bytes); }).starts_with(path_.string() + ": ")) << bytes;
    const std::string pointer = error_message([&] { load_bytes("version https://git-lfs.github.com/spec/v1\n"); });
    EXPECT_NE(pointer.find("Git LFS pointer"), std::string::npos) << pointer;
}

TEST_F(EnvironmentMap, OpenExrKeepsValuesAndOrientation) {
    Image image(8, 4, 3);
    for (std::size_t i = 0; i < image.pixels.size(); ++i) image.pixels[i] = static_cast<float>(i);
    const Environment e = load_exr({{{"R", "G", "B"}, image}});
    EXPECT_EQ(e.map.pixels, image.pixels);
    EXPECT_TRUE(report_.warnings.empty());
    const Environment layered = load_exr({{{"sky.R", "sky.G", "sky.B"}, image}, {{"sky.A"}, Image(8, 4, 1)}});
    EXPECT_EQ(layered.map.pixels, image.pixels);
    EXPECT_TRUE(report_.warnings.empty());
}

TEST_F(EnvironmentMap, PicturesAreFoundAmongLayers) {
    const Image ids(4, 2, 3);
    Image light(4, 2, 3);
    for (float& v : light.pixels) v = 2;
    const auto channels = [](const std::string& layer) {
        return std::vector<std::string>{layer + ".R", layer + ".G", layer + ".B"};
    };
    const std::string picture = "ViewLayer.Combined";
    const Environment named =
        load_exr({{channels("ViewLayer.AlbedoColor"), ids}, {channels(picture), light}, {channels("crypto00"), ids}});
    EXPECT_EQ(named.map.pixels, light.pixels);
    ASSERT_EQ(report_.warnings.size(), 1u);
    EXPECT_NE(report_.warnings[0].find("'" + picture + "'"), std::string::npos);
    const Environment alone = load_exr({{channels("CryptoObject00"), ids}, {channels("sky"), light}});
    EXPECT_EQ(alone.map.pixels, light.pixels);
    EXPECT_EQ(report_.warnings.size(), 1u);
    EXPECT_THROW(load_exr({{channels("CryptoObject00"), ids}}), Error);
}

TEST_F(EnvironmentMap, LuminanceAndOddChannels) {
    const Image grey = image_of(2, 1, 1, {0.25f, 4});
    const std::vector<float> expected = {0.25f, 0.25f, 0.25f, 4, 4, 4};
    EXPECT_EQ(load_exr({{{"Y"}, grey}}).map.pixels, expected);
    EXPECT_EQ(load_exr({{{"Y"}, grey}, {{"A"}, Image(2, 1, 1)}}).map.pixels, expected);
    EXPECT_EQ(load_exr({{{"sky"}, grey}}).map.pixels, expected);
    EXPECT_THROW(load_exr({{{"U", "V"}, Image(2, 1, 2)}}), Error);
}

TEST_F(EnvironmentMap, RepairsAndCounts) {
    const Image bad = image_of(4, 2, 3, {kNan, 1, 2, kInf, 1, 1, -1, -2, 3, -kInf, 0, 0,  //
                                         1,    2, 3, 100,  5, 6, 0,  0,  0, 7,     7, 7});
    const Environment e = load_exr({{{"R", "G", "B"}, bad}});
    EXPECT_EQ(e.map.pixels, (std::vector<float>{0, 1, 2, 100, 1, 1, 0, 0, 3, 0, 0, 0,  //
                                                1, 2, 3, 100, 5, 6, 0, 0, 0, 7, 7, 7}));
    EXPECT_EQ(report_.environment_texels_repaired, 4u);
    EXPECT_EQ(report_.warnings.size(), 1u);
}

TEST_F(EnvironmentMap, BlackMapsGiveABlackEnvironment) {
    const Environment e = load_exr({{{"R", "G", "B"}, Image(4, 2, 3)}});
    EXPECT_TRUE(e.black());
    EXPECT_TRUE(e.map.pixels.empty());
    EXPECT_EQ(report_.warnings.size(), 1u);
}

TEST_F(EnvironmentMap, OtherPrimariesAreConverted) {
    const Image image = image_of(2, 1, 3, {1, 1, 1, 0.2f, 0.5f, 0.1f});
    ExrAttributes attributes;
    attributes.chromaticities = kAp1;
    const Environment e = load_exr({{{"R", "G", "B"}, image}}, attributes);
    for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(e.map.pixels[c], 1, 1e-5) << "white stays white";
    const dvec3 expected = rgb_conversion(kAp1, kRec709) * dvec3(0.2, 0.5, 0.1);
    for (int c = 0; c < 3; ++c)
        EXPECT_NEAR(e.map.pixels[static_cast<std::size_t>(3 + c)], std::max(0.0, expected[c]), 1e-6);
    attributes.chromaticities = Chromaticities{{0, 0}, {0, 0}, {0, 0}, {0, 0}};
    EXPECT_THROW(load_exr({{{"R", "G", "B"}, image}}, attributes), Error);
}

TEST_F(EnvironmentMap, MapsOfOtherProjects) {
    if (!fs::exists(kAssets / "env")) GTEST_SKIP() << "no assets in " << kAssets;
    int whole = 0, truncated = 0;
    for (const auto& entry : fs::directory_iterator(kAssets / "env")) {
        if (entry.path().extension() != ".hdr") continue;
        SCOPED_TRACE(++whole);
        SceneReport report;
        const Environment e = load_environment(entry.path(), report);
        EXPECT_EQ(ivec2(e.map.width, e.map.height), ivec2(1024, 512)) << entry.path();
        EXPECT_TRUE(report.warnings.empty());
        EXPECT_TRUE(std::ranges::all_of(e.map.pixels, [](float v) { return std::isfinite(v); }));
    }
    for (const auto& entry : fs::directory_iterator(kAssets / "bad/truncated")) {
        if (entry.path().extension() != ".hdr") continue;
        ++truncated;
        const std::string error = error_message([&] { load_environment(entry.path(), report_); });
        EXPECT_NE(error.find("truncated"), std::string::npos) << entry.path() << ": " << error;
    }
    EXPECT_GT(whole, 0);
    EXPECT_GT(truncated, 0);
}

}  // namespace
}  // namespace halflight
