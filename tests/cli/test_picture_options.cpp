// Tests options of pictures and their files: crops, alpha, layouts of OpenEXR, and parts of the samples that are
// merged.
#include <fmt/format.h>

#include <cmath>
#include <csignal>
#include <filesystem>
#include <nlohmann/json.hpp>
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
    Image png(const std::string& name) const { return read_png(file(name), read_text(file(name)), 4096); }
    TiffFile tiff(const std::string& name) const { return read_tiff(name, read_text(file(name)), 4096); }
};

TEST_F(PictureOptions, CropsHaveWindowsAndThePixelsOfTheWhole) {
    const Strings size = words("--width 48 --height 40 --samples 2 --aov normal,cryptoobject");
    render(words(file("whole.exr"), file("whole.png"), size));
    render(words(file("part.exr"), file("part.png"), "--crop 20,7,41,33", size));
    const ExrFile whole = read_exr(file("whole.exr")), part = read_exr(file("part.exr"));
    EXPECT_EQ(ivec2(part.width, part.height), ivec2(21, 26));
    EXPECT_EQ(part.attributes.origin, ivec2(20, 7));
    EXPECT_EQ(part.attributes.display, ivec2(48, 40));
    EXPECT_EQ(part.attributes.world_to_clip, whole.attributes.world_to_clip);
    ASSERT_EQ(channel_names(part), channel_names(whole));
    for (std::size_t c = 0; c < whole.channels.size(); ++c)
        for (std::size_t y = 0; y < 26; ++y)
            for (std::size_t x = 0; x < 21; ++x)
                ASSERT_EQ(part.channels[c].values[y * 21 + x], whole.channels[c].values[(y + 7) * 48 + x + 20]);
    EXPECT_TRUE(same_bits(png("part.png"), part_of(png("whole.png"), {20, 7}, {21, 26})));
    render(words(file("wide.exr"), "--overscan 5", size));
    EXPECT_EQ(read_exr(file("wide.exr")).attributes.origin, ivec2(-5, -5));
    EXPECT_EQ(read_exr(file("wide.exr")).width, 58);
}

TEST_F(PictureOptions, DenoisedCropsHaveThePixelsOfTheWhole) {
    const Strings size = words("--width 160 --height 96 --samples 4 --denoise --aov noisy");
    render(words(file("whole.exr"), size));
    render(words(file("part.exr"), "--crop 90,40,120,90", size));
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
    render(words(file("wide.exr"), "--overscan 3 --width 16 --height 16 --samples 2 --denoise"));
    EXPECT_EQ(read_exr(file("wide.exr")).width, 22);
}

TEST_F(PictureOptions, PanoramasAndEyesDescribeThemselves) {
    // Sizes follow from one side, since a panorama is twice as wide as high.
    const auto made = [&](const Strings& options) {
        done(words("render", scene, file("a.exr"), "--samples 1 --aov depth,normal", options));
        return read_exr(file("a.exr"));
    };
    const auto size = [](const ExrFile& exr) { return ivec2(exr.width, exr.height); };
    const ExrFile panorama = made(words("--projection panorama --width 32"));
    EXPECT_EQ(size(panorama), ivec2(32, 16));
    EXPECT_EQ(panorama.attributes.extra.at("projection"), "panorama");
    EXPECT_FALSE(panorama.attributes.world_to_clip) << "no matrix describes a panorama";
    EXPECT_TRUE(panorama.attributes.world_to_camera);
    const Strings eyes = words("--projection panorama --width 32", file("a.png"));
    const ExrFile both = made(words(eyes, "--stereo over-under"));
    const Image shown = png("a.png");
    const ExrFile views = made(words(eyes, "--stereo views"));
    EXPECT_TRUE(same_bits(png("a.png"), shown)) << "a .png of views has both eyes, too";
    EXPECT_EQ(size(both), ivec2(32, 32));
    EXPECT_EQ(size(views), ivec2(32, 16));
    EXPECT_EQ(*views.attributes.display, ivec2(32, 16));
    EXPECT_EQ(views.attributes.views, words("left right"));
    EXPECT_TRUE(both.attributes.views.empty());
    const auto half = [&](const char* name, std::size_t eye) {
        const std::vector<float>& all = both.find(name)->values;
        const auto first = all.begin() + std::ptrdiff_t(eye * 512);
        return std::vector<float>(first, first + 512);
    };
    for (const auto& [name, right] : {std::pair("R", "right.R"), {"Z", "right.Z"}, {"normal.X", "normal.right.X"}}) {
        const std::string left = name == std::string("normal.X") ? "normal.left.X" : name;
        ASSERT_TRUE(views.find(left) && views.find(right)) << name;
        EXPECT_EQ(views.find(left)->values, half(name, 0)) << name;
        EXPECT_EQ(views.find(right)->values, half(name, 1)) << name;
    }
    EXPECT_EQ(views.channels.size(), 2 * both.channels.size());
    const ExrFile parts = made(words("--stereo views --width 16 --height 16 --exr-parts"));
    for (const char* name : {"R", "right.R", "normal.left.X", "normal.right.X"}) EXPECT_TRUE(parts.find(name)) << name;
    EXPECT_EQ(parts.attributes.views, views.attributes.views);
    render(words(file("views.jpg"), "--stereo views --width 64 --height 90"));  // metering has odd halves
    write_text(file("fish.json"), R"({"halflight_settings": 1, "size": [1280, 720],
        "projection": "fisheye", "fisheye-fov": 220})");
    const ExrFile fish = made(words("--settings", file("fish.json"), "--height 24"));
    EXPECT_EQ(size(fish), ivec2(24, 24));
    EXPECT_EQ(fish.attributes.extra.at("projection"), "fisheye of 220 degrees");
    EXPECT_EQ(fish.find("R")->values[0], 0) << "outside of the image circle";
    EXPECT_FALSE(fish.attributes.numbers.contains("effectiveFocalLength"));
    write_text(file("wide.json"), R"({"halflight_settings": 1, "size": [32, 18], "projection": "panorama"})");
    EXPECT_EQ(size(made({"--settings", file("wide.json")})), ivec2(32, 16)) << "the viewer's window is 16:9";
}

