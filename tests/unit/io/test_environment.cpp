// Tests environment maps: values, orientation, repair, and damaged files.
#include <ImfEnvmap.h>
#include <ImfStandardAttributes.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>

#include "engine/core/error.h"
#include "engine/core/image_tools.h"
#include "engine/io/environment.h"
#include "engine/io/exr.h"
#include "engine/io/files.h"
#include "engine/io/radiance.h"
#include "tests/support/error_message.h"
#include "tests/unit/io/exr_parts.h"
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
    // Scan lines may be columns.
    for (const auto& [order, texels] : {std::pair("-X 1 -Y 4", "0123"),
                                        {"+X 1 +Y 4", "3210"},
                                        {"+X 2 -Y 2", "0213"},
                                        {"+X 2 +Y 2", "1302"},
                                        {"-X 2 -Y 2", "2031"},
                                        {"-X 2 +Y 2", "3120"},
                                        {"-Y 2 -X 2", "1032"},
                                        {"+Y 2 +X 2", "2301"}}) {
        e = load_bytes(hdr("", order, pixels));
        for (std::size_t i = 0; i < 4; ++i) {
            const auto stored = static_cast<std::size_t>(texels[i] - '0');
            EXPECT_EQ(e.map.pixels[3 * i], expected[3 * stored]) << order << ", " << i;
        }
    }
}

