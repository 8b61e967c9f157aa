// Tests the viewer without its window: resolution, scripts, display of data layers, statistics.
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <nlohmann/json.hpp>

#include "engine/io/exr.h"
#include "tests/support/error_message.h"
#include "tools/common/color_map.h"
#include "tools/common/temporary_folder.h"
#include "tools/view/layer_view.h"
#include "tools/view/linear_picture.h"
#include "tools/view/pass_history.h"
#include "tools/view/region.h"
#include "tools/view/render_thread.h"
#include "tools/view/resolution.h"
#include "tools/view/script.h"
#include "tools/view/standing_picture.h"
#include "tools/view/timings.h"

namespace halflight::view {
namespace {

constexpr ivec2 kSize(960, 540);

TEST(Resolution, AdaptsAndResets) {
    Resolution resolution(0.1);
    EXPECT_EQ(resolution.divisor(kSize), 8);
    resolution.record(kSize, 0.05);
    EXPECT_EQ(resolution.divisor(kSize), 1);
    for (int i = 0; i < 20; ++i) resolution.record(kSize, 0.3);
    EXPECT_GT(resolution.divisor(kSize), 1) << "it has become slow";
    resolution.reset();
    EXPECT_EQ(resolution.divisor(kSize), 8);
    resolution.record(divided(kSize, 8), 1.1);  // a hitch does not count for long
    EXPECT_EQ(resolution.divisor(kSize), 16);
    resolution.record(divided(kSize, 16), 0.008);
    EXPECT_EQ(resolution.divisor(kSize), 8) << "four times as many pixels take 0.032 s at most";
    for (int i = 0; i < 4; ++i) resolution.record(divided(kSize, 8), 0.3);
    EXPECT_EQ(resolution.divisor(kSize), 16) << "it is slow after all";
    resolution.reset();
    resolution.record(divided(kSize, 8), 0.5);
    int pictures = 0;
    for (; resolution.divisor(kSize) == 16 && pictures < 1000; ++pictures) resolution.record(divided(kSize, 16), 0.06);
    EXPECT_EQ(resolution.divisor(kSize), 8) << "sizes that were slow are tried again";
    EXPECT_GT(pictures, 20) << "but not all the time";
}

TEST(Resolution, FinerPicturesPrecedeSlowOnes) {
    EXPECT_TRUE(worth_finer(0.005, 16, 0.1)) << "the whole picture takes 1.28 s";
    EXPECT_FALSE(worth_finer(0.005, 8, 0.1)) << "0.32 s";
    for (const int divisor : {1, 2}) EXPECT_FALSE(worth_finer(10, divisor, 0.1)) << "the whole picture is next";
    EXPECT_EQ(divided({961, 3}, 4), ivec2(241, 1)) << "never empty";
}

TEST(Resolution, FindsTheFinestWithinTheBudget) {
    const struct {
        double fixed, whole;  // seconds of any picture, and those that the pixels of a whole picture add
        bool whole_first;
        int divisor;
    } cases[] = {{0, 0.08, false, 1},        {0, 0.3, false, 2},   {0, 1.2, false, 4},
                 {0, 100, false, kCoarsest}, {0.04, 0.8, true, 4}, {0.2, 0.8, true, kCoarsest}};
    for (const auto& c : cases) {
        Resolution resolution(0.1);
        const auto record = [&](int divisor) {
            const ivec2 size = divided(kSize, divisor);
            resolution.record(size, c.fixed + c.whole * size.x * size.y / (kSize.x * kSize.y));
        };
        if (c.whole_first) record(1);
        for (int i = 0; i < 10; ++i) record(resolution.divisor(kSize));
        EXPECT_EQ(resolution.divisor(kSize), c.divisor) << c.fixed << ' ' << c.whole;
    }
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
    EXPECT_EQ(parse_script("s.txt", "environment #8899cc # grey")[0].words, std::vector<std::string>{"#8899cc"});
    EXPECT_EQ(parse_script("s.txt", "light 12 0 0.5 1")[0].numbers, (std::vector{12.0, 0.0, 0.5, 1.0}));
    EXPECT_TRUE(parse_script("s.txt", "compare on")[0].on());
    EXPECT_FALSE(parse_script("s.txt", "clay off")[0].on());
}

TEST(Script, InvalidLinesAreNamed) {
    const std::pair<const char*, const char*> cases[] = {{"jump 3", "'jump'"},
                                                         {"orbit 1", "takes 2 arguments"},
                                                         {"orbit 1 x", "'x'"},
                                                         {"orbit 1 inf", "'inf'"},
                                                         {"orbit 1e300 0", "-1000000 to 1000000, not 1e300"},
                                                         {"focus 0 -2e6", "-2e6"},
                                                         {"fly 0 0 1e30", "-1000000000 to 1000000000, not 1e30"},
                                                         {"wait samples 1.5", "whole number, not '1.5'"},
                                                         {"wait samples 0", "1 to 16777216, not 0"},
                                                         {"wait long", "'wait long'"},
                                                         {"wait for 3", "'wait for'"},
                                                         {"wait error 0", "1e-09 to 1000000000, not 0"},
                                                         {"component emission", "takes 2 arguments"},
                                                         {"component emission maybe", "on or off"},
                                                         {"split 1.5", "0 to 1, not 1.5"},
                                                         {"light -1 2", "0 to 16777216, not -1"},
                                                         {"light 0.5 2", "whole number, not '0.5'"},
                                                         {"light 12 0.5 0.5 2", "0 to 1, not 2"},
                                                         {"clay perhaps", "on or off"},
                                                         {"key Q", "'Q'"},
                                                         {"screenshot a.jpg", ".png"},
                                                         {"camera \"main", "quotation mark"}};
    for (const auto& [line, named] : cases) {
        const std::string message = error_message([&] { parse_script("s.txt", std::string("wait first\n") + line); });
        EXPECT_TRUE(message.starts_with("s.txt:2: ") && message.find(named) != std::string::npos) << message;
    }
}

/// Returns a picture with one layer of black pixels.
RenderResult with_layer(int width, int height, int channels) {
    RenderResult result;
    result.beauty = Image(width, height, 4);
    result.aovs.push_back({{}, Image(width, height, channels)});
    return result;
}

TEST(DisplayImage, EveryViewIsFinite) {
    for (const std::string& view : layer_view_names()) {
        SCOPED_TRACE(view);
        const auto is_one_of = [&](auto... names) { return ((view == names) || ...); };
        RenderResult result = with_layer(4, 3,
                                         view.starts_with("crypto")                    ? 12
                                         : is_one_of("culling", "motion", "residency") ? 2
                                         : is_one_of("depth", "samples", "nodes")      ? 1
                                                                                       : 3);
        std::ranges::fill(result.beauty.pixels, 0.5f);
        for (int i = 0; float& value : result.aovs[0].image.pixels) value = 0.1f * float(i++ % 7);
        const LayerView layer_view{.layer = view};
        const std::vector<std::string> aovs = {view == kError ? "variance" : view};
        const DisplayImage shown = display_image(layer_view, aovs, result);
        EXPECT_EQ(shown.image.width, 4);
        EXPECT_EQ(shown.image.height, 3);
        EXPECT_GE(shown.image.channels, 3);
        ASSERT_TRUE(std::ranges::all_of(shown.image.pixels, [](float v) { return std::isfinite(v); }));
        const auto [least, most] = std::ranges::minmax(shown.image.pixels);
        EXPECT_EQ(least < most, view != kFinal);
        EXPECT_TRUE(!shown.encoded || (least >= 0 && most <= 1)) << least << " " << most;
        EXPECT_EQ(required_aovs(layer_view), is_one_of(kFinal, kLuminance) ? std::vector<std::string>{} : aovs);
        const bool scaled =
            is_one_of(kError, kLuminance, "variance", "depth", "samples", "nodes", "culling", "denoiser");
        ASSERT_EQ(shown.scale.has_value(), scaled);
        EXPECT_TRUE(!scaled || (shown.scale->top > 0 && !shown.scale->unit.empty()));
    }
}

TEST(DisplayImage, EmptyPixelsHaveTheirOwnColour) {
    RenderResult result = with_layer(2, 1, 1);
    result.aovs[0].image.pixels = {3, 1e10f};
    const Image depth = display_image({.layer = "depth"}, {"depth"}, result).image;
    const vec3 far = magma(1);
    EXPECT_EQ(std::vector(depth.at(1, 0), depth.at(1, 0) + 3), (std::vector{far.r, far.g, far.b}));
    result = with_layer(2, 1, 3);
    result.aovs[0].image.pixels[0] = std::bit_cast<float>(7u);
    result.aovs[0].image.pixels[3] = std::bit_cast<float>(~0u);
    const Image ids = display_image({.layer = "ids"}, {"ids"}, result).image;
    EXPECT_GT(*ids.at(0, 0), 0);
    EXPECT_EQ(*ids.at(1, 0), 0);
}

TEST(DisplayImage, ComponentsAddUp) {
    RenderResult result = with_layer(1, 1, 3);
    result.beauty.pixels = {100, 100, 100, 1};
    std::vector<std::string> aovs = {"variance"};
    for (std::size_t i = 0; i < kComponents.size(); ++i) {
        aovs.emplace_back(kComponents[i]);
        ExrLayer& layer = result.aovs.emplace_back(ExrLayer{{}, Image(1, 1, 3)});
        layer.image.pixels = {float(1 << i), float(10 << i), 0};
    }
    LayerView layer_view;
    EXPECT_FALSE(layer_view.is_sum());
    EXPECT_EQ(display_image(layer_view, aovs, result).image.pixels, result.beauty.pixels)
        << "all of them are the picture itself";
    layer_view.components = {true, false, false, true, false};
    EXPECT_TRUE(layer_view.is_sum());
    EXPECT_EQ(display_image(layer_view, aovs, result).image.pixels, (std::vector<float>{9, 90, 0}));
    layer_view.layer = "albedo";
    EXPECT_FALSE(layer_view.is_sum()) << "that has none";
}

TEST(DisplayImage, ErrorsAreOfTheMeanAndRelative) {
    RenderResult result = with_layer(2, 1, 3);
    result.beauty.pixels = {0, 0, 0, 1, 2, 2, 2, 1};
    result.aovs[0].image.pixels = {0.012f, 0.012f, 0.012f, 1, 1, 1};
    result.stats.samples = kMinSamples;
    const DisplayImage error = display_image({.layer = kError}, {"variance"}, result);
    // The 99th percentile of sqrt(0.012 / 0.01) = 1.1 and sqrt(1 / 4.01) = 0.499 is the latter; the scale ends at 0.5.
    EXPECT_FLOAT_EQ(error.scale->top, 0.5f);
    EXPECT_NEAR(error.image.at(0, 0)[2], magma(1).b, 1e-6f);
    EXPECT_NEAR(error.image.at(1, 0)[2], magma(0.49938f / 0.5f).b, 1e-3f);
    const DisplayImage variance = display_image({.layer = "variance"}, {"variance"}, result);
    EXPECT_FLOAT_EQ(variance.scale->top, 0.02f) << "that is absolute";
    EXPECT_FLOAT_EQ(variance.scale->bottom, 2e-6f);
    EXPECT_NEAR(variance.image.at(0, 0)[2], magma(0.94454f).b, 1e-3f) << "1 + log10(0.6) / 4";

    ASSERT_TRUE(estimated_relmse({"variance"}, result));
    EXPECT_NEAR(*estimated_relmse({"variance"}, result), 0.5 * (0.012 + 1) / 4.01, 1e-6) << "the upper one of two";
    // One of nine pixels has a rare bright sample, which must not make the pixel's own relative error small.
    RenderResult rare = with_layer(3, 3, 3);
    std::ranges::fill(rare.beauty.pixels, 1.0f);
    std::fill_n(rare.beauty.at(1, 1), 3, 100.0f);
    std::fill_n(rare.aovs[0].image.at(1, 1), 3, 10000.0f);
    rare.stats.samples = kMinSamples;
    EXPECT_NEAR(*estimated_relmse({"variance"}, rare), 10000 / 1.01 / 9, 1e-2);
    EXPECT_FALSE(estimated_relmse({"albedo"}, result));
    result.stats.samples = kMinSamples - 1;
    EXPECT_FALSE(estimated_relmse({"variance"}, result)) << "too few samples for an estimate";
}

TEST(DisplayImage, BiasesBelongToTheShownLayer) {
    RenderStats stats;
    stats.biases = {"filtered", "clamped"};
    stats.layer_biases = {"clamped"};
    LayerView layer_view;
    EXPECT_EQ(biases_of(layer_view, stats), stats.biases);
    layer_view.components[2] = false;
    EXPECT_EQ(biases_of(layer_view, stats), stats.layer_biases) << "layers are without the filter, and so is their sum";
    layer_view.layer = "indirect_diffuse";
    EXPECT_EQ(biases_of(layer_view, stats), stats.layer_biases);
    layer_view.layer = kError;
    EXPECT_EQ(biases_of(layer_view, stats), stats.biases) << "it is relative to the picture";
}

TEST(Requests, ServeRequestsThatDifferInTheShownLayer) {
    Request made;
    made.aovs = {"variance", "emission"};
    Request other = made;
    for (const auto& aovs : {std::vector<std::string>{"indirect_glossy", "samples", "variance"}, {}}) {
        other.aovs = aovs;
        EXPECT_TRUE(serves(made, other));
        EXPECT_TRUE(serves(other, made)) << "all layers are gathered";
    }
    other.region = PixelWindow{{1, 2}, {3, 4}};
    EXPECT_TRUE(serves(made, other)) << "a region keeps the samples";
    EXPECT_FALSE(other == made);
    for (void (*change)(Request&) : {+[](Request& r) { r.bounces = 1; }, +[](Request& r) { r.modes.clamp = 1; },
                                     +[](Request& r) { r.camera.camera_to_world[3].x = 1; }}) {
        other = made;
        change(other);
        EXPECT_FALSE(serves(made, other));
    }
}

TEST(Region, KeepsItsPlaceWhereTheSizeChanges) {
    const auto region = region_of({{32, -5}, {160, 45}}, {320, 90});
    ASSERT_TRUE(region);
    EXPECT_EQ(pixels_of(*region, {320, 90}), (PixelWindow{{32, 0}, {160, 45}}));
    EXPECT_EQ(pixels_of(*region, {640, 180}), (PixelWindow{{64, 0}, {320, 90}}));
    EXPECT_EQ(pixels_of(*region, {1, 1}), std::nullopt) << "it is the whole picture";
    EXPECT_EQ(pixels_of({{1, 1}, {1, 1}}, {10, 10}), (PixelWindow{{9, 9}, {10, 10}})) << "a region is never empty";
    EXPECT_FALSE(region_of({{400, 10}, {500, 20}}, {320, 90}));
    EXPECT_FALSE(region_of({{10, 10}, {10, 20}}, {320, 90}));
    EXPECT_EQ(window_between({5.5, 9.5}, {2.5, 3}), (PixelWindow{{2, 3}, {6, 10}}));
}

/// Returns a picture of one row with a colour, a variance and a number of samples in each pixel.
RenderResult row_of_pixels(int width, int samples, float color, float variance) {
    RenderResult row;
    row.stats.samples = samples;
    const auto filled = [&](int channels, float value) {
        Image image(width, 1, channels);
        std::ranges::fill(image.pixels, value);
        return image;
    };
    row.beauty = filled(4, color);
    row.aovs.push_back({{"variance.R", "variance.G", "variance.B"}, filled(3, variance), ExrType::float32, "variance"});
    row.aovs.push_back({{"samples"}, filled(1, static_cast<float>(samples)), ExrType::float32, "samples"});
    row.aovs.push_back({{"Z"}, filled(1, color), ExrType::float32, "depth"});
    return row;
}

TEST(StandingPicture, RegionsHaveMoreSamplesUntilTheRestHasThem) {
    StandingPicture standing;
    standing.take(row_of_pixels(3, 2, 1, 0.5f));
    const PixelWindow window{{1, 0}, {2, 1}};
    standing.add(row_of_pixels(1, 6, 5, 0.25f), window);
    EXPECT_EQ(standing.most({{0, 0}, {3, 1}}), 8);
    EXPECT_EQ(standing.least({{0, 0}, {3, 1}}), 2);
    EXPECT_EQ(standing.least(window), 8);
    const RenderResult& picture = standing.picture();
    EXPECT_EQ(picture.beauty.at(1, 0)[0], 4) << "the mean is weighted by samples";
    EXPECT_EQ(picture.beauty.at(0, 0)[0], 1);
    EXPECT_EQ(picture.aovs[0].image.at(1, 0)[0], (4 * 0.5f + 36 * 0.25f) / 64);
    EXPECT_EQ(picture.aovs[1].image.pixels, (std::vector<float>{2, 8, 2}));
    EXPECT_EQ(picture.aovs[2].image.at(1, 0)[0], 1) << "depth is that of the pixel's centre";

    RenderResult later = row_of_pixels(3, 7, 3, 0.5f);
    standing.lay_over(later);
    EXPECT_EQ(later.beauty.at(1, 0)[0], 4) << "the region still has more samples";
    EXPECT_EQ(later.beauty.at(2, 0)[0], 3);
    RenderResult same = row_of_pixels(3, 8, 2, 0.5f);
    standing.lay_over(same);
    EXPECT_EQ(same.beauty.at(1, 0)[0], 2) << "the rest has as many";
}

TEST(StandingPicture, OneSampleHasNoVarianceOfItsOwn) {
    StandingPicture standing;
    standing.take(row_of_pixels(1, 4, 1, 0.25f));  // samples have a variance of 1
    const PixelWindow window{{0, 0}, {1, 1}};
    EXPECT_EQ(standing.with(row_of_pixels(1, 1, 1, 0), window).aovs[0].image.pixels[0], 0.2f);
    StandingPicture single;
    single.take(row_of_pixels(1, 1, 1, 0));
    EXPECT_EQ(single.with(row_of_pixels(1, 4, 1, 0.25f), window).aovs[0].image.pixels[0], 0.2f);
}

Picture with_passes(int samples, std::vector<PassTime> passes) {
    Picture picture;
    picture.result.stats.samples = samples;
    picture.result.stats.passes = std::move(passes);
    return picture;
}

TEST(PassHistory, HoldsEachSamplesTime) {
    PassHistory history;
    history.add(with_passes(1, {{"a", 1, 0.5}, {"b", 1, 1}}));
    history.add(with_passes(3, {{"a", 3, 0.75}, {"b", 3, 5}}));
    ASSERT_EQ(history.passes().size(), 2u);
    EXPECT_EQ(history.passes()[0].milliseconds, (std::vector<float>{500, 125}));
    EXPECT_EQ(history.passes()[1].milliseconds, (std::vector<float>{1000, 2000}));
    history.add(with_passes(3, {{"a", 3, 0.75}, {"b", 3, 5}}));
    EXPECT_EQ(history.passes()[0].milliseconds.size(), 2u) << "the same samples in another view";
    // Another view starts a new history, without passes that the view lacks.
    history.add(with_passes(1, {{"b", 1, 3}, {"c", 1, 0.25}}));
    ASSERT_EQ(history.passes().size(), 2u);
    EXPECT_EQ(history.passes()[0].milliseconds, (std::vector<float>{1000, 2000, 3000}));
    EXPECT_EQ(history.passes()[1].milliseconds, std::vector<float>{250});
    Picture coarse = with_passes(1, {{"b", 1, 1}});
    coarse.divisor = 4;
    history.add(coarse);
    history.add(with_passes(2, {}));
    EXPECT_EQ(history.passes()[0].milliseconds.size(), 3u);
    for (int i = 2; i < 200; ++i) history.add(with_passes(i, {{"b", 1, double(i)}, {"c", 1, 1}}));
    EXPECT_EQ(history.passes()[0].milliseconds.size(), PassHistory::kLength);
}

TEST(Timings, MeasureFirstPictures) {
    Timings timings;
    Picture picture;
    picture.divisor = 4;
    for (std::uint64_t i = 1; i <= 3; ++i) {
        timings.record_request(i, double(i));
        if (i == 2) continue;  // the next request supersedes this one
        picture.request = i;
        timings.record_shown(picture, double(i) + 0.25);
        timings.record_shown(picture, double(i) + 0.5);
    }
    picture.divisor = 1;
    picture.seconds = 7;
    picture.result.stats.samples = 12;
    timings.record_shown(picture, 20);
    EXPECT_FALSE(timings.json()["last_picture"].contains("estimated_relmse"));
    picture.relmse = 0.25;
    timings.record_shown(picture, 21);
    EXPECT_FALSE(timings.json()["last_picture"].contains("relmse"));
    timings.record_error(0.125);
    const auto json = timings.json();
    EXPECT_EQ(json["views"], 2);
    EXPECT_EQ(json["seconds_to_first_picture"]["median"], 0.25);
    EXPECT_EQ(json["first_pictures_per_second"], 0.5);
    EXPECT_EQ(json["resolutions"]["1/4"], 2);
    EXPECT_EQ(json["last_picture"]["samples"], 12);
    EXPECT_EQ(json["last_picture"]["seconds"], 7.0);
    EXPECT_EQ(json["last_picture"]["estimated_relmse"], 0.25);
    EXPECT_EQ(json["last_picture"]["relmse"], 0.125);
}

TEST(LinearPicture, IsThatOfTheDisplayWindow) {
    const TemporaryFolder folder;
    Image image(4, 3, 3);
    std::ranges::fill(image.pixels, 1.0f);
    ExrAttributes attributes;
    attributes.origin = {1, -1}, attributes.display = ivec2(6, 3);
    write_exr(folder / "a.exr", {{{"R", "G", "B"}, image}}, attributes);
    const Image read = read_linear(folder / "a.exr");
    ASSERT_EQ(ivec2(read.width, read.height), ivec2(6, 3));
    EXPECT_EQ(*read.at(0, 0), 0);
    EXPECT_EQ(*read.at(1, 1), 1);
    EXPECT_EQ(*read.at(1, 2), 0);
}

}  // namespace
}  // namespace halflight::view
