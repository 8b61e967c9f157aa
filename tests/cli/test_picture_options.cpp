// Tests options of pictures and their files: crops, alpha, layouts of OpenEXR, and parts of the samples that are
// merged.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <set>

#include "engine/core/image_tools.h"
#include "engine/io/files.h"
#include "engine/io/jpeg.h"
#include "engine/io/png.h"
#include "engine/io/tiff.h"
#include "tests/cli/output_test.h"
#include "tests/support/error_message.h"

namespace halflight::test {
namespace {

class PictureOptions : public Output {
  protected:
    /// Runs a command that must fail with a usage error, and returns its line.
    std::string refused(Strings more) {
        Strings arguments = {"render", scene, file("refused.exr")};
        arguments.insert(arguments.end(), more.begin(), more.end());
        const Outcome outcome = run_program(arguments);
        EXPECT_EQ(outcome.status, 2) << outcome.err;
        EXPECT_FALSE(std::filesystem::exists(file("refused.exr")));
        return outcome.err;
    }
    Image png(const std::string& name) const {
        const std::string path = file(name);
        return read_png(path, read_file(path, 1 << 30), 4096);
    }
};

TEST_F(PictureOptions, CropsHaveWindowsAndThePixelsOfTheWhole) {
    const Strings size = {"--width", "48", "--height", "40", "--samples", "2", "--aov", "normal,cryptoobject"};
    const auto with = [&](Strings arguments) {
        arguments.insert(arguments.end(), size.begin(), size.end());
        return arguments;
    };
    render(with({file("whole.exr"), file("whole.png")}));
    render(with({file("part.exr"), file("part.png"), "--crop", "20,7,41,33"}));
    const ExrFile whole = read_exr(file("whole.exr")), part = read_exr(file("part.exr"));
    EXPECT_EQ(part.width, 21);
    EXPECT_EQ(part.height, 26);
    EXPECT_EQ(part.attributes.origin, ivec2(20, 7));
    EXPECT_EQ(part.attributes.display, ivec2(48, 40));
    EXPECT_EQ(part.attributes.world_to_clip, whole.attributes.world_to_clip);
    ASSERT_EQ(channel_names(part), channel_names(whole));
    for (std::size_t c = 0; c < whole.channels.size(); ++c)
        for (std::size_t y = 0; y < 26; ++y)
            for (std::size_t x = 0; x < 21; ++x)
                ASSERT_EQ(part.channels[c].values[y * 21 + x], whole.channels[c].values[(y + 7) * 48 + x + 20]);
    EXPECT_TRUE(same_bits(png("part.png"), part_of(png("whole.png"), {20, 7}, {21, 26})));
    render(with({file("wide.exr"), "--overscan", "5"}));
    EXPECT_EQ(read_exr(file("wide.exr")).attributes.origin, ivec2(-5, -5));
    EXPECT_EQ(read_exr(file("wide.exr")).width, 58);
    EXPECT_NE(refused({"--crop", "5,5,5,9"}).find("--crop: has no pixels"), std::string::npos);
    EXPECT_NE(refused({"--crop", "5,5,9"}).find("--crop: expects X0,Y0,X1,Y1"), std::string::npos);
    EXPECT_NE(refused({"--crop", "5,5,9,9", "--denoise", "--denoise-frames", "1"}).find("--crop: cannot be given"),
              std::string::npos);
    EXPECT_NE(refused({"--crop", "5,5,9,9", "--adaptive"}).find("--crop: cannot be given"), std::string::npos);
}

TEST_F(PictureOptions, DenoisedCropsHaveThePixelsOfTheWhole) {
    const Strings size = {"--width", "160", "--height", "96", "--samples", "4", "--denoise", "--aov", "noisy"};
    const auto with = [&](Strings arguments) {
        arguments.insert(arguments.end(), size.begin(), size.end());
        return arguments;
    };
    render(with({file("whole.exr")}));
    render(with({file("part.exr"), "--crop", "90,40,120,90"}));
    const ExrFile whole = read_exr(file("whole.exr")), part = read_exr(file("part.exr"));
    std::size_t filtered = 0;
    for (const char* channel : {"R", "G", "B"}) {
        const std::vector<float>&all = whole.find(channel)->values, &some = part.find(channel)->values;
        for (std::size_t y = 0; y < 50; ++y)
            for (std::size_t x = 0; x < 30; ++x)
                ASSERT_EQ(some[y * 30 + x], all[(y + 40) * 160 + x + 90]) << x << " " << y;
        for (std::size_t i = 0; i < some.size(); ++i)
            filtered += some[i] != part.find(std::string("noisy.") + channel)->values[i];
    }
    EXPECT_GT(filtered, 1000u);
    render(with({file("wide.exr"), "--overscan", "3"}));
    EXPECT_EQ(read_exr(file("wide.exr")).width, 166);
}

TEST_F(PictureOptions, PanoramasAndEyesDescribeThemselves) {
    // Sizes follow from one side, since a panorama is twice as wide as high.
    const auto made = [&](Strings options) {
        Strings all = {"render", scene, file("a.exr"), "--samples", "1", "--aov", "depth,normal"};
        all.insert(all.end(), options.begin(), options.end());
        const Outcome outcome = run_program(all);
        EXPECT_EQ(outcome.status, 0) << outcome.err;
        return read_exr(file("a.exr"));
    };
    const ExrFile panorama = made({"--projection", "panorama", "--width", "32"});
    EXPECT_EQ(ivec2(panorama.width, panorama.height), ivec2(32, 16));
    EXPECT_EQ(panorama.attributes.extra.at("projection"), "panorama");
    EXPECT_FALSE(panorama.attributes.world_to_clip) << "no matrix describes a panorama";
    EXPECT_TRUE(panorama.attributes.world_to_camera);
    const Strings eyes = {"--projection", "panorama", "--width", "32", file("a.png")};
    Strings stacked = eyes, split = eyes;
    stacked.insert(stacked.end(), {"--stereo", "over-under"});
    split.insert(split.end(), {"--stereo", "views"});
    const ExrFile both = made(stacked);
    const Image shown = png("a.png");
    const ExrFile views = made(split);
    EXPECT_TRUE(same_bits(png("a.png"), shown)) << "a .png of views has both eyes, too";
    EXPECT_EQ(ivec2(both.width, both.height), ivec2(32, 32));
    EXPECT_EQ(ivec2(views.width, views.height), ivec2(32, 16));
    EXPECT_EQ(*views.attributes.display, ivec2(32, 16));
    EXPECT_EQ(views.attributes.views, (Strings{"left", "right"}));
    EXPECT_TRUE(both.attributes.views.empty());
    const auto half = [&](const char* name, std::size_t eye) {
        const std::vector<float>& all = both.find(name)->values;
        return std::vector<float>(all.begin() + std::ptrdiff_t(eye * 512),
                                  all.begin() + std::ptrdiff_t(eye * 512 + 512));
    };
    for (const auto& [name, right] : {std::pair("R", "right.R"), {"Z", "right.Z"}, {"normal.X", "normal.right.X"}}) {
        const std::string left = name == std::string("normal.X") ? "normal.left.X" : name;
        ASSERT_TRUE(views.find(left) && views.find(right)) << name;
        EXPECT_EQ(views.find(left)->values, half(name, 0)) << name;
        EXPECT_EQ(views.find(right)->values, half(name, 1)) << name;
    }
    EXPECT_EQ(views.channels.size(), 2 * both.channels.size());
    const ExrFile parts = made({"--stereo", "views", "--width", "16", "--height", "16", "--exr-parts"});
    EXPECT_TRUE(parts.find("R") && parts.find("right.R") && parts.find("normal.left.X") &&
                parts.find("normal.right.X"));
    EXPECT_EQ(parts.attributes.views, views.attributes.views);
    render({file("views.jpg"), "--stereo", "views", "--width", "64", "--height", "90"});  // metering has odd halves
    std::ofstream(file("fish.json")) << R"({"halflight_settings": 1, "size": [1280, 720],
        "projection": "fisheye", "fisheye-fov": 220})";
    const ExrFile fish = made({"--settings", file("fish.json"), "--height", "24"});
    EXPECT_EQ(ivec2(fish.width, fish.height), ivec2(24, 24));
    EXPECT_EQ(fish.attributes.extra.at("projection"), "fisheye of 220 degrees");
    EXPECT_EQ(fish.find("R")->values[0], 0) << "outside of the image circle";
    EXPECT_FALSE(fish.attributes.numbers.contains("effectiveFocalLength"));
    std::ofstream(file("wide.json")) << R"({"halflight_settings": 1, "size": [32, 18], "projection": "panorama"})";
    const ExrFile wide = made({"--settings", file("wide.json")});
    EXPECT_EQ(ivec2(wide.width, wide.height), ivec2(32, 16)) << "the size of the viewer's window is 16:9";
}