TEST_F(EnvironmentMap, RadianceHeadersAreAppliedOrNamed) {
    const std::vector<int> pixels = {128, 64, 255, 129, 200, 100, 50, 128};
    const Environment plain = load_bytes(hdr("", "-Y 1 +X 2", pixels));
    const auto expect_converted = [&](const Environment& e, const Chromaticities& from) {
        const dmat3 matrix = rgb_conversion(from, kRec709);
        for (std::size_t i = 0; i < 6; i += 3) {
            const dvec3 colour = matrix * dvec3(plain.map.pixels[i], plain.map.pixels[i + 1], plain.map.pixels[i + 2]);
            for (int c = 0; c < 3; ++c)
                EXPECT_NEAR(e.map.pixels[i + static_cast<std::size_t>(c)], std::max(colour[c], 0.0), 1e-5);
        }
    };
    const Chromaticities rec2020{{0.708, 0.292}, {0.170, 0.797}, {0.131, 0.046}, {0.3127, 0.3290}};
    const std::string primaries = "PRIMARIES= 0.708 0.292 0.170 0.797 0.131 0.046 0.3127 0.3290\n";
    expect_converted(load_bytes(hdr(primaries, "-Y 1 +X 2", pixels)), rec2020);
    std::string xyz = hdr("", "-Y 1 +X 2", pixels);
    xyz.replace(xyz.find("rgbe"), 4, "xyze");
    expect_converted(load_bytes(xyz), {{1, 0}, {0, 1}, {0, 0}, {1 / 3.0, 1 / 3.0}});
    EXPECT_EQ(load_bytes(hdr("PRIMARIES=0 0 0 0 0 0 0 0\n", "-Y 1 +X 2", pixels)).map.pixels, plain.map.pixels);
    EXPECT_TRUE(report_.warnings.empty());

    const Environment same =
        load_bytes(hdr("EXPOSURE=2\nEXPOSURE= 2\nCOLORCORR=1 2 0.5\nCOLORCORR= 2 1 1\nPIXASPECT=2\nPIXASPECT=0.25\n"
                       "VIEW= -vtv -vh 45\nGAMMA=1\nGAMMA=2.2\n\tEXPOSURE=3\n",
                       "-Y 1 +X 2", pixels));
    EXPECT_EQ(same.map.pixels, plain.map.pixels);
    ASSERT_EQ(report_.warnings.size(), 5u);
    const char* const named[] = {"VIEW= -vtv", "GAMMA=2.2 ", "EXPOSURE 4 ", "COLORCORR 2 2 0.5 ", "PIXASPECT 0.5 "};
    for (std::size_t i = 0; i < 5; ++i)
        EXPECT_NE(report_.warnings[i].find(named[i]), std::string::npos) << report_.warnings[i];
    for (const char* line : {"PRIMARIES=", "PRIMARIES=0.6 0.3 0.2", "PRIMARIES=1 2 3 4 5 6 7", "EXPOSURE=1,5",
                             "EXPOSURE=", "COLORCORR=1 2", "PIXASPECT=a"}) {
        report_ = {};
        EXPECT_EQ(load_bytes(hdr(line + std::string("\n"), "-Y 1 +X 2", pixels)).map.pixels, plain.map.pixels);
        ASSERT_EQ(report_.warnings.size(), 1u) << line;
        EXPECT_NE(report_.warnings[0].find(std::string(line) + " is ignored"), std::string::npos)
            << report_.warnings[0];
    }
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
        hdr("", "-Y 1 -Y 8", row),                                // bad orders
        hdr("", "+X 8 +X 1", row),                                //
        hdr("", "-Y 0 +X 8", row),                                // bad resolutions
        hdr("", "-Y 99999999999 +X 8", row),                      //
        hdr("", "-Y 1 +X 16385", row),                            // a side beyond the limit
        "#?RADIANCE\nFORMAT=32-bit_rle_hsve\n\n-Y 1 +X 1\nabcd",  // another format of pixels
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
        load_exr({{channels("ViewLayer.GlossInd"), ids}, {channels(picture), light}, {channels("crypto00"), ids}});
    EXPECT_EQ(named.map.pixels, light.pixels);
    ASSERT_EQ(report_.warnings.size(), 1u);
    EXPECT_NE(report_.warnings[0].find("'" + picture + "'"), std::string::npos);
    const Environment alone = load_exr({{channels("CryptoObject00"), ids}, {channels("sky"), light}});
    EXPECT_EQ(alone.map.pixels, light.pixels);
    EXPECT_EQ(report_.warnings.size(), 1u);
    EXPECT_THROW(load_exr({{channels("CryptoObject00"), ids}}), Error);
    report_ = {};
    const Image grey = image_of(4, 2, 1, std::vector<float>(8, 2.0f));
    EXPECT_EQ(load_exr({{channels("albedo"), ids}, {channels("sky"), light}}).map.pixels, light.pixels);
    EXPECT_THROW(load_exr({{channels("variance"), ids}}), Error);
    EXPECT_TRUE(report_.warnings.empty());
    EXPECT_EQ(load_exr({{{"Y"}, grey}, {channels("fill"), ids}}).map.pixels, light.pixels);
    ASSERT_EQ(report_.warnings.size(), 1u);
    EXPECT_NE(report_.warnings[0].find("layer 'fill'"), std::string::npos);
    EXPECT_EQ(load_exr({{{"Y"}, Image(4, 2, 1)}, {channels("beauty"), light}}).map.pixels, light.pixels);
    report_ = {};
    EXPECT_EQ(load_exr({{{"R", "G", "B"}, light}, {channels("fill"), ids}}).map.pixels, light.pixels);
    EXPECT_TRUE(report_.warnings.empty());
    ExrAttributes stereo;
    stereo.views = {"left", "right"};
    EXPECT_EQ(load_exr({{{"R", "G", "B"}, light}, {channels("right"), ids}}, stereo).map.pixels, light.pixels);
    ASSERT_EQ(report_.warnings.size(), 1u);
    EXPECT_NE(report_.warnings[0].find("layer 'right'"), std::string::npos);
}

TEST_F(EnvironmentMap, LuminanceAndOddChannels) {
    const Image grey = image_of(2, 1, 1, {0.25f, 4});
    const std::vector<float> expected = {0.25f, 0.25f, 0.25f, 4, 4, 4};
    EXPECT_EQ(load_exr({{{"Y"}, grey}}).map.pixels, expected);
    EXPECT_EQ(load_exr({{{"Y"}, grey}, {{"A"}, Image(2, 1, 1)}}).map.pixels, expected);
    EXPECT_EQ(load_exr({{{"sky.Y"}, grey}, {{"sky.A"}, Image(2, 1, 1)}}).map.pixels, expected);
    const std::vector<std::vector<std::string>> dark = {{"sky"},         {"Z"},
                                                        {"A"},           {"id"},
                                                        {"mask"},        {"R"},
                                                        {"depth.Y"},     {"uv.X", "uv.Y"},
                                                        {"X", "Y", "Z"}, {"N.R", "N.G", "N.B"}};
    for (const std::vector<std::string>& names : dark) {
        const int channels = static_cast<int>(names.size());
        const std::string error = error_message([&] { load_exr({{names, Image(2, 1, channels)}}); });
        EXPECT_NE(error.find("has no light, R, G, B or Y, among its channels: "), std::string::npos) << error;
    }
    EXPECT_TRUE(report_.warnings.empty());
}