TEST_F(PictureOptions, LayersHaveTheNamesOfOtherRenderers) {
    const std::pair<const char*, const char*> rows[] = {
        {"halflight", "R A direct_glossy.G Z normal.X ids.instance"},
        {"blender",
         "ViewLayer.Combined.R ViewLayer.Combined.A ViewLayer.GlossDir.G ViewLayer.Depth.Z "
         "ViewLayer.Normal.X ids.instance CryptoObject00.R"},
        {"arnold", "R A specular_direct.G Z N.X ids.instance CryptoObject00.R"}};
    std::set<std::size_t> counts;
    for (const auto& [convention, names] : rows) {
        render(words(file("a.exr"), "--aov direct_glossy,depth,normal,ids,cryptoobject --aov-names", convention));
        const ExrFile exr = read_exr(file("a.exr"));
        for (const std::string& name : words(names)) EXPECT_TRUE(exr.find(name)) << convention << " " << name;
        counts.insert(exr.channels.size());
    }
    EXPECT_EQ(counts.size(), 1u);
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
    expect_has(refusal(262, 0), "a.tif: has 1 channels with the photometric interpretation 0");
    expect_has(refusal(262, 5), "a.tif: has 1 channels with the photometric interpretation 5");
    expect_has(refusal(274, 3), "a.tif: has the orientation 3");
}

TEST_F(PictureOptions, JpegAndTiffHoldTheView) {
    render(words(file("a.exr"), file("a.png"), file("a.jpg"), file("a.tif"), "--jpeg-quality 100 --exposure 1"));
    const Image exact = png("a.png");
    TextureImage jpeg;
    read_jpeg("a.jpg", read_text(file("a.jpg")), 4096, jpeg);
    ASSERT_EQ(ivec2(jpeg.width, jpeg.height), ivec2(32, 32));
    const TiffFile view = tiff("a.tif");
    EXPECT_EQ(view.type, TiffType::uint16);
    EXPECT_FALSE(view.primaries) << "those of the view are unknown";
    ASSERT_EQ(view.image.pixels.size(), exact.pixels.size());
    for (std::size_t i = 0; i < exact.pixels.size(); ++i) {
        EXPECT_NEAR(jpeg.rgba[i / 3 * 4 + i % 3], 255 * exact.pixels[i], 4);
        EXPECT_EQ(std::lround(255 * view.image.pixels[i]), std::lround(255 * exact.pixels[i]));
    }
    render(words(file("b.tif"), file("b.exr"), "--tiff-type float --working-space acescg --transparent"));
    const TiffFile linear = tiff("b.tif");
    EXPECT_EQ(linear.type, TiffType::float32);
    EXPECT_EQ(linear.image.channels, 4);
    const Image beauty = read_exr(file("b.exr")).image({"R", "G", "B", "A"});
    for (std::size_t i = 0; i < beauty.pixels.size(); ++i)
        EXPECT_NEAR(linear.image.pixels[i], beauty.pixels[i], 1e-6f * std::abs(beauty.pixels[i]));
    ASSERT_TRUE(linear.primaries);
    EXPECT_NEAR(linear.primaries->green.x, kAp1.green.x, 1e-6);
    EXPECT_NEAR(linear.primaries->white.y, kAp1.white.y, 1e-6);
    render(words(file("c.tiff"), "--tiff-type 8 --width 1 --height 1"));
    EXPECT_EQ(tiff("c.tiff").type, TiffType::uint8);
    // The files of sequences are kept.
    const Strings frames = words(file("f.#.jpeg"), file("f.#.tiff"), "--frames 1-2");
    render(frames);
    expect_has(render(frames).err, "2 of 2 frames are there");
    const std::string whole = read_text(file("f.2.tiff"));
    write_text(file("f.2.tiff"), whole.substr(0, whole.size() / 2));
    expect_has(render(frames).err, "1 of 2 frames are there");
    EXPECT_EQ(read_text(file("f.2.tiff")), whole);
}