TEST_F(PictureOptions, LayersHaveTheNamesOfOtherRenderers) {
    const auto channels = [&](const char* names) {
        render({file("a.exr"), "--aov", "direct_glossy,depth,normal,ids,cryptoobject", "--aov-names", names});
        const Strings all = channel_names(read_exr(file("a.exr")));
        return std::set<std::string>(all.begin(), all.end());
    };
    const auto own = channels("halflight"), blender = channels("blender"), arnold = channels("arnold");
    for (const char* name : {"R", "A", "direct_glossy.G", "Z", "normal.X", "ids.instance"})
        EXPECT_TRUE(own.contains(name)) << name;
    for (const char* name : {"ViewLayer.Combined.R", "ViewLayer.Combined.A", "ViewLayer.GlossDir.G",
                             "ViewLayer.Depth.Z", "ViewLayer.Normal.X", "ids.instance", "CryptoObject00.R"})
        EXPECT_TRUE(blender.contains(name)) << name;
    for (const char* name : {"R", "A", "specular_direct.G", "Z", "N.X", "ids.instance", "CryptoObject00.R"})
        EXPECT_TRUE(arnold.contains(name)) << name;
    EXPECT_EQ(own.size(), blender.size());
    EXPECT_EQ(own.size(), arnold.size());
    EXPECT_NE(refused({"--aov-names", "mitsuba"}).find("expects halflight, blender or arnold"), std::string::npos);
}

