// Tests the files that the program writes.
#include <cmath>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>

#include "engine/core/metrics.h"
#include "renderer/render.h"
#include "tests/cli/output_test.h"

namespace halflight::test {
namespace {

/// Returns width and height from the header of a PNG file, which must be complete.
std::pair<int, int> png_size(const std::string& path) {
    const std::string bytes = read_text(path);
    EXPECT_TRUE(bytes.starts_with("\x89PNG\r\n\x1a\n"));
    EXPECT_EQ(bytes.substr(bytes.size() - 8, 4), "IEND");
    const auto number = [&](std::size_t at) {
        int value = 0;
        for (std::size_t i = at; i < at + 4; ++i) value = value * 256 + static_cast<unsigned char>(bytes.at(i));
        return value;
    };
    return {number(16), number(20)};
}

TEST_F(Output, ExrAndPngInOneRun) {
    render({file("a.exr"), file("a.png"), "--width", "40", "--height", "20"});
    const ExrFile exr = read_exr(file("a.exr"));
    EXPECT_EQ(exr.width, 40);
    EXPECT_EQ(exr.height, 20);
    EXPECT_EQ(channel_names(exr), (Strings{"A", "B", "G", "R"}));
    EXPECT_EQ(exr.find("R")->type, ExrType::float32);
    EXPECT_EQ(png_size(file("a.png")), std::pair(40, 20));
    EXPECT_EQ(folder.entries(), (Strings{"a.exr", "a.png", "room.bin", "room.gltf"}));

    EXPECT_NE(exr.attributes.software.find("halflight"), std::string::npos);
    EXPECT_NE(exr.attributes.comments.find("1 samples"), std::string::npos) << exr.attributes.comments;
    ASSERT_TRUE(exr.attributes.world_to_camera && exr.attributes.world_to_clip && exr.attributes.chromaticities);
    // The camera "front" is at (0, 1, 6), which is the origin of camera space. The picture's centre lies straight
    // ahead.
    EXPECT_NEAR(glm::length(dvec3(*exr.attributes.world_to_camera * dvec4(0, 1, 6, 1))), 0, 1e-6);
    const dvec4 ahead = *exr.attributes.world_to_clip * dvec4(0, 1, 0, 1);
    EXPECT_NEAR(ahead.x / ahead.w, 0, 1e-6);
    EXPECT_NEAR(ahead.y / ahead.w, 0, 1e-6);
    // The upper edge of the view, 0.4 radians above the axis, is the upper edge of the picture.
    const dvec4 top = *exr.attributes.world_to_clip * dvec4(0, 1 + 6 * std::tan(0.4), 0, 1);
    EXPECT_NEAR(top.y / top.w, 1, 1e-6);
}

TEST_F(Output, DepthOfField) {
    render({file("sharp.exr"), "--width", "40"});
    render({file("point.exr"), "--width", "40", "--focus", "0.5,0.7", "--fstop", "0.5", "--blades", "6"});
    const ExrFile sharp = read_exr(file("sharp.exr")), point = read_exr(file("point.exr"));
    EXPECT_FALSE(sharp.attributes.extra.contains("lens"));
    const std::string lens = point.attributes.extra.at("lens");
    std::smatch found;
    ASSERT_TRUE(
        std::regex_match(lens, found, std::regex("f/0.5, aperture ([0-9.]+) mm, focus at ([0-9.]+) m, 6 blades")))
        << lens;
    EXPECT_NE(point.find("R")->values, sharp.find("R")->values);
    // The diameter and the distance define an equal lens, apart from the rounding of the text.
    render({file("distance.exr"), "--width", "40", "--focus", found[2], "--aperture", found[1], "--blades", "6"});
    EXPECT_EQ(read_exr(file("distance.exr")).attributes.extra.at("lens"), lens.substr(lens.find("aperture")));
}

TEST_F(Output, RequestedLayersAreWritten) {
    render({file("all.exr"), "--aov", "all", "--half"});
    const ExrFile all = read_exr(file("all.exr"));
    std::size_t channels = 4;  // RGBA
    for (const AovInfo& aov : known_aovs())
        if (aov.in_all()) channels += aov.channel_names().size();
    EXPECT_EQ(all.channels.size(), channels);
    EXPECT_EQ(all.find("R")->type, ExrType::half);
    for (const ExrChannel& channel : all.channels) {
        if (channel.type == ExrType::uint32) continue;
        const auto good = [](float v) { return std::isfinite(v); };
        EXPECT_TRUE(std::ranges::all_of(channel.values, good)) << channel.name;
    }

    render({file("two.exr"), "--aov", "normal,albedo", "--aov", "albedo"});
    EXPECT_EQ(channel_names(read_exr(file("two.exr"))),
              (Strings{"A", "B", "G", "R", "albedo.B", "albedo.G", "albedo.R", "normal.X", "normal.Y", "normal.Z"}));
}

TEST_F(Output, FilterAndBiasAreRecorded) {
    render({file("usual.exr"), "--stats", file("usual.json")});
    render({file("box.exr"), "--filter", "box", "--filter-radius", "0.5"});
    EXPECT_TRUE(same_pixels(file("usual.exr"), file("box.exr")));
    auto extra = read_exr(file("usual.exr")).attributes.extra;
    EXPECT_EQ(extra["filter"], "box, radius 0.5 pixels");
    EXPECT_FALSE(extra.contains("bias"));
    auto stats = nlohmann::json::parse(read_text(file("usual.json")));
    EXPECT_EQ(stats["settings"]["clamp"], nullptr);
    EXPECT_EQ(stats["settings"]["primary"], "raster");
    EXPECT_TRUE(stats["biases"].empty());

    const Outcome outcome = render({file("soft.exr"), "--stats", file("soft.json"), "--filter", "blackman-harris",
                                    "--clamp", "0.5", "--primary", "traced"});
    EXPECT_FALSE(same_pixels(file("usual.exr"), file("soft.exr")));
    EXPECT_NE(outcome.err.find("biased: indirect light clamped to a luminance of 0.5 per sample"), std::string::npos);
    const ExrFile soft = read_exr(file("soft.exr"));
    EXPECT_NE(soft.attributes.comments.find("filter blackman-harris, radius 1.5 pixels"), std::string::npos);
    extra = soft.attributes.extra;
    EXPECT_EQ(extra["filter"], "blackman-harris, radius 1.5 pixels");
    EXPECT_EQ(extra["bias"], "indirect light clamped to a luminance of 0.5 per sample");
    stats = nlohmann::json::parse(read_text(file("soft.json")));
    EXPECT_EQ(stats["settings"]["filter"], (nlohmann::json{{"shape", "blackman-harris"}, {"radius", 1.5}}));
    EXPECT_EQ(stats["settings"]["clamp"], 0.5);
    EXPECT_EQ(stats["settings"]["primary"], "traced");
    EXPECT_EQ(stats["biases"].size(), 1u);
}

TEST_F(Output, PreviewsAreNamedWhileTheyContribute) {
    const auto bias = [&](const char* name) { return read_exr(file(name)).attributes.extra["bias"]; };
    render({file("early.exr"), "--stats", file("early.json"), "--preview", "cache", "--samples", "11"});
    EXPECT_EQ(bias("early.exr"), "preview: 60 % of the light comes from the radiance cache, none from 32 samples on");
    EXPECT_NE(read_exr(file("early.exr")).attributes.comments.find("preview cache"), std::string::npos);
    const auto stats = nlohmann::json::parse(read_text(file("early.json")));
    EXPECT_EQ(stats["settings"]["preview"], "cache");
    EXPECT_EQ(stats["biases"].size(), 1u);
    EXPECT_GT(stats["radiance_cache"]["used"], 0);
    render({file("late.exr"), "--preview", "cache", "--samples", "32"});
    EXPECT_EQ(bias("late.exr"), "");
    render({file("plain.exr"), "--samples", "28"});
    EXPECT_TRUE(same_pixels(file("late.exr"), file("plain.exr")));
    EXPECT_FALSE(same_pixels(file("early.exr"), file("plain.exr")));
}

TEST_F(Output, RendersToAnErrorAndReportsIt) {
    const auto attribute = [&](const char* name) { return read_exr(file(name)).attributes.extra["error"]; };
    const Strings easy{"--error", "0.5", "--samples", "256"}, hard{"--error", "1e-9", "--samples", "20"};
    const auto with = [](Strings first, const Strings& more) {
        first.insert(first.end(), more.begin(), more.end());
        return first;
    };
    render(with({file("easy.exr"), "--stats", file("easy.json")}, easy));
    const auto reached = nlohmann::json::parse(read_text(file("easy.json")))["error"];
    EXPECT_EQ(reached["metric"], "relmse");
    EXPECT_EQ(reached["reached"], true);
    EXPECT_LE(reached["bound"], 0.5);
    EXPECT_TRUE(std::regex_match(attribute("easy.exr"), std::regex("relmse .* to .* at 95 %, target 0.5 reached")))
        << attribute("easy.exr");

    const auto before = folder.entries();
    const Outcome outcome =
        run_program(with({"render", scene, file("hard.exr"), "--width", "32", "--height", "32", "--quiet"}, hard));
    EXPECT_EQ(outcome.status, 1);
    EXPECT_NE(outcome.err.find("hard.exr: not written: after 16 samples per pixel, relmse "), std::string::npos)
        << outcome.err;
    EXPECT_EQ(folder.entries(), before);

    render(with({file("hard.exr"), "--best-effort", "--error-metric", "mse"}, hard));
    EXPECT_TRUE(std::regex_match(attribute("hard.exr"), std::regex("mse .*, target 1e-09 not reached")))
        << attribute("hard.exr");
    EXPECT_NE(read_exr(file("hard.exr")).attributes.comments.find("16 samples"), std::string::npos);
}

TEST_F(Output, CameraAndSizeFollowTheScene) {
    render({file("front.exr"), "--width", "24", "--height", "24"});
    render({file("zero.exr"), "--width", "24", "--height", "24", "--camera", "0"});
    render({file("above.exr"), "--width", "24", "--height", "24", "--camera", "above"});
    EXPECT_TRUE(same_pixels(file("front.exr"), file("zero.exr")));
    EXPECT_FALSE(same_pixels(file("front.exr"), file("above.exr")));
    // The aspect ratio of "above" is 2:1.
    const Outcome outcome =
        run_program({"render", scene, file("size.exr"), "--camera", "above", "--width", "40", "--samples", "1"});
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_EQ(read_exr(file("size.exr")).height, 20);
    // These options give the view of the file's camera.
    render({file("hand.exr"), "--width", "24", "--height", "24", "--look-from", "0,1,6", "--look-at", "0,1,0", "--vfov",
            "45.836623610465857"});  // 0.8 radians
    const Image front = read_exr(file("front.exr")).image({"R", "G", "B"});
    const Image hand = read_exr(file("hand.exr")).image({"R", "G", "B"});
    double difference = 0;
    for (std::size_t i = 0; i < front.pixels.size(); ++i) difference += std::abs(front.pixels[i] - hand.pixels[i]);
    EXPECT_LT(difference / static_cast<double>(front.pixels.size()), 0.01);
}

TEST_F(Output, SameCommandSamePicture) {
    const Strings settings = {"--samples", "3", "--seed", "7", "--aov", "all"};
    const auto with = [&](const std::string& output) {
        Strings arguments = settings;
        arguments.push_back(file(output));
        return arguments;
    };
    render(with("a.exr"), fixed_date);
    render(with("b.exr"), fixed_date);
    EXPECT_EQ(read_text(file("a.exr")), read_text(file("b.exr")));
    RunOptions threads = fixed_date;
    threads.environment.push_back("LP_NUM_THREADS=1");
    render(with("c.exr"), threads);
    EXPECT_EQ(read_text(file("a.exr")), read_text(file("c.exr"))) << "the number of threads shows";
    render({file("d.exr"), "--samples", "3", "--seed", "8", "--aov", "all"}, fixed_date);
    EXPECT_FALSE(same_pixels(file("a.exr"), file("d.exr"))) << "the seed does nothing";
    render({file("e.exr"), "--samples", "3", "--seed", "7", "--aov", "all", "--frame", "1"}, fixed_date);
    EXPECT_FALSE(same_pixels(file("a.exr"), file("e.exr"))) << "the frame does nothing";
}

TEST_F(Output, CullingChangesNoPicture) {
    const auto with = [&](const std::string& culling) {
        const std::string output = file(culling + ".exr");
        render({output, "--samples", "8", "--aov", "all", "--culling", culling}, fixed_date);
        return read_text(output);
    };
    const std::string off = with("off");
    for (const char* culling : {"compute", "raster", "native", "auto"}) EXPECT_TRUE(with(culling) == off) << culling;
}

TEST_F(Output, ViewChangesThePngOnly) {
    render({file("a.exr"), file("a.png")});
    render({file("b.exr"), file("b.png"), "--exposure", "1"});
    EXPECT_TRUE(same_pixels(file("a.exr"), file("b.exr")));
    EXPECT_NE(read_text(file("a.png")), read_text(file("b.png")));
}

TEST_F(Output, WorkingSpace) {
    render({file("rec709.exr"), "--working-space", "rec709"});
    render({file("acescg.exr"), "--working-space", "acescg"});
    const ExrFile rec709 = read_exr(file("rec709.exr")), acescg = read_exr(file("acescg.exr"));
    ASSERT_TRUE(acescg.attributes.chromaticities);
    EXPECT_NEAR(acescg.attributes.chromaticities->red.x, 0.713, 1e-5);
    // White stays white, so each row of the matrix sums to 1 (rgb_conversion()).
    const Image a = rec709.image({"R", "G", "B"}), b = acescg.image({"R", "G", "B"});
    const mat3 matrix(rgb_conversion(kRec709, kAp1));
    for (int y = 0; y < a.height; ++y) {
        for (int x = 0; x < a.width; ++x) {
            const vec3 expected = matrix * vec3(a.at(x, y)[0], a.at(x, y)[1], a.at(x, y)[2]);
            for (int c = 0; c < 3; ++c) ASSERT_NEAR(b.at(x, y)[c], expected[c], 1e-4f * (1 + std::abs(expected[c])));
        }
    }
}

TEST_F(Output, StrictWritesNothingAfterABadValue) {
    render({file("a.exr"), "--strict"});
    // The sky is near the limit of floats, so its radiance divided by the density overflows.
    const char* const sky = "3e38,3e38,3e38";
    const Outcome warned = render({file("b.exr"), "--env", sky, "--stats", file("stats.json")});
    EXPECT_NE(warned.err.find("shadow gave "), std::string::npos) << warned.err;
    const auto bad = nlohmann::json::parse(read_text(file("stats.json"))).at("bad_values").at("shadow");
    EXPECT_GT(bad.at("nan").get<int>() + bad.at("infinite").get<int>(), 0) << "infinite / infinite is NaN";
    const Image picture = read_exr(file("b.exr")).image({"R", "G", "B"});
    EXPECT_TRUE(std::ranges::all_of(picture.pixels, [](float v) { return std::isfinite(v) && v >= 0; }));

    const auto files = folder.entries();
    const Outcome strict = run_program({"render", scene, file("c.exr"), "--width", "32", "--height", "32", "--samples",
                                        "1", "--env", sky, "--strict", "--quiet", "--stats", file("other.json")});
    EXPECT_EQ(strict.status, 1);
    EXPECT_TRUE(std::regex_match(strict.err, std::regex("halflight: .*c.exr: not written: shadow gave .*\n")))
        << strict.err;
    EXPECT_EQ(folder.entries(), files);
}

TEST_F(Output, FoldersAreMade) {
    render({file("new/deeper/a.exr"), "--stats", file("other/a.json")});
    EXPECT_EQ(read_exr(file("new/deeper/a.exr")).width, 32);
    EXPECT_NE(read_text(file("other/a.json")), "");
}

TEST_F(Output, AFileThatFailsDoesNotPreventOthers) {
    // The .exr with all layers takes more bytes than the limit, the .png fewer.
    const Strings all = {"render", scene,   file("a.exr"), file("a.png"),       "--width", "128",    "--samples",
                         "1",      "--aov", "all",         "--exr-compression", "none",    "--quiet"};
    const Outcome outcome =
        run_program(all, {.environment = {"HALFLIGHT_SHADER_SOURCES"}, .wrapper = {"prlimit", "--fsize=200000"}});
    EXPECT_EQ(outcome.status, 1);
    EXPECT_NE(outcome.err.find("a.exr: "), std::string::npos) << outcome.err;
    EXPECT_FALSE(std::filesystem::exists(file("a.exr")));
    EXPECT_TRUE(std::filesystem::exists(file("a.png")));
}

TEST_F(Output, ValuesBeyondHalfFloatsAreCounted) {
    const Strings bright = {"--material", "lamp.emission=200000,200000,200000", "--width", "32"};
    Strings half = {file("a.exr"), "--half"};
    half.insert(half.end(), bright.begin(), bright.end());
    EXPECT_NE(render(half).err.find("values are beyond 65504, the largest half float"), std::string::npos);
    Strings whole = {file("a.exr")};
    whole.insert(whole.end(), bright.begin(), bright.end());
    EXPECT_EQ(render(whole).err.find("65504"), std::string::npos);
}

TEST_F(Output, TimeLimitDecides) {
    render({file("a.exr"), "--samples", "1"});  // compiles the shaders, which the driver then caches
    const Outcome outcome = run_program({"render", scene, file("b.exr"), "--width", "32", "--height", "32", "--time",
                                         "2", "--stats", file("stats.json")});
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    const auto stats = nlohmann::json::parse(read_text(file("stats.json")));
    // The run ends where one more sample would exceed the limit, on machines of any speed.
    const double samples = stats.at("samples");
    EXPECT_LT(samples, 1e6);
    EXPECT_GE(stats.at("seconds").at("total"), 2 * samples / (samples + 1));

    // The filter needs two samples, whose time does not matter.
    render({file("two.exr"), "--denoise", "--samples", "9", "--time", "1e-6", "--stats", file("two.json")});
    EXPECT_EQ(nlohmann::json::parse(read_text(file("two.json"))).at("samples"), 2);

    render({file("both.exr"), "--samples", "3", "--time", "1000", "--stats", file("both.json")});
    EXPECT_EQ(nlohmann::json::parse(read_text(file("both.json"))).at("samples"), 3);
}

TEST_F(Output, SceneWithoutLightGetsASky) {
    scene = copy_room(folder.path, false);
    EXPECT_NE(render({file("a.exr")}).err.find("the scene has no light: a neutral sky is added"), std::string::npos);
    EXPECT_EQ(render({file("b.exr"), "--env", "0,0,0"}).err.find("sky"), std::string::npos);
    const Image dark = read_exr(file("b.exr")).image({"R", "G", "B"});
    EXPECT_TRUE(std::ranges::all_of(dark.pixels, [](float v) { return v == 0; }));
}

TEST_F(Output, EnvironmentsAreGeneratedTurnedAndScaled) {
    scene = copy_room(folder.path, false);
    const auto mean = [&](const Strings& options) {
        Strings arguments = {file("a.exr"), "--reproducible"};
        arguments.insert(arguments.end(), options.begin(), options.end());
        const Outcome outcome = render(arguments);
        EXPECT_EQ(outcome.status, 0) << outcome.err;
        EXPECT_EQ(outcome.err.find("neutral sky"), std::string::npos) << outcome.err;
        double sum = 0;
        const Image picture = read_exr(file("a.exr")).image({"R", "G", "B"});
        for (const float v : picture.pixels) sum += double(v);
        return sum / double(picture.pixels.size());
    };
    EXPECT_EQ(mean({"--env", "none"}), 0);
    const double studio = mean({"--env", "studio"});
    EXPECT_GT(studio, 0.01);
    EXPECT_LT(studio, 10);
    EXPECT_NEAR(mean({"--env", "studio", "--env-intensity", "0.5"}), studio / 2, 1e-4 * studio);
    EXPECT_NE(mean({"--env", "studio", "--env-rotation", "90"}), studio);
    EXPECT_GT(mean({"--sky", "60,180"}), 100) << "nits";
    const double sky = mean({"--env", "sky"});
    test::write_text(file("settings.json"), R"({"halflight_settings": 1, "environment": {"preset": "sky"}})");
    EXPECT_EQ(mean({"--settings", file("settings.json")}), sky);
    EXPECT_EQ(mean({"--settings", file("settings.json"), "--env", "none"}), 0) << "options come first";
    EXPECT_NEAR(mean({"--settings", file("settings.json"), "--env-intensity", "2"}), 2 * sky, 1e-3 * sky);
}

TEST_F(Output, DebugLayersOnlyIfNamed) {
    render({file("a.exr"), "--aov", "nodes,culling", "--culling", "compute"});
    const ExrFile exr = read_exr(file("a.exr"));
    EXPECT_EQ(channel_names(exr), (Strings{"A", "B", "G", "R", "culling.leaves", "culling.others", "nodes.Y"}));
    EXPECT_GE(std::ranges::max(exr.find("culling.leaves")->values), 1);
    EXPECT_GE(std::ranges::min(exr.find("nodes.Y")->values), 1);
    render({file("b.exr"), "--aov", "culling", "--culling", "off"});
    EXPECT_EQ(std::ranges::max(read_exr(file("b.exr")).find("culling.leaves")->values), 0);
}

TEST_F(Output, DenoisedPicturesNameTheirBiasAndKeepTheMean) {
    scene = HALFLIGHT_SOURCE_DIR "/scenes/cornell.glb";
    const auto with = [&](Strings more) {
        const Strings common = {"--samples", "4", "--seed", "3", "--width", "64", "--height", "64"};
        more.insert(more.end(), common.begin(), common.end());
        return more;
    };
    render(with({file("mean.exr")}));
    render(with({file("clean.exr"), "--denoise", "--aov", "noisy,denoiser", "--stats", file("clean.json")}));
    render({file("truth.exr"), "--samples", "512", "--width", "64", "--height", "64"});
    const ExrFile mean = read_exr(file("mean.exr")), clean = read_exr(file("clean.exr")),
                  truth = read_exr(file("truth.exr"));
    const auto error = [&](const ExrFile& picture) {
        double sum = 0;
        for (std::size_t i = 0; i < truth.find("G")->values.size(); ++i) {
            const double exact = truth.find("G")->values[i], difference = picture.find("G")->values[i] - exact;
            sum += difference * difference / (exact * exact + kRelativeEpsilon);
        }
        return sum;
    };
    EXPECT_EQ(clean.find("noisy.G")->values, mean.find("G")->values);
    EXPECT_LT(error(clean), 0.7 * error(mean));
    for (const char* channel : {"denoiser.direct_diffuse", "denoiser.indirect_diffuse", "denoiser.glossy"}) {
        const std::vector<float>& weights = clean.find(channel)->values;
        EXPECT_GE(std::ranges::min(weights), 0) << channel;
        EXPECT_LE(std::ranges::max(weights), 1) << channel;
    }
    EXPECT_GT(std::ranges::max(clean.find("denoiser.indirect_diffuse")->values), 0.5f);
    EXPECT_NE(read_text(file("clean.exr")).find("denoised: noise of reflected light filtered"), std::string::npos);
    const auto biases = nlohmann::json::parse(read_text(file("clean.json"))).at("biases");
    ASSERT_EQ(biases.size(), 1u);
    EXPECT_TRUE(nlohmann::json::parse(read_text(file("clean.json"))).at("denoised_error").is_null());
    render(with({file("judged.exr"), "--denoise", "--denoise-error", "16", "--aov", "noisy,denoiser", "--stats",
                 file("judged.json")}));
    const ExrFile judged = read_exr(file("judged.exr"));
    for (const char* channel : {"R", "noisy.G", "denoiser.glossy"})
        EXPECT_EQ(judged.find(channel)->values, clean.find(channel)->values) << channel;
    const auto estimate = nlohmann::json::parse(read_text(file("judged.json"))).at("denoised_error");
    EXPECT_EQ(estimate["held_out_samples"], 32);
    EXPECT_LT(estimate["lower"], estimate["value"]);
    EXPECT_LT(estimate["value"], estimate["upper"]);
    EXPECT_NE(read_text(file("judged.exr")).find("denoised picture: estimated relmse"), std::string::npos);
    EXPECT_EQ(read_text(file("mean.exr")).find("denoised:"), std::string::npos);
}

TEST_F(Output, KeepAllKeepsThePicture) {
    render({file("lean.exr"), "--stats", file("lean.json")});
    render({file("kept.exr"), "--stats", file("kept.json"), "--keep-all"});
    EXPECT_TRUE(same_pixels(file("lean.exr"), file("kept.exr")));
    const auto lean = nlohmann::json::parse(read_text(file("lean.json")));
    const auto kept = nlohmann::json::parse(read_text(file("kept.json")));
    EXPECT_GT(kept.at("gpu_bytes"), lean.at("gpu_bytes"));
    EXPECT_GT(lean.at("left_out").size(), kept.at("left_out").size());
    EXPECT_EQ(lean.at("settings").at("kept"), "nothing");
    EXPECT_EQ(kept.at("settings").at("kept"), "everything");
    render({file("some.exr"), "--stats", file("some.json"), "--keep", "clearcoat,sums of squares", "--keep",
            "alpha tests"});
    EXPECT_TRUE(same_pixels(file("lean.exr"), file("some.exr")));
    const auto some = nlohmann::json::parse(read_text(file("some.json")));
    EXPECT_EQ(some.at("settings").at("kept"), "alpha tests,clearcoat,sums of squares");
    std::set<std::string> gone;
    for (const auto& part : lean.at("left_out")) gone.insert(part.at("what").get<std::string>());
    for (const auto& part : some.at("left_out")) gone.erase(part.at("what").get<std::string>());
    EXPECT_EQ(gone, (std::set<std::string>{"alpha tests", "clearcoat", "sums of squares"}));
}

TEST_F(Output, CompiledShadersAreKeptForTheNextRun) {
    const RunOptions cached{.environment = {"XDG_CACHE_HOME=" + folder.path.string()}};
    const std::filesystem::path programs = folder.path / "halflight" / "programs";
    const auto count = [&] {
        using std::filesystem::directory_iterator;
        return std::filesystem::exists(programs) ? std::distance(directory_iterator(programs), {}) : 0;
    };
    render({file("none.exr"), "--no-shader-cache"}, cached);
    EXPECT_EQ(count(), 0);
    render({file("cold.exr")}, cached);
    const auto kept = count();
    if (kept == 0) GTEST_SKIP() << "this driver gives no program binaries";
    render({file("warm.exr")}, cached);
    EXPECT_EQ(count(), kept);
    // A damaged cache file costs time but changes no picture.
    int i = 0;
    for (const auto& entry : std::filesystem::directory_iterator(programs)) {
        const std::string good = read_text(entry.path());
        const std::string bad[] = {"", good.substr(0, good.size() / 2), std::string(good.size(), 'x')};
        write_text(entry.path(), bad[i++ % 3]);
    }
    render({file("bad.exr")}, cached);
    for (const char* name : {"cold.exr", "warm.exr", "bad.exr"})
        EXPECT_TRUE(same_pixels(file("none.exr"), file(name))) << name;
    EXPECT_EQ(count(), kept) << "replaced";
}

/// Machine code that the second thread makes serves the first one, or there would be more of it.
TEST_F(Output, TwoThreadsCompileTheProgramsOfOne) {
    const auto code_made_by = [&](const std::string& threads) {
        const std::filesystem::path cache = folder / ("cache of " + threads);
        const RunOptions cold{
            .environment = {"XDG_CACHE_HOME=" + cache.string(), "MESA_SHADER_CACHE_DIR=" + cache.string()}};
        render({file(threads + ".exr"), "--threads", threads}, cold);
        std::size_t files = 0;
        for (const auto& entry : std::filesystem::recursive_directory_iterator(cache / "mesa_shader_cache"))
            files += entry.is_regular_file() ? 1 : 0;
        return files;
    };
    EXPECT_EQ(code_made_by("2"), code_made_by("1"));
    EXPECT_TRUE(same_pixels(file("1.exr"), file("2.exr")));
}

TEST_F(Output, TakesNamesInAnyOrder) {
    render({file("a.exr")});
    const Strings size = {"--width", "32", "--height", "32", "--spp", "1"};
    for (const Strings& names :
         {Strings{file("b.exr"), file("b.png"), scene}, Strings{file("b.exr"), scene, "-o", file("b.png")}}) {
        Strings command = {"render"};
        command.insert(command.end(), names.begin(), names.end());
        command.insert(command.end(), size.begin(), size.end());
        const Outcome outcome = run_program(command);
        EXPECT_EQ(outcome.status, 0) << outcome.err;
        EXPECT_TRUE(same_pixels(file("a.exr"), file("b.exr")));
        EXPECT_TRUE(std::filesystem::remove(file("b.png")));
    }
}

}  // namespace
}  // namespace halflight::test
