// The viewer without its window: budgets, scripts, what data looks like.
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>

#include "tests/support/error_message.h"
#include "tools/view/resolution.h"
#include "tools/view/script.h"
#include "tools/view/seen.h"
#include "tools/view/timings.h"

namespace halflight::view {
namespace {

constexpr ivec2 kSize(960, 540);

TEST(Resolution, StartsCoarse) {
    EXPECT_EQ(Resolution(0.1).divisor(kSize), 8);
}

TEST(Resolution, PicturesAreNeverEmpty) {
    EXPECT_EQ(divided({960, 540}, 1), ivec2(960, 540));
    EXPECT_EQ(divided({961, 3}, 4), ivec2(241, 1));
}

/// What it comes to when pictures take `fixed` seconds and `each` per pixel, after some of them.
int settled(double budget, double fixed, double each, bool whole_one) {
    Resolution resolution(budget);
    const auto took = [&](int d) {
        const ivec2 size = divided(kSize, d);
        resolution.took(size, fixed + each * size.x * size.y);
    };
    if (whole_one) took(1);
    for (int i = 0; i < 10; ++i) took(resolution.divisor(kSize));
    return resolution.divisor(kSize);
}

TEST(Resolution, FindsTheFinestThatIsInTime) {
    constexpr double kPixels = 960 * 540;
    EXPECT_EQ(settled(0.1, 0, 0.08 / kPixels, false), 1) << "a fast device";
    EXPECT_EQ(settled(0.1, 0, 0.3 / kPixels, false), 2);
    EXPECT_EQ(settled(0.1, 0, 1.2 / kPixels, false), 4);
    EXPECT_EQ(settled(0.1, 0, 100 / kPixels, false), kCoarsest) << "nothing is in time";
    EXPECT_EQ(settled(0.1, 0.04, 0.8 / kPixels, true), 4) << "a time that does not depend on the size";
    EXPECT_EQ(settled(0.1, 0.2, 0.8 / kPixels, true), kCoarsest);
}

TEST(Resolution, ForgetsAndAdapts) {
    Resolution resolution(0.1);
    resolution.took(kSize, 0.05);
    EXPECT_EQ(resolution.divisor(kSize), 1);
    for (int i = 0; i < 20; ++i) resolution.took(kSize, 0.3);
    EXPECT_GT(resolution.divisor(kSize), 1) << "it has become slow";
    resolution.forget();
    EXPECT_EQ(resolution.divisor(kSize), 8);
}

TEST(Resolution, TriesAgainWhatWasSlowOnce) {
    Resolution resolution(0.1);
    resolution.took(divided(kSize, 8), 0.5);
    EXPECT_EQ(resolution.divisor(kSize), 16);
    int pictures = 0;
    for (; resolution.divisor(kSize) == 16 && pictures < 1000; ++pictures) resolution.took(divided(kSize, 16), 0.01);
    EXPECT_EQ(resolution.divisor(kSize), 8);
    EXPECT_GT(pictures, 20) << "but not all the time";
}

TEST(Script, LinesBecomeCommands) {
    const auto commands = parse_script("s.txt",
                                       "# a comment\n\nwait samples 4\r\n  orbit -10 2.5 # more\n"
                                       "screenshot \"a # b.png\"\nquit");
    ASSERT_EQ(commands.size(), 4u);
    EXPECT_EQ(commands[0].name, "wait");
    EXPECT_EQ(commands[0].numbers, std::vector{4.0});
    EXPECT_EQ(commands[0].line, 3);
    EXPECT_EQ(commands[1].numbers, (std::vector{-10, 2.5}));
    EXPECT_EQ(commands[2].words, std::vector<std::string>{"a # b.png"});
    EXPECT_EQ(commands[3].line, 6);
    EXPECT_TRUE(parse_script("s.txt", "").empty());
}

TEST(Script, BadLinesAreNamed) {
    const auto message = [](const std::string& line) {
        return error_message([&] { parse_script("s.txt", "wait first\n" + line); });
    };
    EXPECT_EQ(message("jump 3"), "s.txt:2: there is no command 'jump'");
    EXPECT_EQ(message("orbit 1"), "s.txt:2: 'orbit' wants 2 words, not 1");
    EXPECT_EQ(message("orbit 1 x"), "s.txt:2: 'orbit' wants a number, not 'x'");
    EXPECT_EQ(message("orbit 1 inf"), "s.txt:2: 'orbit' wants a number, not 'inf'");
    EXPECT_EQ(message("wait samples 1.5"), "s.txt:2: 'wait' wants a whole number, not '1.5'");
    EXPECT_EQ(message("wait samples 0"), "s.txt:2: 'wait' wants a number from 1 to 16777216, not 0");
    EXPECT_EQ(message("wait long"), "s.txt:2: there is 'wait first' and 'wait samples N', no 'wait long'");
    EXPECT_EQ(message("wait for 3"), "s.txt:2: there is 'wait first' and 'wait samples N', no 'wait for'");
    EXPECT_EQ(message("clay perhaps"), "s.txt:2: 'clay' is on or off");
    EXPECT_EQ(message("key X"), "s.txt:2: there is no key 'X'");
    EXPECT_EQ(message("screenshot a.jpg"), "s.txt:2: a screenshot is a .png or an .exr");
    EXPECT_EQ(message("camera \"main"), "s.txt:2: a quote has no end");
}

TEST(Seen, EveryViewShowsSomethingFinite) {
    for (const std::string& view : views()) {
        SCOPED_TRACE(view);
        RenderResult result;
        result.beauty = Image(4, 3, 4);
        std::ranges::fill(result.beauty.pixels, 0.5f);
        const bool wide = view.starts_with("crypto");
        ExrLayer layer{{}, Image(4, 3, wide ? 12 : view == "culling" || view == "motion" ? 2 : 3)};
        if (view == "depth" || view == "samples" || view == "nodes") layer.image = Image(4, 3, 1);
        for (std::size_t i = 0; i < layer.image.pixels.size(); ++i) layer.image.pixels[i] = 0.1f * float(i % 7);
        result.aovs.push_back(layer);
        const Seen shown = seen(view, result);
        EXPECT_EQ(shown.image.width, 4);
        EXPECT_EQ(shown.image.height, 3);
        EXPECT_GE(shown.image.channels, 3);
        float least = kInfinity, most = -kInfinity;
        for (const float v : shown.image.pixels) {
            ASSERT_TRUE(std::isfinite(v));
            least = std::min(least, v), most = std::max(most, v);
        }
        EXPECT_EQ(least < most, view != kFinal);
        EXPECT_TRUE(!shown.encoded || (least >= 0 && most <= 1)) << least << " " << most;
        EXPECT_FALSE(description(view).empty());
        EXPECT_EQ(aovs_of(view).size(), view == kFinal ? 0u : 1u);
    }
}

TEST(Seen, NothingHasItsOwnColour) {
    RenderResult result;
    result.beauty = Image(2, 1, 4);
    result.aovs.push_back({{}, Image(2, 1, 1)});
    result.aovs[0].image.pixels = {3, 1e10f};
    const Image depth = seen("depth", result).image;
    EXPECT_EQ(std::vector(depth.at(1, 0), depth.at(1, 0) + 3),
              (std::vector{0xfc / 255.0f, 0xfd / 255.0f, 0xbf / 255.0f}))
        << "the far end of magma";
    result.aovs[0].image = Image(2, 1, 3);
    result.aovs[0].image.pixels[0] = std::bit_cast<float>(7u);
    result.aovs[0].image.pixels[3] = std::bit_cast<float>(~0u);
    const Image ids = seen("ids", result).image;
    EXPECT_GT(*ids.at(0, 0), 0);
    EXPECT_EQ(*ids.at(1, 0), 0);
}

TEST(Timings, FirstPicturesCount) {
    Timings timings;
    Picture picture;
    picture.divisor = 4;
    for (std::uint64_t i = 1; i <= 3; ++i) {
        timings.requested(i, double(i));
        if (i == 2) continue;  // overtaken
        picture.request = i;
        timings.shown(picture, double(i) + 0.25);
        timings.shown(picture, double(i) + 0.5);
    }
    picture.divisor = 1;
    picture.seconds = 7;
    picture.result.stats.samples = 12;
    timings.shown(picture, 20);
    const auto json = timings.json();
    EXPECT_EQ(json["views"], 2);
    EXPECT_EQ(json["seconds_to_first_picture"]["median"], 0.25);
    EXPECT_EQ(json["first_pictures_per_second"], 0.5);
    EXPECT_EQ(json["resolutions"]["1/4"], 2);
    EXPECT_EQ(json["last_picture"]["samples"], 12);
    EXPECT_EQ(json["last_picture"]["seconds"], 7.0);
}

}  // namespace
}  // namespace halflight::view