/// Values of a palette, of inverted grey or of a turned picture would be taken for others.
TEST_F(PictureOptions, TiffsOfOtherMeaningAreRefused) {
    const std::string usual = encode_tiff("a.tif", Image(2, 1, 1), TiffType::uint8);
    const auto refusal = [&](std::uint16_t tag, int value) {
        const auto bytes = [](std::uint32_t v, int count) {
            std::string text;
            for (int i = 0; i < count; ++i) text += static_cast<char>(v >> (8 * i));
            return text;
        };
        const std::size_t entry = usual.find(bytes(tag, 2) + bytes(3, 2) + bytes(1, 4));  // tag, SHORT, one value
        EXPECT_NE(entry, std::string::npos);
        return error_message([&] { read_tiff("a.tif", std::string(usual).replace(entry + 8, 1, 1, char(value)), 99); });
    };
    EXPECT_EQ(error_message([&] { read_tiff("a.tif", usual, 99); }), "");
    EXPECT_EQ(refusal(262, 0), "a.tif: has 1 channels with the photometric interpretation 0, which are not read");
    EXPECT_EQ(refusal(262, 5), "a.tif: has 1 channels with the photometric interpretation 5, which are not read");
    EXPECT_EQ(refusal(274, 3), "a.tif: has the orientation 3, which is not read");
}

