// Tests OpenEXR files: round trips, windows, attributes by the standard's conventions, files of other programs, damaged
// files, full disks.
#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputFile.h>
#include <ImfMultiPartInputFile.h>
#include <ImfMultiView.h>
#include <ImfOutputFile.h>
#include <ImfPartType.h>
#include <ImfStandardAttributes.h>
#include <ImfTiledOutputFile.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <glm/gtc/matrix_transform.hpp>
#include <set>

#include "engine/core/error.h"
#include "engine/core/image_tools.h"
#include "engine/core/stopwatch.h"
#include "engine/io/exr.h"
#include "engine/io/files.h"
#include "tests/support/error_message.h"
#include "tests/unit/core/environment_variable.h"
#include "tests/unit/io/exr_parts.h"
#include "tests/unit/io/exr_test.h"
#include "tests/unit/io/file_size_limit.h"

namespace halflight {
namespace {

namespace fs = std::filesystem;

TEST_F(Exr, FloatsAndIdsAreExact) {
    Image data = noise(131, 77, 3);
    data.pixels[0] = std::numeric_limits<float>::infinity();
    data.pixels[1] = std::numeric_limits<float>::quiet_NaN();
    data.pixels[2] = -0.0f;
    data.pixels[3] = std::numeric_limits<float>::denorm_min();
    const Image numbers = ids(131, 77);
    write_exr(path_, {{{"P.X", "P.Y", "P.Z"}, data}, {{"id"}, numbers, ExrType::uint32}}, {});
    const ExrFile file = read_exr(path_);
    EXPECT_EQ(ivec2(file.width, file.height), ivec2(131, 77));
    expect_same(file, {"P.X", "P.Y", "P.Z"}, data);
    expect_same(file, {"id"}, numbers);
    EXPECT_EQ(file.find("id")->type, ExrType::uint32);
    EXPECT_EQ(file.image({"id"}).pixels[1], 2654435761.0f);
    EXPECT_EQ(entries(), 1u);
}

TEST_F(Exr, HeadersAreReadAlone) {
    ExrAttributes attributes;
    attributes.extra["note"] = std::string(2 << 20, 'n');
    ExrLayout layout;
    layout.parts = true;
    write_exr(path_, {{{"R", "G", "B"}, noise(131, 77, 3)}, {{"id"}, ids(131, 77), ExrType::uint32}}, attributes,
              layout);
    const ExrFile whole = read_exr(path_);
    fs::resize_file(path_, fs::file_size(path_) - 5000);
    EXPECT_THROW(read_exr(path_), Error);
    ExrFile header = read_exr_header(path_);
    EXPECT_EQ(ivec2(header.width, header.height), ivec2(131, 77));
    EXPECT_EQ(header.attributes.extra, whole.attributes.extra);
    ASSERT_EQ(header.channels.size(), whole.channels.size());
    for (std::size_t i = 0; i < header.channels.size(); ++i) {
        EXPECT_EQ(header.channels[i].name, whole.channels[i].name);
        EXPECT_EQ(header.channels[i].window, whole.channels[i].window);
        EXPECT_TRUE(header.channels[i].values.empty());
    }
    fs::resize_file(path_, 1 << 20);
    EXPECT_THROW(read_exr_header(path_), Error) << "within the header";
}

TEST_F(Exr, ColourIsConvertedWhileWriting) {
    const mat3 color(vec3(0.5f, 0.25f, 0.1f), vec3(-0.1f, 0.9f, 0.3f), vec3(2, 0, 0.7f));
    const Image image = noise(19, 600, 4);  // more rows than one conversion takes
    Image converted = image;
    for (std::size_t i = 0; i < converted.pixels.size(); i += 4) {
        const vec3 c = color * vec3(image.pixels[i], image.pixels[i + 1], image.pixels[i + 2]);
        for (int k = 0; k < 3; ++k) converted.pixels[i + std::size_t(k)] = c[k];
    }
    for (const ExrType type : {ExrType::float32, ExrType::half}) {
        const ExrLayerView views[] = {{{"R", "G", "B", "A"}, image, type, color}, {{"a", "b", "c", "d"}, image}};
        write_exr_views(path_, views, {});
        const std::string bytes = read_file(path_, 1 << 30);
        write_exr(path_, {{{"R", "G", "B", "A"}, converted, type}, {{"a", "b", "c", "d"}, image}}, {});
        EXPECT_TRUE(bytes == read_file(path_, 1 << 30));
    }
    const Image gray = noise(2, 2, 1);
    const ExrLayerView no_color[] = {{{"Y"}, gray, ExrType::float32, color}};
    EXPECT_THROW(write_exr_views(path_, no_color, {}), Error);
}

TEST_F(Exr, HalvesRoundAndDoNotOverflow) {
    Image image(2, 2, 2);
    image.pixels = {1 / 3.0f, 1e9f, -1e9f, 65519, 0.25f, 1e-9f, std::numeric_limits<float>::infinity(), -2};
    write_exr(path_, {{{"R", "G"}, image, ExrType::half}}, {});
    const ExrFile file = read_exr(path_);
    EXPECT_EQ(file.find("R")->type, ExrType::half);
    std::vector<float> read = file.image({"R", "G"}).pixels;
    EXPECT_NEAR(read[0], 1 / 3.0f, 1 / 3.0f / 2048);  // a half has a precision of 11 bits
    read[0] = 0;
    EXPECT_EQ(read, (std::vector<float>{0, 65504, -65504, 65504, 0.25f, 0, image.pixels[6], -2}));
}

TEST_F(Exr, ManyLayersInAnyOrder) {
    std::vector<ExrLayer> layers;
    for (unsigned l = 0; l < 40; ++l) {
        const std::string name = fmt::format("layer{}.", (l * 17) % 40);
        layers.push_back({{name + "B", name + "R", name + "G"}, noise(64, 50, 3, l)});
    }
    write_exr(path_, layers, {});
    const ExrFile file = read_exr(path_);
    EXPECT_EQ(file.channels.size(), 120u);
    for (const ExrLayer& layer : layers) expect_same(file, layer.channels, layer.image);
    EXPECT_EQ(file.image({"layer3.G", "layer7.B"}).channels, 2);
    EXPECT_THROW(file.image({"layer3.X"}), Error);
    std::ranges::reverse(layers);
    const std::string before = read_file(path_, 1 << 30);
    write_exr(path_, layers, {});
    EXPECT_EQ(read_file(path_, 1 << 30), before);
}

TEST_F(Exr, AttributesFollowTheStandard) {
    // The camera is at (1, 2, 8), looks down -Z, and has a field of view of 90 degrees and an aspect ratio of 2:1.
    ExrAttributes attributes;
    attributes.chromaticities = kAp1;
    attributes.world_to_camera = glm::translate(dmat4(1), dvec3(-1, -2, -8));
    attributes.world_to_clip = glm::perspective(kPi / 2, 2.0, 0.1, 100.0) * *attributes.world_to_camera;
    attributes.capture_date = "2024:02:29 12:34:56";
    attributes.software = "halflight 0.1.0";
    attributes.comments = "samples 16";
    attributes.extra = {{"halflight.bias", "none"}, {"halflight.seed", "7"}};
    write_exr(path_, {{{"Y"}, noise(4, 2, 1)}}, attributes);

    const Imf::InputFile file(path_.c_str());
    const Imf::Header& header = file.header();
    // Matrices follow ImfStandardAttributes.h: row vectors in left-handed coordinates, x to the right, y up, z > 0 in
    // front of the camera.
    const Imath::V3f point(1 + 4, 2 - 1, 8 - 4);
    Imath::V3f in_camera;
    Imf::worldToCamera(header).multVecMatrix(point, in_camera);
    EXPECT_EQ(in_camera, Imath::V3f(4, -1, 4));
    // Screen coordinates are (0, 0) at the upper left and (1, 1) at the lower right. At depth 4 the image spans -8 to 8
    // and 4 to -4.
    Imath::V3f in_ndc;
    Imf::worldToNDC(header).multVecMatrix(point, in_ndc);
    EXPECT_NEAR(in_ndc.x, (4 + 8) / 16.0, 1e-6);
    EXPECT_NEAR(in_ndc.y, (4 + 1) / 8.0, 1e-6);
    EXPECT_NEAR(Imf::chromaticities(header).green.y, 0.830, 1e-6);
    EXPECT_EQ(Imf::capDate(header), attributes.capture_date);
    EXPECT_EQ(Imf::comments(header), attributes.comments);

    const ExrAttributes read = read_exr(path_).attributes;
    ASSERT_TRUE(read.world_to_camera && read.world_to_clip && read.chromaticities);
    for (int i = 0; i < 4; ++i) {
        EXPECT_LT(glm::distance((*read.world_to_camera)[i], (*attributes.world_to_camera)[i]), 1e-6);
        EXPECT_LT(glm::distance((*read.world_to_clip)[i], (*attributes.world_to_clip)[i]), 1e-5);
    }
    EXPECT_NEAR(read.chromaticities->white.x, kAp1.white.x, 1e-6);
    EXPECT_EQ(std::tie(read.capture_date, read.software, read.comments, read.extra),
              std::tie(attributes.capture_date, attributes.software, attributes.comments, attributes.extra));
}

TEST_F(Exr, FrameRatesAndTimeCodes) {
    const Image image(2, 2, 1);
    ExrAttributes attributes;
    const auto read = [&] {
        write_exr(path_, {{{"R"}, image}}, attributes);
        return read_exr(path_).attributes;
    };
    EXPECT_FALSE(read().frame_rate || read().time_code);
    attributes.frame_rate = FrameRate{30000, 1001};
    for (const TimeCode code : {TimeCode{23, 59, 58, 29}, TimeCode{23, 59, 59, 29, true}}) {
        attributes.time_code = code;
        EXPECT_EQ(read().time_code, code);
        EXPECT_EQ(read().frame_rate, attributes.frame_rate);
    }
    const struct {
        FrameRate rate;
        FrameNumber frame;
        std::optional<TimeCode> code;
    } cases[] = {{{24, 1}, 0, TimeCode{0, 0, 0, 0}},
                 {{24, 1}, 24 * 3723 + 5, TimeCode{1, 2, 3, 5}},
                 {{30, 1}, 30 * 86400 + 29, TimeCode{0, 0, 0, 29}},  // the next day
                 {{30, 1}, ~0u, TimeCode{0, 12, 56, 15}},
                 {{24, 1}, -1, TimeCode{23, 59, 59, 23}},  // the day before
                 {{50, 1}, -50 * 3600, TimeCode{23, 0, 0, 0}},
                 {{24000, 1001}, 24 * 3723 + 5, TimeCode{1, 2, 3, 5}},  // counted as 24
                 {{30000, 1001}, 1800, TimeCode{0, 1, 0, 0}},           // no frame is dropped
                 {{4000, 143}, 28 * 61 + 27, TimeCode{0, 1, 1, 27}},    // 28 x 1000/1001, reduced
                 {{50, 1}, 50 * 3723 + 49, TimeCode{1, 2, 3, 24, true}},
                 {{60000, 1001}, 118, TimeCode{0, 0, 1, 29, false}},
                 {{60000, 1001}, 119, TimeCode{0, 0, 1, 29, true}},
                 {{48000, 1001}, 48, TimeCode{0, 0, 1, 0}},
                 {{60, 1}, 60 * 86400 - 1, TimeCode{23, 59, 59, 29, true}},
                 {{31, 1}, 0, {}},
                 {{25, 2}, 0, {}},
                 {{61, 1}, 0, {}},
                 {{120, 1}, 0, {}},
                 {{120000, 1001}, 0, {}},
                 {{24001, 1001}, 0, {}}};
    for (const auto& [rate, frame, code] : cases)
        EXPECT_EQ(time_code(rate, frame), code) << rate.numerator << "/" << rate.denominator << " " << frame;
}

TEST_F(Exr, CaptureDateCanBePinned) {
    test::EnvironmentVariable epoch("SOURCE_DATE_EPOCH", "86400");
    EXPECT_EQ(capture_date_now(), "1970:01:02 00:00:00");
    epoch.set(nullptr);
    EXPECT_EQ(capture_date_now().size(), 19u);
    EXPECT_GT(capture_date_now(), "2024:01:01 00:00:00");
}

TEST_F(Exr, RefusesOtherFiles) {
    const Image image = noise(4, 4, 1);
    const std::vector<ExrLayer> cases[] = {{},  // no layers, or no pixels
                                           {{{"Y"}, Image(0, 4, 1)}},
                                           {{{"Y"}, image}, {{"Y"}, image}},
                                           {{{"Y"}, image}, {{"Z"}, noise(4, 5, 1)}},
                                           {{{"X", "Y"}, image}}};
    for (const std::vector<ExrLayer>& layers : cases) EXPECT_THROW(write_exr(path_, layers, {}), Error);
    EXPECT_EQ(entries(), 0u);
}

TEST_F(Exr, LimitsAreCheckedBeforeAllocation) {
    write_exr(path_, {{{"Y"}, Image(64, 64, 1)}}, {});
    EXPECT_THROW(read_exr(path_, {63, 1 << 30}), Error);
    EXPECT_THROW(read_exr(path_, {64, 64 * 64 * 4 - 1}), Error);
    EXPECT_NO_THROW(read_exr(path_, {64, 64 * 64 * 4}));
}

TEST_F(Exr, EveryTruncationIsAnError) {
    const Image image = noise(40, 40, 3);
    const ExrLayerView layers[] = {{.channels = {"R", "G", "B"}, .image = image},
                                   {.channels = {"a.X", "a.Y", "a.Z"}, .image = image}};
    for (const bool parts : {false, true}) {
        write_exr_views(path_, layers, {}, {ExrCompression::zip, parts, 0});
        const std::string whole = read_file(path_, 1 << 30);
        for (std::size_t length = 0; length < whole.size(); length += length < 900 ? 17 : 1997) {
            std::ofstream(path_, std::ios::binary) << whole.substr(0, length);
            EXPECT_THROW(read_exr(path_), Error) << length << " of " << whole.size() << " bytes";
        }
    }
}

TEST_F(Exr, DamagedFilesAreErrorsOrLoad) {
    const fs::path folder = fs::path(HALFLIGHT_SHARED_DIR) / "assets/bad/exr";
    if (!fs::exists(folder)) GTEST_SKIP() << folder << " is not there";
    int refused = 0;
    const auto peak_kib = [] {
        rusage usage{};
        getrusage(RUSAGE_SELF, &usage);
        return usage.ru_maxrss;
    };
    const auto before = peak_kib();
    for (const auto& entry : fs::directory_iterator(folder)) {
        const Stopwatch watch;
        const std::string error = error_message([&] { read_exr(entry.path()); });
        EXPECT_LT(watch.seconds(), 10) << entry.path();
        EXPECT_EQ(error.find('\n'), std::string::npos) << error;
        refused += !error.empty();
    }
    EXPECT_GT(refused, 0);
#ifndef HALFLIGHT_SANITIZED
    EXPECT_LT(peak_kib() - before, 1 << 20) << "damaged headers must not take gigabytes";
#endif
}

TEST_F(Exr, UnwritableFoldersAndFullDisks) {
    const std::vector<ExrLayer> layers = {{{"R", "G", "B"}, noise(256, 256, 3)}};
    EXPECT_EQ(error_message([&] { write_exr(folder_ / "no/a.exr", layers, {}); }),
              (folder_ / "no/a.exr").string() + ": cannot write: No such file or directory");
    write_file(path_, "old");
    for (const rlim_t room : {0, 100, 70000, 200000}) {
        const std::string error = error_message([&] {
            const test::FileSizeLimit tight(room);
            write_exr(path_, layers, {});
        });
        EXPECT_EQ(error, path_.string() + ": cannot write: File too large") << room << " bytes";
        EXPECT_EQ(read_file(path_, 100), "old");
        EXPECT_EQ(entries(), 1u) << "no temporary is left";
    }
    // A destructor that swallows errors rewrites the line offset table.
    write_exr(path_, layers, {});
    EXPECT_NO_THROW(read_exr(path_));
}

TEST_F(Exr, PicturesAreThoseOfTheDisplayWindow) {
    const Image image = noise(4, 3, 1);
    const auto read = [&](const ivec2& origin, const ivec2& display) {
        ExrAttributes attributes;
        attributes.origin = origin, attributes.display = display;
        write_exr(path_, {{{"Y"}, image}}, attributes);
        return read_exr(path_);
    };
    const Image crop = read({1, 2}, {6, 7}).displayed({"Y"});
    ASSERT_EQ(ivec2(crop.width, crop.height), ivec2(6, 7));
    EXPECT_TRUE(same_bits(part_of(crop, {1, 2}, {4, 3}), image));
    EXPECT_EQ(std::ranges::count(crop.pixels, 0.0f), 6 * 7 - 4 * 3);
    EXPECT_TRUE(same_bits(read({-1, -1}, {2, 2}).displayed({"Y"}), part_of(image, {1, 1}, {2, 2})));
    EXPECT_TRUE(same_bits(read({-1, -1}, {2, 2}).whole("a", {"Y"}), part_of(image, {1, 1}, {2, 2})));
    EXPECT_EQ(std::ranges::count(read({9, 0}, {3, 3}).displayed({"Y"}).pixels, 0.0f), 9) << "no pixel is displayed";
    EXPECT_EQ(error_message([&] { read({1, 2}, {6, 7}).whole("a", {"Y"}); }),
              "a: is a crop: it has the pixels 1,2 to 5,5 of 6 x 7");
    EXPECT_THROW(read_exr(path_, {6, 1 << 20}), Error) << "the display window is larger";
}

TEST_F(Exr, AllFlatPartsAreRead) {
    const Imath::Box2i display({0, 0}, {7, 3}), window({2, 1}, {9, 2});
    const auto place = [](int x, int y) { return static_cast<float>(100 * y + x); };
    const std::map<std::string, test::PartChannel> colour{
        {"R", {place}}, {"G", test::constant(1)}, {"B", test::constant(2)}};
    test::write_exr_parts(path_, display,
                    {{"deep", display, {{"Z", {}}}, true},
                     {"depth", window, {{"Z", {place}}, {"A", test::constant(5)}}},
                     {"normal", display, colour},
                     {"glow", display, {{"A", test::constant(6)}}},
                     {"main.beauty", display, colour}});
    const ExrFile file = read_exr(path_);
    EXPECT_EQ(ivec2(file.width, file.height), ivec2(8, 4)) << "the window of the picture's part";
    EXPECT_EQ(file.attributes.origin, ivec2(0));
    EXPECT_EQ(file.attributes.display, ivec2(8, 4));
    std::set<std::string> names;
    for (const ExrChannel& channel : file.channels) names.insert(channel.name);
    EXPECT_EQ(names, (std::set<std::string>{"Z", "A", "R", "G", "B", "glow.A", "normal.R", "normal.G", "normal.B"}));
    EXPECT_EQ(file.deep_parts, std::vector<std::string>{"deep"});
    const Image depth = file.image({"Z"}), red = file.displayed({"R"});
    ASSERT_EQ(file.window_of({"Z"}), (ExrWindow{{2, 1}, {8, 2}}));
    EXPECT_EQ(*depth.at(7, 1), 209);
    EXPECT_EQ(*file.image({"Z"}, {{0, 0}, {10, 4}}).at(9, 3), 0);
    EXPECT_EQ(*file.displayed({"Z"}).at(7, 2), 207);
    EXPECT_EQ(file.window_of({"R", "Z"}), (ExrWindow{{0, 0}, {10, 4}}));
    EXPECT_EQ(*red.at(7, 3), 307);
    // The picture of a file without such a name is the first one.
    test::write_exr_parts(path_, display,
                    {{"one", display, {{"Z", {place}}}}, {"two", display, colour}, {"three", window, colour}});
    const ExrFile other = read_exr(path_);
    EXPECT_EQ(*other.image({"R"}).at(0, 3), 300);
    EXPECT_EQ(*other.image({"three.R"}).at(7, 1), 209);
    test::write_exr_parts(path_, display, {{"deep", display, {{"Z", {}}}, true}});
    EXPECT_THROW(read_exr(path_), Error);
}

TEST_F(Exr, TheOnlyColoursKeepTheirNames) {
    const Imath::Box2i display({0, 0}, {7, 3});
    const std::map<std::string, test::PartChannel> colour{
        {"R", test::constant(1)}, {"G", test::constant(1)}, {"B", test::constant(2)}};
    for (const char* name : {"normal", "mask", "uv"}) {
        test::write_exr_parts(path_, display, {{name, display, colour}});
        EXPECT_EQ(*read_exr(path_).displayed({"B"}).at(0, 0), 2) << name;
        test::write_exr_parts(path_, display, {{"depth", display, {{"Z", {}}}, true}, {name, display, colour}});
        EXPECT_EQ(*read_exr(path_).displayed({"B"}).at(0, 0), 2) << name;
    }
    test::write_exr_parts(path_, display,
                    {{"albedo", display, colour}, {"beauty", display, {{"Y", test::constant(7)}}}});
    const ExrFile grey = read_exr(path_);
    EXPECT_TRUE(grey.find("Y") && grey.find("albedo.R") && !grey.find("R"));
}

TEST_F(Exr, FarPartsCostNothing) {
    const Imath::Box2i display({0, 0}, {15, 7}), far({-16000, -16000}, {-16000, -16000});
    test::write_exr_parts(
        path_, display,
        {{"a", display, {{"R", test::constant(1)}, {"G", test::constant(2)}, {"B", test::constant(3)}}},
         {"z", far, {{"Z", test::constant(4)}}}});
    const ExrFile file = read_exr(path_, {1 << 14, 1 << 12});  // 4 channels of 16 x 8 pixels are 2 KiB
    EXPECT_EQ(ivec2(file.width, file.height), ivec2(16, 8));
    EXPECT_EQ(file.whole("a", {"R", "G", "B"}).at(15, 7)[2], 3);
    EXPECT_EQ(file.find("Z")->values, std::vector<float>{4});
    EXPECT_EQ(file.find("Z")->window, (ExrWindow{{-16000, -16000}, {1, 1}}));
}

TEST_F(Exr, TheFinestLevelIsRead) {
    for (const Imf::LevelMode mode : {Imf::MIPMAP_LEVELS, Imf::RIPMAP_LEVELS}) {
        Imf::Header header(32, 16);
        header.channels().insert("Y", Imf::Channel(Imf::FLOAT));
        header.setTileDescription({8, 8, mode});
        {
            Imf::TiledOutputFile file(path_.c_str(), header);
            for (int ly = 0; ly < file.numYLevels(); ++ly) {
                for (int lx = 0; lx < file.numXLevels(); ++lx) {
                    if (!file.isValidLevel(lx, ly)) continue;
                    const std::vector<float> values(32 * 16, static_cast<float>(lx + ly));
                    Imf::FrameBuffer buffer;
                    buffer.insert("Y", Imf::Slice::Make(Imf::FLOAT, values.data(), file.dataWindowForLevel(lx, ly)));
                    file.setFrameBuffer(buffer);
                    file.writeTiles(0, file.numXTiles(lx) - 1, 0, file.numYTiles(ly) - 1, lx, ly);
                }
            }
        }
        const ExrFile read = read_exr(path_);
        EXPECT_EQ(read.find("Y")->values, std::vector<float>(32 * 16, 0.0f));
    }
}

TEST_F(Exr, LuminanceAndChromaAreColours) {
    const Imath::Box2i window({-4, -2}, {7, 3});
    const auto luminance = [](int x, int y) { return 1 + 0.1f * static_cast<float>(x) + 0.2f * static_cast<float>(y); };
    const vec3 colour(0.6f, 1.2f, 0.3f);
    const float y = 0.2126f * colour.x + 0.7152f * colour.y + 0.0722f * colour.z;
    for (const int step : {1, 2}) {
        test::write_exr_parts(path_, window,
                        {{"main",
                          window,
                          {{"Y", {[&](int a, int b) { return y * luminance(a, b); }}},
                           {"RY", {[&](int, int) { return colour.x / y - 1; }, step}},
                           {"BY", {[&](int, int) { return colour.z / y - 1; }, step}},
                           {"ramp", {luminance, step}}}}});
        const ExrFile file = read_exr(path_);
        EXPECT_EQ(file.channels.size(), 4u);
        const Image image = file.image({"R", "G", "B", "ramp"});
        for (int row = 0; row < image.height - 1; ++row) {
            for (int column = 0; column < image.width - 1; ++column) {  // nothing is known beyond the last ones
                const float expected = luminance(column - 4, row - 2);
                for (int c = 0; c < 3; ++c) EXPECT_NEAR(image.at(column, row)[c], expected * colour[c], 1e-3);
                EXPECT_NEAR(image.at(column, row)[3], expected, 1e-5) << column << ", " << row;
            }
        }
        EXPECT_NEAR(image.at(11, 5)[0], luminance(7, 3) * colour.x, 1e-3) << "chroma is constant";
    }
}

TEST_F(Exr, NamesThatOpenExrWouldCutAreRefused) {
    const std::string longest(255, 'a'), longer = longest + "b";
    write_exr(path_, {{{longest}, Image(2, 2, 1)}}, {});
    EXPECT_TRUE(read_exr(path_).find(longest));
    EXPECT_NE(error_message([&] { write_exr(path_, {{{longer}, Image(2, 2, 1)}}, {}); }).find("255 bytes"),
              std::string::npos);
}

}  // namespace
}  // namespace halflight