TEST_F(EnvironmentMap, PartsWithoutLightAreNoLight) {
    const Imath::Box2i display({0, 0}, {3, 1}), window({1, 0}, {9, 4});
    const std::map<std::string, test::PartChannel> light{
        {"R", test::constant(1)}, {"G", test::constant(2)}, {"B", test::constant(3)}};
    const std::map<std::string, test::PartChannel> far{{"Z", test::constant(100)}, {"Y", test::constant(100)}};
    const auto load = [&](const std::vector<test::ExrPart>& parts) {
        report_ = {};
        test::write_exr_parts(path_, display, parts);
        return load_environment(path_, report_);
    };
    const auto is_light = [](const Environment& e) {
        const Image& map = e.map;
        return map.width == 4 && map.height == 2 && map.pixels[0] == 1 && map.pixels[1] == 2 && map.pixels[23] == 3;
    };
    EXPECT_TRUE(is_light(load({{"depth", display, far}, {"rgba", display, light}})));
    EXPECT_TRUE(report_.warnings.empty());
    EXPECT_TRUE(is_light(load({{"depth", window, far}, {"rgba", display, light}})));
    EXPECT_TRUE(is_light(load({{"normal", display, light}, {"sky", display, light}})));
    EXPECT_TRUE(report_.warnings.empty());
    EXPECT_TRUE(is_light(load({{"a", display, light}, {"deep", window, {{"Z", {}}}, true}, {"b", display, light}})));
    ASSERT_EQ(report_.warnings.size(), 2u);
    EXPECT_NE(report_.warnings[0].find("part 'deep'"), std::string::npos);
    EXPECT_NE(report_.warnings[1].find("R, G, B of part 'a'; ignored: layer 'b'"), std::string::npos);
    EXPECT_EQ(load({{"fill", display, light}, {"beauty", display, {{"Y", test::constant(7)}}}}).map.pixels[1], 7);
    EXPECT_EQ(report_.warnings.size(), 1u);
    EXPECT_TRUE(is_light(load({{"normal", display, light}})));  // the only part is the picture
    EXPECT_THROW(load({{"normal", display, light}, {"id", display, {{"id", test::constant(1)}}}}), Error);
    EXPECT_THROW(load({{"depth", display, far}, {"id", display, {{"id", test::constant(1)}}}}), Error);
}

TEST_F(EnvironmentMap, TheDisplayWindowIsTheSphere) {
    Image whole(8, 4, 3);
    for (int y = 1; y < 3; ++y)  // black outside of a crop
        for (int x = 2; x < 6; ++x) std::fill_n(whole.at(x, y), 3, static_cast<float>(1 + x + 8 * y));
    const auto load = [&](const ivec2& origin, const Image& image) {
        report_ = {};
        ExrAttributes attributes;
        attributes.origin = origin, attributes.display = ivec2(8, 4);
        return load_exr({{{"R", "G", "B"}, image}}, attributes).map;
    };
    EXPECT_TRUE(same_bits(load({0, 0}, whole), whole));
    EXPECT_TRUE(report_.warnings.empty());
    EXPECT_TRUE(same_bits(load({2, 1}, part_of(whole, {2, 1}, {4, 2})), whole));
    ASSERT_EQ(report_.warnings.size(), 1u);
    EXPECT_NE(report_.warnings[0].find("2,1 to 6,3 of 8 x 4"), std::string::npos);
    Image wide(10, 6, 3);
    std::ranges::fill(wide.pixels, 9.0f);
    for (int y = 0; y < 4; ++y) std::copy_n(whole.at(0, y), 8 * 3, wide.at(1, y + 1));
    EXPECT_TRUE(same_bits(load({-1, -1}, wide), whole));
    ASSERT_EQ(report_.warnings.size(), 1u);
    EXPECT_NE(report_.warnings[0].find("outside"), std::string::npos);
}