TEST_F(PictureOptions, JpegAndTiffHoldTheView) {
    render({file("a.exr"), file("a.png"), file("a.jpg"), file("a.tif"), "--jpeg-quality", "100", "--exposure", "1"});
    const Image exact = png("a.png");
    TextureImage jpeg;
    read_jpeg("a.jpg", read_text(file("a.jpg")), 4096, jpeg);
    ASSERT_EQ(jpeg.width, 32);
    ASSERT_EQ(jpeg.height, 32);
    const TiffFile tiff = read_tiff("a.tif", read_text(file("a.tif")), 4096);
    EXPECT_EQ(tiff.type, TiffType::uint16);
    ASSERT_EQ(tiff.image.pixels.size(), exact.pixels.size());
    for (std::size_t i = 0; i < exact.pixels.size(); ++i) {
        EXPECT_NEAR(jpeg.rgba[i / 3 * 4 + i % 3], 255 * exact.pixels[i], 4);
        EXPECT_EQ(std::lround(255 * tiff.image.pixels[i]), std::lround(255 * exact.pixels[i]));
    }
    render({file("b.tif"), file("b.exr"), "--tiff-type", "float", "--working-space", "acescg", "--transparent"});
    const TiffFile linear = read_tiff("b.tif", read_text(file("b.tif")), 4096);
    EXPECT_EQ(linear.type, TiffType::float32);
    EXPECT_EQ(linear.image.channels, 4);
    const Image beauty = read_exr(file("b.exr")).image({"R", "G", "B", "A"});
    for (std::size_t i = 0; i < beauty.pixels.size(); ++i)
        EXPECT_NEAR(linear.image.pixels[i], beauty.pixels[i], 1e-6f * std::abs(beauty.pixels[i]));
    ASSERT_TRUE(linear.primaries);
    EXPECT_NEAR(linear.primaries->green.x, kAp1.green.x, 1e-6);
    EXPECT_NEAR(linear.primaries->white.y, kAp1.white.y, 1e-6);
    EXPECT_FALSE(tiff.primaries) << "those of the view are unknown";
    render({file("c.tiff"), "--tiff-type", "8", "--width", "1", "--height", "1"});
    EXPECT_EQ(read_tiff("c.tiff", read_text(file("c.tiff")), 4096).type, TiffType::uint8);
    // The files of sequences are kept.
    const Strings frames = {file("f.#.jpeg"), file("f.#.tiff"), "--frames", "1-2"};
    render(frames);
    EXPECT_NE(render(frames).err.find("2 of 2 frames are there already"), std::string::npos);
    const std::string whole = read_text(file("f.2.tiff"));
    write_text(file("f.2.tiff"), whole.substr(0, whole.size() / 2));
    EXPECT_NE(render(frames).err.find("1 of 2 frames are there already"), std::string::npos);
    EXPECT_EQ(read_text(file("f.2.tiff")), whole);
    const auto unusable = [&](Strings arguments) {
        arguments.insert(arguments.begin(), {"render", scene});
        const Outcome outcome = run_program(arguments);
        EXPECT_EQ(outcome.status, 2);
        return outcome.err;
    };
    std::string folders;
    for (int i = 0; i < 5; ++i) folders += std::string(200, 'x') + '/';  // more than a message holds
    for (const auto& path : {file("a.jpg"), file(folders + "a.jpg")})
        EXPECT_NE(unusable({path, "--transparent"}).find("a.jpg: has no alpha channel"), std::string::npos);
    EXPECT_NE(unusable({file("a.png"), "--jpeg-quality", "5"}).find("needs a .jpg output"), std::string::npos);
    EXPECT_NE(unusable({file("a.jpg"), "--jpeg-quality", "0"}).find("from 1 to 100"), std::string::npos);
    EXPECT_NE(unusable({file("a.png"), "--tiff-type", "8"}).find("needs a .tif output"), std::string::npos);
    EXPECT_NE(unusable({file("a.tif"), "--tiff-type", "12"}).find("expects 8, 16 or float"), std::string::npos);
    EXPECT_NE(unusable({file("a.tif"), "--working-space", "acescg"}).find("needs a scene-linear output"),
              std::string::npos);
    EXPECT_NE(unusable({file("a.tif"), "--tiff-type", "float", "--exposure", "1"}).find("needs an output through"),
              std::string::npos);
}

TEST_F(PictureOptions, TransparentPicturesHaveAlpha) {
    const Strings arguments = {file("a.exr"), file("a.png"), "--env", "1,1,1",  "--look-from",
                               "0,1,6",       "--look-at",   "0,1,0", "--vfov", "90"};
    Strings clear = arguments;
    clear.emplace_back("--transparent");
    render(arguments);
    EXPECT_EQ(png("a.png").channels, 3);
    const ExrFile opaque = read_exr(file("a.exr"));
    EXPECT_EQ(std::ranges::count(opaque.find("A")->values, 1.0f), 32 * 32);
    render(clear);
    EXPECT_EQ(png("a.png").channels, 4);
    const ExrFile exr = read_exr(file("a.exr"));
    const std::vector<float>& alpha = exr.find("A")->values;
    EXPECT_GT(std::ranges::count(alpha, 0.0f), 0);
    EXPECT_GT(std::ranges::count(alpha, 1.0f), 0);
    for (std::size_t i = 0; i < alpha.size(); ++i) {
        EXPECT_TRUE(alpha[i] > 0 || exr.find("R")->values[i] == 0);
        EXPECT_EQ(png("a.png").pixels[4 * i + 3], std::round(255 * alpha[i]) / 255);
    }
}

TEST_F(PictureOptions, FilesTellHowTheyWereMade) {
    render({file("a.exr"), file("a.png"), "--samples", "3", "--camera", "front", "--focus", "2", "--fstop", "2.8",
            "--iso", "200"});
    ExrAttributes a = read_exr(file("a.exr")).attributes;
    EXPECT_EQ(a.extra["cameraLabel"], "front");
    EXPECT_EQ(a.counts["samples"], 3);
    EXPECT_EQ(a.numbers["focus"], 2);
    EXPECT_NEAR(a.numbers["aperture"], 2.8, 1e-5);
    EXPECT_EQ(a.numbers["isoSpeed"], 200);
    EXPECT_NEAR(a.numbers["expTime"], 1 / 125.0, 1e-7);
    EXPECT_GT(a.numbers["effectiveFocalLength"], 1);
    EXPECT_GT(a.numbers["renderTime"], 0);
    // Files that must not depend on clocks have no time.
    render({file("b.exr")}, fixed_date);
    EXPECT_FALSE(read_exr(file("b.exr")).attributes.numbers.contains("renderTime"));
    render({file("c.exr"), "--reproducible"});
    EXPECT_FALSE(read_exr(file("c.exr")).attributes.numbers.contains("renderTime"));
    EXPECT_FALSE(read_exr(file("c.exr")).attributes.numbers.contains("focus"));
}

