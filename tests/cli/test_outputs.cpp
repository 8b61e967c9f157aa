// Tests the files that the program writes.
#include <cmath>
#include <regex>
#include <set>

#include "engine/io/png.h"
#include "renderer/render.h"
#include "tests/cli/output_test.h"

namespace halflight::test {
namespace {

using Json = nlohmann::json;

TEST_F(Output, ExrAndPngInOneRun) {
    render(words(file("a.exr"), file("a.png"), "--width 40 --height 20"));
    const ExrFile exr = read_exr(file("a.exr"));
    EXPECT_EQ(ivec2(exr.width, exr.height), ivec2(40, 20));
    EXPECT_EQ(channel_names(exr), words("A B G R"));
    EXPECT_EQ(exr.find("R")->type, ExrType::float32);
    const Image png = read_png("a.png", read_text(file("a.png")), 4096);
    EXPECT_EQ(ivec2(png.width, png.height), ivec2(40, 20));
    EXPECT_EQ(folder.entries(), words("a.exr a.png room.bin room.gltf"));

    expect_has(exr.attributes.software, "halflight");
    expect_has(exr.attributes.comments, "1 samples");
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
    render({file("sharp.exr")});
    render(words(file("point.exr"), "--focus 0.5,0.7 --fstop 0.5 --blades 6"));
    const ExrFile sharp = read_exr(file("sharp.exr")), point = read_exr(file("point.exr"));
    EXPECT_FALSE(sharp.attributes.extra.contains("lens"));
    const std::string lens = point.attributes.extra.at("lens");
    const std::regex form("f/0.5, aperture ([0-9.]+) mm, focus at ([0-9.]+) m, 6 blades");
    std::smatch found;
    ASSERT_TRUE(std::regex_match(lens, found, form)) << lens;
    EXPECT_NE(point.find("R")->values, sharp.find("R")->values);
    // The diameter and the distance define an equal lens, apart from the rounding of the text.
    render({file("distance.exr"), "--focus", found[2], "--aperture", found[1], "--blades", "6"});
    EXPECT_EQ(read_exr(file("distance.exr")).attributes.extra.at("lens"), lens.substr(lens.find("aperture")));
}

TEST_F(Output, RequestedLayersAreWritten) {
    render(words(file("all.exr"), "--aov all --half"));
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
    render(words(file("two.exr"), "--aov normal,albedo --aov albedo"));
    EXPECT_EQ(channel_names(read_exr(file("two.exr"))),
              words("A B G R albedo.B albedo.G albedo.R normal.X normal.Y normal.Z"));
}

TEST_F(Output, FilterAndBiasAreRecorded) {
    render({file("usual.exr"), "--stats", file("usual.json")});
    render(words(file("box.exr"), "--filter box --filter-radius 0.5"));
    EXPECT_TRUE(same_pixels(file("usual.exr"), file("box.exr")));
    auto extra = read_exr(file("usual.exr")).attributes.extra;
    EXPECT_EQ(extra["filter"], "box, radius 0.5 pixels");
    EXPECT_FALSE(extra.contains("bias"));
    Json stats = json_file(file("usual.json"));
    EXPECT_EQ(stats["settings"]["clamp"], nullptr);
    EXPECT_EQ(stats["settings"]["primary"], "raster");
    EXPECT_TRUE(stats["biases"].empty());

    const Strings soft = words("--filter blackman-harris --clamp 0.5 --primary traced --backfaces cull");
    const Outcome outcome = render(words(file("soft.exr"), "--stats", file("soft.json"), soft));
    EXPECT_FALSE(same_pixels(file("usual.exr"), file("soft.exr")));
    extra = read_exr(file("soft.exr")).attributes.extra;
    EXPECT_EQ(extra["filter"], "blackman-harris, radius 1.5 pixels");
    expect_has(extra["bias"], "luminance of 0.5");
    expect_has(outcome.err, extra["bias"]);
    stats = json_file(file("soft.json"));
    EXPECT_EQ(stats["settings"]["filter"], (Json{{"shape", "blackman-harris"}, {"radius", 1.5}}));
    EXPECT_EQ(stats["settings"]["clamp"], 0.5);
    EXPECT_EQ(stats["settings"]["primary"], "traced");
    EXPECT_EQ(stats["settings"]["backfaces"], "cull");
    expect_has(read_exr(file("soft.exr")).attributes.comments, "back faces cull");
    EXPECT_EQ(stats["biases"].size(), 1u);
}

TEST_F(Output, PreviewsAreNamedWhileTheyContribute) {
    render(words(file("early.exr"), "--stats", file("early.json"), "--preview cache --samples 11"));
    expect_has(bias_of(file("early.exr")), "60 % of the light");
    const Json stats = json_file(file("early.json"));
    EXPECT_EQ(stats["settings"]["preview"], "cache");
    EXPECT_EQ(stats["biases"].size(), 1u);
    EXPECT_GT(stats["radiance_cache"]["used"], 0);
    render(words(file("late.exr"), "--preview cache --samples 32"));
    EXPECT_EQ(bias_of(file("late.exr")), "");
    render(words(file("plain.exr"), "--samples 28"));
    EXPECT_TRUE(same_pixels(file("late.exr"), file("plain.exr")));
    EXPECT_FALSE(same_pixels(file("early.exr"), file("plain.exr")));
}

TEST_F(Output, RendersToAnErrorAndReportsIt) {
    const auto error = [&](const char* name) { return read_exr(file(name)).attributes.extra["error"]; };
    render(words(file("easy.exr"), "--stats", file("easy.json"), "--error 0.5 --samples 256"));
    const Json reached = json_file(file("easy.json"))["error"];
    EXPECT_EQ(reached["metric"], "relmse");
    EXPECT_EQ(reached["reached"], true);
    EXPECT_LE(reached["bound"], 0.5);
    EXPECT_TRUE(error("easy.exr").ends_with("target 0.5 reached")) << error("easy.exr");

    const Strings hard = words(file("hard.exr"), "--error 1e-9 --samples 20");
    refused(1, command(words(hard, "--quiet")), "hard.exr: not written: after 16 samples");
    render(words(hard, "--best-effort --error-metric mse"));
    EXPECT_TRUE(std::regex_match(error("hard.exr"), std::regex("mse .*, target 1e-09 not reached")))
        << error("hard.exr");
    EXPECT_EQ(read_exr(file("hard.exr")).attributes.counts["samples"], 16);
}

TEST_F(Output, CameraAndSizeFollowTheScene) {
    render({file("front.exr")});
    render({file("zero.exr"), "--camera", "0"});
    render({file("above.exr"), "--camera", "above"});
    EXPECT_TRUE(same_pixels(file("front.exr"), file("zero.exr")));
    EXPECT_FALSE(same_pixels(file("front.exr"), file("above.exr")));
    // The aspect ratio of "above" is 2:1.
    done(words("render", scene, file("size.exr"), "--camera above --width 40 --samples 1"));
    EXPECT_EQ(read_exr(file("size.exr")).height, 20);
    // These options give the view of the file's camera, 0.8 radians high.
    render(words(file("hand.exr"), "--look-from 0,1,6 --look-at 0,1,0 --vfov 45.836623610465857"));
    const Image front = read_exr(file("front.exr")).image({"R", "G", "B"});
    const Image hand = read_exr(file("hand.exr")).image({"R", "G", "B"});
    double difference = 0;
    for (std::size_t i = 0; i < front.pixels.size(); ++i) difference += std::abs(front.pixels[i] - hand.pixels[i]);
    EXPECT_LT(difference / static_cast<double>(front.pixels.size()), 0.01);
}

TEST_F(Output, SameCommandSamePicture) {
    RunOptions one_thread = fixed_date;
    one_thread.environment.push_back("LP_NUM_THREADS=1");
    const auto made = [&](const char* more, const RunOptions& options) {
        render(words(file("a.exr"), "--samples 3 --aov all", more), options);
        return read_text(file("a.exr"));
    };
    const std::string first = made("--seed 7", fixed_date);
    EXPECT_EQ(made("--seed 7", fixed_date), first);
    EXPECT_EQ(made("--seed 7", one_thread), first) << "the number of threads shows";
    std::filesystem::copy(file("a.exr"), file("first.exr"));
    for (const char* other : {"--seed 8", "--seed 7 --frame 1"}) {
        made(other, fixed_date);
        EXPECT_FALSE(same_pixels(file("a.exr"), file("first.exr"))) << other << " does nothing";
    }
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
    const Strings sky = words("--env 3e38,3e38,3e38");
    expect_has(render(words(file("b.exr"), sky, "--stats", file("stats.json"))).err, "shadow gave ");
    const Json bad = json_file(file("stats.json")).at("bad_values").at("shadow");
    EXPECT_GT(bad.at("nan").get<int>() + bad.at("infinite").get<int>(), 0) << "infinite / infinite is NaN";
    const Image picture = read_exr(file("b.exr")).image({"R", "G", "B"});
    EXPECT_TRUE(std::ranges::all_of(picture.pixels, [](float v) { return std::isfinite(v) && v >= 0; }));
    refused(1, command(words(file("c.exr"), sky, "--strict --quiet --stats", file("other.json"))),
            "c.exr: not written: shadow ");
}

TEST_F(Output, FoldersAreMade) {
    render({file("new/deeper/a.exr"), "--stats", file("other/a.json")});
    EXPECT_EQ(read_exr(file("new/deeper/a.exr")).width, 32);
    EXPECT_NE(read_text(file("other/a.json")), "");
}

TEST_F(Output, AFileThatFailsDoesNotPreventOthers) {
    // The .exr with all layers takes more bytes than the limit, the .png fewer.
    const Outcome outcome =
        run_program(words("render", scene, file("a.exr"), file("a.png"),
                          "--width 128 --samples 1 --aov all --exr-compression none --quiet"),
                    {.environment = {"HALFLIGHT_SHADER_SOURCES"}, .wrapper = {"prlimit", "--fsize=200000"}});
    EXPECT_EQ(outcome.status, 1);
    expect_has(outcome.err, "a.exr: ");
    EXPECT_FALSE(std::filesystem::exists(file("a.exr")));
    EXPECT_TRUE(std::filesystem::exists(file("a.png")));
}

TEST_F(Output, ValuesBeyondHalfFloatsAreCounted) {
    const Strings bright = words(file("a.exr"), "--material lamp.emission=200000,200000,200000");
    expect_has(render(words(bright, "--half")).err, "65504");
    EXPECT_FALSE(has(render(bright).err, "65504"));
}

TEST_F(Output, TimeLimitDecides) {
    render({file("a.exr")});  // compiles the shaders, which the driver then caches
    done(words("render", scene, file("b.exr"), "--width 32 --height 32 --time 1 --stats", file("stats.json")));
    const Json stats = json_file(file("stats.json"));
    // The run ends where one more sample would exceed the limit, on machines of any speed.
    const double samples = stats.at("samples");
    EXPECT_LT(samples, 1e6);
    EXPECT_GE(stats.at("seconds").at("total"), samples / (samples + 1));

    // The filter needs two samples, whose time does not matter.
    for (const auto& [options, count] :
         {std::pair("--denoise --samples 9 --time 1e-6", 2), {"--samples 3 --time 1000", 3}}) {
        render(words(file("a.exr"), options, "--stats", file("stats.json")));
        EXPECT_EQ(json_file(file("stats.json")).at("samples"), count) << options;
    }
}

TEST_F(Output, EnvironmentsAreGeneratedTurnedAndScaled) {
    scene = copy_room(folder.path, false);
    expect_has(render({file("a.exr")}).err, "neutral sky");
    const auto mean = [&](const Strings& options) {
        const Outcome outcome = render(words(file("a.exr"), "--reproducible", options));
        EXPECT_FALSE(has(outcome.err, "neutral sky")) << outcome.err;
        double sum = 0;
        const Image picture = read_exr(file("a.exr")).image({"R", "G", "B"});
        for (const float v : picture.pixels) sum += double(v);
        return sum / double(picture.pixels.size());
    };
    render({file("a.exr")});
    expect_has(read_exr(file("a.exr")).attributes.comments, "neutral");
    const Image by_default = read_exr(file("a.exr")).image({"R", "G", "B"});
    mean(words("--env neutral"));
    EXPECT_EQ(read_exr(file("a.exr")).image({"R", "G", "B"}).pixels, by_default.pixels);
    EXPECT_EQ(mean(words("--env grey")), mean(words("--env overcast")));
    for (const char* dark : {"--env none", "--env 0,0,0"}) EXPECT_EQ(mean(words(dark)), 0);
    const double studio = mean(words("--env studio"));
    EXPECT_GT(studio, 0.01);
    EXPECT_LT(studio, 10);
    EXPECT_NEAR(mean(words("--env studio --env-intensity 0.5")), studio / 2, 1e-4 * studio);
    EXPECT_NE(mean(words("--env studio --env-rotation 90")), studio);
    EXPECT_GT(mean(words("--sky 60,180")), 100) << "nits";
    const double sky = mean(words("--env sky"));
    write_text(file("settings.json"), R"({"halflight_settings": 1, "environment": {"preset": "sky"}})");
    const Strings settings = {"--settings", file("settings.json")};
    EXPECT_EQ(mean(settings), sky);
    EXPECT_EQ(mean(words(settings, "--env none")), 0) << "options come first";
    EXPECT_NEAR(mean(words(settings, "--env-intensity 2")), 2 * sky, 1e-3 * sky);
}

TEST_F(Output, DenoisedPicturesNameTheirBiasAndKeepTheMean) {
    scene = HALFLIGHT_SOURCE_DIR "/scenes/cornell.glb";
    const auto picture = [&](const char* name, const Strings& more) {
        render(words(file(name), "--samples 4 --seed 3", more));
        return read_exr(file(name));
    };
    const ExrFile mean = picture("mean.exr", {});
    const Strings filtered = words("--denoise --aov noisy,denoiser --stats", file("a.json"));
    const ExrFile clean = picture("clean.exr", filtered);
    const Json stats = json_file(file("a.json"));
    EXPECT_EQ(clean.find("noisy.G")->values, mean.find("G")->values);
    EXPECT_NE(clean.find("G")->values, mean.find("G")->values);
    for (const char* channel : {"denoiser.direct_diffuse", "denoiser.indirect_diffuse", "denoiser.glossy"}) {
        const std::vector<float>& weights = clean.find(channel)->values;
        EXPECT_GE(std::ranges::min(weights), 0) << channel;
        EXPECT_LE(std::ranges::max(weights), 1) << channel;
    }
    EXPECT_GT(std::ranges::max(clean.find("denoiser.indirect_diffuse")->values), 0.5f);
    expect_has(bias_of(file("clean.exr")), "denoised: ");
    EXPECT_EQ(bias_of(file("mean.exr")), "");
    EXPECT_EQ(stats.at("biases").size(), 1u);
    EXPECT_TRUE(stats.at("denoised_error").is_null());
    const ExrFile judged = picture("judged.exr", words(filtered, "--denoise-error 16"));
    for (const char* channel : {"R", "noisy.G", "denoiser.glossy"})
        EXPECT_EQ(judged.find(channel)->values, clean.find(channel)->values) << channel;
    const Json estimate = json_file(file("a.json")).at("denoised_error");
    EXPECT_EQ(estimate["held_out_samples"], 32);
    EXPECT_LT(estimate["lower"], estimate["value"]);
    EXPECT_LT(estimate["value"], estimate["upper"]);
    expect_has(read_text(file("judged.exr")), "denoised picture: estimated relmse");
}

TEST_F(Output, KeepAllKeepsThePicture) {
    const auto stats = [&](const std::string& name, const Strings& more) {
        render(words(file(name + ".exr"), "--stats", file("stats.json"), more));
        EXPECT_TRUE(same_pixels(file("lean.exr"), file(name + ".exr"))) << name;
        return json_file(file("stats.json"));
    };
    const Json lean = stats("lean", {}), kept = stats("kept", {"--keep-all"});
    EXPECT_GT(kept.at("gpu_bytes"), lean.at("gpu_bytes"));
    EXPECT_GT(lean.at("left_out").size(), kept.at("left_out").size());
    EXPECT_EQ(lean.at("settings").at("kept"), "nothing");
    EXPECT_EQ(kept.at("settings").at("kept"), "everything");
    const Json some = stats("some", {"--keep", "clearcoat,sums of squares", "--keep", "alpha tests"});
    EXPECT_EQ(some.at("settings").at("kept"), "alpha tests,clearcoat,sums of squares");
    std::set<std::string> gone;
    for (const Json& part : lean.at("left_out")) gone.insert(part.at("what"));
    for (const Json& part : some.at("left_out")) gone.erase(part.at("what"));
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
    for (const char* name : {"cold.exr", "warm.exr"}) EXPECT_TRUE(same_pixels(file("none.exr"), file(name))) << name;
}

/// Machine code that the second thread makes serves the first one, or there would be more of it.
TEST_F(Output, TwoThreadsCompileTheProgramsOfOne) {
    const auto code_made_by = [&](const std::string& threads) {
        const std::filesystem::path cache = folder / ("cache of " + threads);
        render({file(threads + ".exr"), "--threads", threads},
               {.environment = {"XDG_CACHE_HOME=" + cache.string(), "MESA_SHADER_CACHE_DIR=" + cache.string()}});
        return std::count_if(std::filesystem::recursive_directory_iterator(cache / "mesa_shader_cache"), {},
                             [](const auto& entry) { return entry.is_regular_file(); });
    };
    EXPECT_EQ(code_made_by("2"), code_made_by("1"));
    EXPECT_TRUE(same_pixels(file("1.exr"), file("2.exr")));
}

TEST_F(Output, TakesNamesInAnyOrder) {
    render({file("a.exr")});
    for (const Strings& names :
         {Strings{file("b.exr"), file("b.png"), scene}, Strings{file("b.exr"), scene, "-o", file("b.png")}}) {
        done(words("render", names, "--width 32 --height 32 --spp 1"));
        EXPECT_TRUE(same_pixels(file("a.exr"), file("b.exr")));
        EXPECT_TRUE(std::filesystem::remove(file("b.png")));
    }
}

}  // namespace
}  // namespace halflight::test