TEST_F(PictureOptions, TransparentPicturesHaveAlpha) {
    const Strings arguments =
        words(file("a.exr"), file("a.png"), "--env 1,1,1 --look-from 0,1,6 --look-at 0,1,0 --vfov 90");
    render(arguments);
    EXPECT_EQ(png("a.png").channels, 3);
    EXPECT_EQ(std::ranges::count(read_exr(file("a.exr")).find("A")->values, 1.0f), 32 * 32);
    render(words(arguments, "--transparent"));
    const Image shown = png("a.png");
    EXPECT_EQ(shown.channels, 4);
    const ExrFile exr = read_exr(file("a.exr"));
    const std::vector<float>& alpha = exr.find("A")->values;
    EXPECT_GT(std::ranges::count(alpha, 0.0f), 0);
    EXPECT_GT(std::ranges::count(alpha, 1.0f), 0);
    for (std::size_t i = 0; i < alpha.size(); ++i) {
        EXPECT_TRUE(alpha[i] > 0 || exr.find("R")->values[i] == 0);
        EXPECT_EQ(shown.pixels[4 * i + 3], std::round(255 * alpha[i]) / 255);
    }
}

TEST_F(PictureOptions, FilesTellHowTheyWereMade) {
    render(words(file("a.exr"), file("a.png"), "--samples 3 --camera front --focus 2 --fstop 2.8 --iso 200"));
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
    const Strings layers = words("--aov albedo,depth,cryptomaterial");
    render(words(file("zip.exr"), layers));
    const ExrFile zip = read_exr(file("zip.exr"));
    for (const char* compression : {"none", "rle", "zips", "piz"}) {
        render(words(file("a.exr"), "--exr-tiles 16 --exr-compression", compression, layers));
        EXPECT_TRUE(same_pixels(file("zip.exr"), file("a.exr"))) << compression;
    }
    for (const char* compression : {"pxr24", "dwaa", "dwab"}) {
        render(words(file("a.exr"), "--exr-parts --exr-compression", compression, layers));
        const ExrFile lossy = read_exr(file("a.exr"));
        ASSERT_EQ(lossy.channels.size(), zip.channels.size());
        for (const ExrChannel& channel : zip.channels) {
            const bool color = channel.name.size() == 1 ? channel.name != "Z" : channel.name.starts_with("albedo");
            EXPECT_TRUE(color || lossy.find(channel.name)->values == channel.values) << channel.name;
        }
    }
}

TEST_F(PictureOptions, PartsAreMergedToTheSameBits) {
    const Strings size = words("--width 48 --height 48 --samples 30 --denoise --aov variance,noisy");
    render(words(file("one.exr"), "--sample-parts 4", size));
    const Strings merge = words("merge", scene, file("a.exr"), file("a.png"), "--sample-parts 4", size);
    EXPECT_EQ(run_program(merge).status, 1);
    for (const int part : {2, 1, 3, 4}) {
        const Strings command = words("render", scene, file("a.exr"), "--part", fmt::format("{}/4", part), size);
        if (part == 4) {  // a task that is preempted and queued again
            bool sent = false;
            RunOptions preempted;
            preempted.terminal = true;
            preempted.watch = [&](pid_t child, const std::string& err) {
                if (!sent && has(err, "sample")) sent = kill(child, SIGTERM) == 0;
            };
            const Outcome stopped = run_program(command, preempted);
            EXPECT_EQ(stopped.status, 128 + SIGTERM) << stopped.err;
            const Outcome early = run_program(merge);
            EXPECT_EQ(early.status, 1);
            expect_has(early.err, "4-of-4");
        }
        done(command);
        EXPECT_FALSE(std::filesystem::exists(file("a.exr")));
    }
    done(merge);
    EXPECT_TRUE(same_pixels(file("one.exr"), file("a.exr")));
    const Outcome other = run_program(words(merge, "--seed 5"));
    EXPECT_EQ(other.status, 1);
    expect_has(other.err, "1-of-4: ");
}

/// A part that ends at its first look had one chance to end too early, of which the merge takes account.
TEST_F(PictureOptions, PartsCountTheLookThatEndsThem) {
    constexpr std::size_t kChances = 6;  // place in the plan of a band
    done(words("render", scene, file("a.exr"), "--part 1/2 --width 16 --height 16 --samples 64 --error 1000"));
    int bands = 0;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(file("a.exr.parts"))) {
        if (entry.path().extension() != ".sums") continue;
        const std::string text = read_text(entry.path());
        const std::size_t start = text.find('\n') + 1;
        const auto head = nlohmann::json::parse(text.substr(start, text.find('\n', start) - start));
        EXPECT_EQ(head.at("plan").at(kChances), 3) << "first_chances(2), and the look";
        ++bands;
    }
    EXPECT_GT(bands, 0);
}

}  // namespace
}  // namespace halflight::test