TEST_F(PictureOptions, LayoutsKeepDataExact) {
    const Strings layers = {"--aov", "albedo,depth,cryptomaterial"};
    const auto with = [&](Strings arguments) {
        arguments.insert(arguments.end(), layers.begin(), layers.end());
        return arguments;
    };
    render(with({file("zip.exr")}));
    const ExrFile zip = read_exr(file("zip.exr"));
    for (const char* compression : {"none", "rle", "zips", "piz"}) {
        render(with({file("a.exr"), "--exr-compression", compression, "--exr-tiles", "16"}));
        EXPECT_TRUE(same_pixels(file("zip.exr"), file("a.exr"))) << compression;
    }
    for (const char* compression : {"pxr24", "dwaa", "dwab"}) {
        EXPECT_NE(refused(with({"--exr-compression", compression})).find("--exr-parts keeps them exact"),
                  std::string::npos);
        render(with({file("a.exr"), "--exr-compression", compression, "--exr-parts"}));
        const ExrFile lossy = read_exr(file("a.exr"));
        ASSERT_EQ(lossy.channels.size(), zip.channels.size());
        for (const ExrChannel& channel : zip.channels) {
            const bool color = channel.name.size() == 1 ? channel.name != "Z" : channel.name.starts_with("albedo");
            EXPECT_TRUE(color || lossy.find(channel.name)->values == channel.values) << channel.name;
        }
    }
    EXPECT_NE(refused({"--exr-compression", "dwa"}).find("did you mean"), std::string::npos);
}

TEST_F(PictureOptions, PartsAreMergedToTheSameBits) {
    const Strings size = {"--width", "48", "--height", "48", "--samples", "30", "--denoise", "--aov", "variance,noisy"};
    const auto with = [&](Strings arguments) {
        arguments.insert(arguments.end(), size.begin(), size.end());
        return arguments;
    };
    render(with({file("one.exr"), "--sample-parts", "4"}));
    const Strings merge = with({"merge", scene, file("a.exr"), file("a.png"), "--sample-parts", "4"});
    EXPECT_EQ(run_program(merge).status, 1);
    for (const int part : {2, 1, 3, 4}) {
        const Strings command = with({"render", scene, file("a.exr"), "--part", fmt::format("{}/4", part)});
        if (part == 4) {  // a task that is preempted and queued again
            bool sent = false;
            RunOptions preempted;
            preempted.terminal = true;
            preempted.watch = [&](pid_t child, const std::string& err) {
                if (!sent && err.find("sample") != std::string::npos) sent = kill(child, SIGTERM) == 0;
            };
            const Outcome stopped = run_program(command, preempted);
            EXPECT_EQ(stopped.status, 128 + SIGTERM) << stopped.err;
            const Outcome early = run_program(merge);
            EXPECT_EQ(early.status, 1);
            EXPECT_NE(early.err.find("4-of-4"), std::string::npos) << early.err;
        }
        const Outcome outcome = run_program(command);
        EXPECT_EQ(outcome.status, 0) << outcome.err;
        EXPECT_NE(outcome.err.find(fmt::format("part {} of 4", part)), std::string::npos) << outcome.err;
        EXPECT_FALSE(std::filesystem::exists(file("a.exr")));
    }
    const Outcome merged = run_program(merge);
    EXPECT_EQ(merged.status, 0) << merged.err;
    EXPECT_TRUE(same_pixels(file("one.exr"), file("a.exr")));
    Strings other = merge;
    other.insert(other.end(), {"--seed", "5"});
    EXPECT_NE(run_program(other).err.find("was made with other settings"), std::string::npos);
    EXPECT_NE(refused({"--sample-parts", "3", "--samples", "2"}).find("3 parts are more than 2 samples"),
              std::string::npos);
    EXPECT_NE(refused({"--part", "1/2", "--time", "5"}).find("--part: cannot be given together with --time"),
              std::string::npos);
}

}  // namespace
}  // namespace halflight::test