TEST_F(EnvironmentMap, CubesBecomeEquirectangular) {
    constexpr int kFace = 16;
    const Imath::Box2i window({0, 0}, {kFace - 1, 6 * kFace - 1});
    const auto direction = [&](int x, int y, int axis) {
        // pixelPosition() maps places in a face to pixels, so its inverse is found by a search.
        const auto face = static_cast<Imf::CubeMapFace>(y / kFace);
        for (int i = 0; i < kFace; ++i)
            for (int j = 0; j < kFace; ++j) {
                const Imath::V2f in_face(static_cast<float>(i), static_cast<float>(j));
                const Imath::V2f place = Imf::CubeMap::pixelPosition(face, window, in_face);
                if (static_cast<int>(place.x) == x && static_cast<int>(place.y) == y)
                    return Imf::CubeMap::direction(face, window, in_face)[axis];
            }
        return 0.0f;
    };
    const auto channel = [&](int axis) {
        return test::PartChannel{[&direction, axis](int x, int y) { return 2 + direction(x, y, axis); }};
    };
    const auto as_cube = [](Imf::Header& header) { Imf::addEnvmap(header, Imf::ENVMAP_CUBE); };
    test::write_exr_parts(path_, window, {{"", window, {{"R", channel(0)}, {"G", channel(1)}, {"B", channel(2)}}}},
                          as_cube);
    const Environment e = load_environment(path_, report_);
    EXPECT_TRUE(report_.warnings.empty());
    // The data window is the map, whatever is displayed.
    test::write_exr_parts(path_, Imath::Box2i({0, 0}, {99, 49}),
                          {{"", window, {{"R", channel(0)}, {"G", channel(1)}, {"B", channel(2)}}}}, as_cube);
    EXPECT_EQ(load_environment(path_, report_).map.pixels, e.map.pixels);
    EXPECT_EQ(report_.warnings.size(), 1u);
    ASSERT_EQ(ivec2(e.map.width, e.map.height), ivec2(4 * kFace, 2 * kFace));
    for (int y = 0; y < e.map.height; ++y)
        for (int x = 0; x < e.map.width; ++x) {
            // ImfEnvmap.h: longitude falls from pi to -pi; 0 points to +z, and pi / 2 to +x.
            const double longitude = kPi * (1 - (2 * x + 1.0) / e.map.width);
            const double latitude = kPi * (0.5 - (y + 0.5) / e.map.height);
            dvec3 expected(std::sin(longitude) * std::cos(latitude), std::sin(latitude),
                           std::cos(longitude) * std::cos(latitude));
            expected /= std::max({std::abs(expected.x), std::abs(expected.y), std::abs(expected.z)});
            for (int c = 0; c < 3; ++c)  // the mean over a texel lacks the tip of edges
                ASSERT_NEAR(e.map.at(x, y)[c], 2 + expected[c], 0.04) << x << ", " << y << ", channel " << c;
        }
    const Imath::Box2i square({0, 0}, {3, 3});
    test::write_exr_parts(path_, square, {{"", square, {{"Y", test::constant(1)}}}}, as_cube);
    EXPECT_NE(error_message([&] { load_environment(path_, report_); }).find("cube map of 4 x 4"), std::string::npos);
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
    attributes.chromaticities = Chromaticities{{0, 0}, {0, 0}, {0, 0}, {0.3, 0.3}};
    EXPECT_THROW(load_exr({{{"R", "G", "B"}, image}}, attributes), Error);
    attributes.chromaticities = Chromaticities{{0, 0}, {0, 0}, {0, 0}, {0, 0}};
    EXPECT_EQ(load_exr({{{"R", "G", "B"}, image}}, attributes).map.pixels, image.pixels) << "not known, as in a .hdr";
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
