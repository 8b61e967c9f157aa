// Tests OpenEXR files: round trips, attributes by the standard's conventions, damaged files, full disks.
#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfInputFile.h>
#include <ImfMultiPartInputFile.h>
#include <ImfStandardAttributes.h>
#include <ImfThreading.h>
#include <ImfTiledOutputFile.h>
#include <ImfVersion.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <bit>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <glm/gtc/matrix_transform.hpp>

#include "engine/core/error.h"
#include "engine/core/stopwatch.h"
#include "engine/io/exr.h"
#include "engine/io/files.h"
#include "tests/support/error_message.h"
#include "tools/common/temporary_folder.h"

namespace halflight {
namespace {

namespace fs = std::filesystem;

class Exr : public testing::Test {
  protected:
    std::size_t entries() const { return folder_.entries().size(); }

    const TemporaryFolder folder_;
    const fs::path path_ = folder_ / "image.exr";
};

Image noise(int width, int height, int channels, unsigned seed = 1) {
    Image image(width, height, channels);
    for (float& v : image.pixels) {
        seed = seed * 1664525u + 1013904223u;
        v = std::ldexp(static_cast<float>(seed >> 8), static_cast<int>(seed % 13) - 26);
    }
    return image;
}

/// Compares values bit for bit, including NaN and -0.
void expect_same(const ExrFile& file, const std::vector<std::string>& names, const Image& image) {
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

TEST_F(Exr, FloatsAndIdsAreExact) {
    Image data = noise(131, 77, 3);
    data.pixels[0] = std::numeric_limits<float>::infinity();
    data.pixels[1] = std::numeric_limits<float>::quiet_NaN();
    data.pixels[2] = -0.0f;
    data.pixels[3] = std::numeric_limits<float>::denorm_min();
    Image ids(131, 77, 1);
    for (std::size_t i = 0; i < ids.pixels.size(); ++i)
        ids.pixels[i] = std::bit_cast<float>(static_cast<std::uint32_t>(0xffffffffu - i * 104729u));
    write_exr(path_, {{{"P.X", "P.Y", "P.Z"}, data}, {{"id"}, ids, ExrType::uint32}}, {});
    const ExrFile file = read_exr(path_);
    EXPECT_EQ(file.width, 131);
    EXPECT_EQ(file.height, 77);
    expect_same(file, {"P.X", "P.Y", "P.Z"}, data);
    expect_same(file, {"id"}, ids);
    EXPECT_EQ(file.find("id")->type, ExrType::uint32);
    EXPECT_EQ(file.image({"id"}).pixels[0], 4294967295.0f);
    EXPECT_EQ(entries(), 1u);
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
    EXPECT_NE(error_message([&] {
                  const ExrLayerView views[] = {{{"Y"}, gray, ExrType::float32, color}};
                  write_exr_views(path_, views, {});
              }).find("Y is no colour"),
              std::string::npos);
}

TEST_F(Exr, HalvesRoundAndDoNotOverflow) {
    Image image(2, 2, 2);
    image.pixels = {1 / 3.0f, 1e9f, -1e9f, 65519, 0.25f, 1e-9f, std::numeric_limits<float>::infinity(), -2};
    write_exr(path_, {{{"R", "G"}, image, ExrType::half}}, {});
    const ExrFile file = read_exr(path_);
    EXPECT_EQ(file.find("R")->type, ExrType::half);
    EXPECT_NEAR(file.find("R")->values[0], 1 / 3.0f, 1 / 3.0f / 2048);  // a half has a precision of 11 bits
    EXPECT_EQ(file.find("G")->values[0], 65504);
    EXPECT_EQ(file.find("R")->values[1], -65504);
    EXPECT_EQ(file.find("G")->values[1], 65504);
    EXPECT_EQ(file.find("R")->values[2], 0.25f);
    EXPECT_EQ(file.find("G")->values[2], 0);
    EXPECT_TRUE(std::isinf(file.find("R")->values[3]));
    EXPECT_EQ(file.find("G")->values[3], -2);
}

TEST_F(Exr, ManyLayersInAnyOrder) {
    std::vector<ExrLayer> layers;
    std::vector<Image> images;
    for (unsigned l = 0; l < 40; ++l) {
        const std::string name = fmt::format("layer{}.", (l * 17) % 40);
        images.push_back(noise(64, 50, 3, l));
        layers.push_back({{name + "B", name + "R", name + "G"}, images.back()});
    }
    write_exr(path_, layers, {});
    const ExrFile file = read_exr(path_);
    EXPECT_EQ(file.channels.size(), 120u);
    for (unsigned l = 0; l < 40; ++l) expect_same(file, layers[l].channels, images[l]);
    EXPECT_EQ(file.image({"layer3.G", "layer7.B"}).channels, 2);
    EXPECT_THROW(file.image({"layer3.X"}), Error);
    std::reverse(layers.begin(), layers.end());
    const std::string before = read_file(path_, 1 << 30);
    write_exr(path_, layers, {});
    EXPECT_EQ(read_file(path_, 1 << 30), before);
}

TEST_F(Exr, IsASinglePartZippedScanLineFile) {
    write_exr(path_, {{{"R", "G", "B", "A"}, noise(33, 40, 4), ExrType::half}, {{"Z"}, noise(33, 40, 1)}}, {});
    const Imf::MultiPartInputFile file(path_.c_str());
    EXPECT_EQ(file.parts(), 1);
    EXPECT_EQ(Imf::getVersion(file.version()), 2);
    EXPECT_EQ(Imf::getFlags(file.version()), 0) << "neither tiled, deep nor multi-part, no long names";
    const Imf::Header& header = file.header(0);
    EXPECT_EQ(header.compression(), Imf::ZIP_COMPRESSION);
    EXPECT_EQ(header.lineOrder(), Imf::INCREASING_Y);
    EXPECT_EQ(header.channels()["A"].type, Imf::HALF);
    EXPECT_EQ(header.channels()["Z"].type, Imf::FLOAT);
}

TEST_F(Exr, BytesDoNotDependOnThreads) {
    const std::vector<ExrLayer> layers = {{{"R", "G", "B"}, noise(300, 200, 3)}};
    std::vector<std::string> files;
    for (int threads : {0, 1, 5}) {
        write_exr(path_, layers, {});  // starts OpenEXR's thread pool
        Imf::setGlobalThreadCount(threads);
        write_exr(path_, layers, {});
        files.push_back(read_file(path_, 1 << 30));
    }
    EXPECT_EQ(files[0], files[1]);
    EXPECT_EQ(files[0], files[2]);
}

TEST_F(Exr, AttributesFollowTheStandard) {
    // The camera is at (1, 2, 8), looks down -Z, and has a field of view of 90 degrees and an aspect ratio of 2:1.
    const dmat4 world_to_camera = glm::translate(dmat4(1), dvec3(-1, -2, -8));
    const dmat4 world_to_clip = glm::perspective(kPi / 2, 2.0, 0.1, 100.0) * world_to_camera;
    ExrAttributes attributes;
    attributes.chromaticities = kAp1;
    attributes.world_to_camera = world_to_camera;
    attributes.world_to_clip = world_to_clip;
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
    EXPECT_EQ(Imf::capDate(header), "2024:02:29 12:34:56");
    EXPECT_EQ(Imf::comments(header), "samples 16");

    const ExrAttributes read = read_exr(path_).attributes;
    ASSERT_TRUE(read.world_to_camera && read.world_to_clip && read.chromaticities);
    for (int i = 0; i < 4; ++i)
        for (int j = 0; j < 4; ++j) {
            EXPECT_NEAR((*read.world_to_camera)[i][j], world_to_camera[i][j], 1e-6);
            EXPECT_NEAR((*read.world_to_clip)[i][j], world_to_clip[i][j], 1e-5);
        }
    EXPECT_NEAR(read.chromaticities->white.x, kAp1.white.x, 1e-6);
    EXPECT_EQ(read.capture_date, attributes.capture_date);
    EXPECT_EQ(read.software, attributes.software);
    EXPECT_EQ(read.comments, attributes.comments);
    EXPECT_EQ(read.extra, attributes.extra);
}

TEST_F(Exr, FrameRatesAndTimeCodes) {
    ExrAttributes attributes;
    attributes.frame_rate = FrameRate{30000, 1001};
    attributes.time_code = TimeCode{23, 59, 58, 29};
    write_exr(path_, {{{"R"}, Image(2, 2, 1)}}, attributes);
    const ExrAttributes read = read_exr(path_).attributes;
    EXPECT_EQ(read.frame_rate, attributes.frame_rate);
    EXPECT_EQ(read.time_code, attributes.time_code);
    write_exr(path_, {{{"R"}, Image(2, 2, 1)}}, {});
    EXPECT_FALSE(read_exr(path_).attributes.frame_rate || read_exr(path_).attributes.time_code);

    EXPECT_EQ(time_code({24, 1}, 0), (TimeCode{0, 0, 0, 0}));
    EXPECT_EQ(time_code({24, 1}, 24 * 3723 + 5), (TimeCode{1, 2, 3, 5}));
    EXPECT_EQ(time_code({30, 1}, 30 * 86400 + 29), (TimeCode{0, 0, 0, 29})) << "the next day";
    EXPECT_EQ(time_code({30, 1}, ~0u), (TimeCode{0, 12, 56, 15}));
    EXPECT_EQ(time_code({24000, 1001}, 24 * 3723 + 5), (TimeCode{1, 2, 3, 5})) << "counted as 24";
    EXPECT_EQ(time_code({30000, 1001}, 1800), (TimeCode{0, 1, 0, 0})) << "no frame is dropped";
    EXPECT_EQ(time_code({4000, 143}, 28 * 61 + 27), (TimeCode{0, 1, 1, 27})) << "28 x 1000/1001, reduced";
    EXPECT_EQ(time_code({50, 1}, 50 * 3723 + 49), (TimeCode{1, 2, 3, 24, true})) << "in pairs";
    EXPECT_EQ(time_code({60000, 1001}, 118), (TimeCode{0, 0, 1, 29, false}));
    EXPECT_EQ(time_code({60000, 1001}, 119), (TimeCode{0, 0, 1, 29, true}));
    EXPECT_EQ(time_code({48000, 1001}, 48), (TimeCode{0, 0, 1, 0}));
    for (const FrameRate none : {FrameRate{31, 1}, {25, 2}, {61, 1}, {120, 1}, {120000, 1001}, {24001, 1001}})
        EXPECT_FALSE(time_code(none, 0)) << none.numerator;
    attributes.time_code = time_code({60, 1}, 60 * 86400 - 1);
    EXPECT_EQ(attributes.time_code, (TimeCode{23, 59, 59, 29, true}));
    write_exr(path_, {{{"R"}, Image(2, 2, 1)}}, attributes);
    EXPECT_EQ(read_exr(path_).attributes.time_code, attributes.time_code);
}

TEST_F(Exr, CaptureDateCanBePinned) {
    setenv("SOURCE_DATE_EPOCH", "86400", 1);
    EXPECT_EQ(capture_date_now(), "1970:01:02 00:00:00");
    unsetenv("SOURCE_DATE_EPOCH");
    EXPECT_EQ(capture_date_now().size(), 19u);
    EXPECT_GT(capture_date_now(), "2024:01:01 00:00:00");
}

TEST_F(Exr, ReadsTilesAndOffsetWindows) {
    const Image image = noise(150, 90, 1);
    Imf::Header header(Imath::Box2i({0, 0}, {199, 199}), Imath::Box2i({-20, 30}, {129, 119}));
    header.compression() = Imf::PIZ_COMPRESSION;
    header.channels().insert("Y", Imf::Channel(Imf::FLOAT));
    header.setTileDescription(Imf::TileDescription(32, 100));
    {
        Imf::TiledOutputFile file(path_.c_str(), header);
        Imf::FrameBuffer buffer;
        buffer.insert("Y", Imf::Slice::Make(Imf::FLOAT, image.pixels.data(), header.dataWindow(), 4, 4 * 150));
        file.setFrameBuffer(buffer);
        file.writeTiles(0, file.numXTiles() - 1, 0, file.numYTiles() - 1);
    }
    const ExrFile file = read_exr(path_);
    EXPECT_EQ(file.width, 150);
    EXPECT_EQ(file.height, 90);
    expect_same(file, {"Y"}, image);
}

TEST_F(Exr, RefusesOtherFiles) {
    const Image image = noise(4, 4, 1);
    EXPECT_NE(error_message([&] { write_exr(path_, {}, {}); }).find("no layers"), std::string::npos);
    EXPECT_NE(error_message([&] {
                  write_exr(path_, {{{"Y"}, Image(0, 4, 1)}}, {});
              }).find("no pixels"),
              std::string::npos);
    EXPECT_NE(error_message([&] {
                  write_exr(path_, {{{"Y"}, image}, {{"Y"}, image}}, {});
              }).find("Y comes twice"),
              std::string::npos);
    EXPECT_NE(error_message([&] {
                  write_exr(path_, {{{"Y"}, image}, {{"Z"}, noise(4, 5, 1)}}, {});
              }).find("Z is 4 x 5"),
              std::string::npos);
    EXPECT_NE(error_message([&] {
                  write_exr(path_, {{{"X", "Y"}, image}}, {});
              }).find("2 channel names"),
              std::string::npos);
    EXPECT_EQ(entries(), 0u);
}

TEST_F(Exr, LimitsAreCheckedBeforeAllocation) {
    write_exr(path_, {{{"Y"}, noise(64, 32, 1)}}, {});
    EXPECT_NE(error_message([&] {
                  read_exr(path_, {63, 1 << 30});
              }).find("side of 64 pixels, more than the limit of 63"),
              std::string::npos);
    write_exr(path_, {{{"Y"}, Image(64, 64, 1)}}, {});
    EXPECT_NE(error_message([&] {
                  read_exr(path_, {64, 64 * 64 * 4 - 1});
              }).find("16384 bytes of pixels"),
              std::string::npos);
    EXPECT_NO_THROW(read_exr(path_, {64, 64 * 64 * 4}));
}

TEST_F(Exr, EveryTruncationIsAnError) {
    write_exr(path_, {{{"R", "G", "B"}, noise(40, 40, 3)}}, {});
    const std::string whole = read_file(path_, 1 << 30);
    for (std::size_t length = 0; length < whole.size(); length += length < 600 ? 7 : 997) {
        write_file(path_, whole.substr(0, length));
        EXPECT_THROW(read_exr(path_), Error) << length << " of " << whole.size() << " bytes";
    }
    write_file(path_, "version https://git-lfs.github.com/spec/v1\n");
    EXPECT_NE(error_message([&] { read_exr(path_); }).find("Git LFS pointer"), std::string::npos);
}

TEST_F(Exr, DamagedFilesAreErrorsOrLoad) {
    const fs::path folder = fs::path(HALFLIGHT_SHARED_DIR) / "assets/bad/exr";
    if (!fs::exists(folder)) GTEST_SKIP() << folder << " is not there";
    int loaded = 0, refused = 0;
    for (const auto& entry : fs::directory_iterator(folder)) {
        const Stopwatch watch;
        const std::string error = error_message([&] { read_exr(entry.path()); });
        const double seconds = watch.seconds();
        ++(error.empty() ? loaded : refused);
        EXPECT_LT(seconds, 10) << entry.path();
        EXPECT_EQ(error.find('\n'), std::string::npos) << error;
    }
    EXPECT_GT(refused, 0);
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    RecordProperty("loaded", loaded);
    RecordProperty("refused", refused);
    RecordProperty("peak_kib", static_cast<int>(usage.ru_maxrss));
#ifndef HALFLIGHT_SANITIZED
    EXPECT_LT(usage.ru_maxrss, 1 << 20) << "KiB: damaged headers must not take gigabytes";
#endif
    std::cout << loaded << " loaded, " << refused << " refused, peak " << usage.ru_maxrss / 1024 << " MiB\n";
}

TEST_F(Exr, UnwritableFoldersAndFullDisks) {
    const std::vector<ExrLayer> layers = {{{"R", "G", "B"}, noise(256, 256, 3)}};
    EXPECT_EQ(error_message([&] { write_exr(folder_ / "no/a.exr", layers, {}); }),
              (folder_ / "no/a.exr").string() + ": cannot write: No such file or directory");
    write_file(path_, "old");
    // A limit on file sizes makes a write fail in the middle, like a full disk.
    std::signal(SIGXFSZ, SIG_IGN);
    rlimit whole{};
    getrlimit(RLIMIT_FSIZE, &whole);
    for (rlim_t room : {0, 100, 70000, 200000}) {
        const rlimit tight{room, whole.rlim_max};
        setrlimit(RLIMIT_FSIZE, &tight);
        const std::string error = error_message([&] { write_exr(path_, layers, {}); });
        setrlimit(RLIMIT_FSIZE, &whole);
        EXPECT_EQ(error, path_.string() + ": cannot write: File too large") << room << " bytes";
        EXPECT_EQ(read_file(path_, 100), "old");
        EXPECT_EQ(entries(), 1u) << "no temporary is left";
    }
    // A destructor that swallows errors rewrites the line offset table.
    write_exr(path_, layers, {});
    EXPECT_NO_THROW(read_exr(path_));
}

}  // namespace
}  // namespace halflight
