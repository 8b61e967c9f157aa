// What the program writes, and when.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>

#include "engine/io/exr.h"
#include "passes/render.h"
#include "tests/cli/process.h"

namespace halflight::test {
namespace {

using Strings = std::vector<std::string>;

class Output : public testing::Test {
  protected:
    /// Renders the room, 32 x 32 pixels and one sample unless told otherwise, and expects success.
    Outcome render(Strings more, const RunOptions& options = {}) {
        Strings arguments = {"render", scene};
        const auto add = [&](const char* option, const char* value) {
            if (std::find(more.begin(), more.end(), option) == more.end())
                arguments.insert(arguments.end(), {option, value});
        };
        add("--width", "32"), add("--height", "32"), add("--samples", "1");
        arguments.insert(arguments.end(), more.begin(), more.end());
        Outcome outcome = run_program(arguments, options);
        EXPECT_EQ(outcome.status, 0) << outcome.err;
        EXPECT_EQ(outcome.out, "");
        return outcome;
    }
    std::string file(const std::string& name) const { return folder / name; }

    TemporaryFolder folder;
    std::string scene = copy_room(folder.path);
    const RunOptions fixed_date{.environment = {"SOURCE_DATE_EPOCH=0"}};
};

Strings channel_names(const ExrFile& exr) {
    Strings names;
    for (const ExrChannel& channel : exr.channels) names.push_back(channel.name);
    return names;
}

bool same_pixels(const std::string& a, const std::string& b) {
    const ExrFile x = read_exr(a), y = read_exr(b);
    if (channel_names(x) != channel_names(y)) return false;
    for (std::size_t i = 0; i < x.channels.size(); ++i)
        if (x.channels[i].values != y.channels[i].values) return false;
    return true;
}

/// Width and height in a PNG's header; the file must also have its end.
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
    // The camera "front" stands at (0, 1, 6): its place is the origin of camera space, straight ahead is mid-picture.
    EXPECT_NEAR(glm::length(dvec3(*exr.attributes.world_to_camera * dvec4(0, 1, 6, 1))), 0, 1e-6);
    const dvec4 ahead = *exr.attributes.world_to_clip * dvec4(0, 1, 0, 1);
    EXPECT_NEAR(ahead.x / ahead.w, 0, 1e-6);
    EXPECT_NEAR(ahead.y / ahead.w, 0, 1e-6);
    // The upper edge of its view, 0.4 radians up, is the upper edge of the picture.
    const dvec4 top = *exr.attributes.world_to_clip * dvec4(0, 1 + 6 * std::tan(0.4), 0, 1);
    EXPECT_NEAR(top.y / top.w, 1, 1e-6);
}

TEST_F(Output, LayersAreThoseAskedFor) {
    render({file("all.exr"), "--aov", "all", "--half"});
    const ExrFile all = read_exr(file("all.exr"));
    std::size_t channels = 4;  // RGBA
    for (const AovInfo& aov : known_aovs())
        if (!aov.debug) channels += aov.name == "ids" ? 3 : aov.name.starts_with("crypto") ? 12 : aov.channels.size();
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

TEST_F(Output, PreviewsAreNamedWhileTheyHaveAPart) {
    const auto bias = [&](const char* name) { return read_exr(file(name)).attributes.extra["bias"]; };
    render({file("early.exr"), "--stats", file("early.json"), "--preview", "cache", "--samples", "11"});
    EXPECT_EQ(bias("early.exr"), "preview: 60 % of it by a radiance cache, none from 32 samples on");
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

TEST_F(Output, RendersToAnErrorAndTellsIt) {
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
    const Outcome outcome = run_program(with({"render", scene, file("hard.exr"), "--quiet"}, hard));
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
    // "above" is twice as wide as high.
    const Outcome outcome =
        run_program({"render", scene, file("size.exr"), "--camera", "above", "--width", "40", "--samples", "1"});
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_EQ(read_exr(file("size.exr")).height, 20);
    // The same view by hand.
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
    for (const char* culling : {"compute", "raster", "auto"}) EXPECT_TRUE(with(culling) == off) << culling;
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
    // White stays white, so that the sum of each matrix row is 1 (rgb_conversion).
    const Image a = rec709.image({"R", "G", "B"}), b = acescg.image({"R", "G", "B"});
    const mat3 matrix(rgb_conversion(kRec709, kAp1));
    for (int y = 0; y < a.height; ++y) {
        for (int x = 0; x < a.width; ++x) {
            const vec3 expected = matrix * vec3(a.at(x, y)[0], a.at(x, y)[1], a.at(x, y)[2]);
            for (int c = 0; c < 3; ++c) ASSERT_NEAR(b.at(x, y)[c], expected[c], 1e-4f * (1 + std::abs(expected[c])));
        }
    }
}

TEST_F(Output, StatisticsTellTheRun) {
    render({file("a.exr"), "--samples", "2", "--stats", file("stats.json"), "--dump-graph", file("graph.dot")});
    const auto stats = nlohmann::json::parse(read_text(file("stats.json")));
    EXPECT_EQ(stats.at("samples"), 2);
    EXPECT_EQ(stats.at("paths"), 32 * 32 * 2);
    EXPECT_EQ(stats.at("counts").at("triangles_with_instances"), 4);
    EXPECT_EQ(stats.at("settings").at("width"), 32);
    EXPECT_EQ(stats.at("outputs"), Strings{file("a.exr")});
    EXPECT_GT(stats.at("gpu_bytes"), 0);
    EXPECT_GT(stats.at("peak_memory_bytes"), 0);
    EXPECT_FALSE(stats.at("device").at("renderer").get<std::string>().empty());
    EXPECT_EQ(stats.at("device").at("errors"), 0);
    EXPECT_EQ(stats.at("bad_values").size(), 5u);
    for (const auto& [component, bad] : stats.at("bad_values").items())
        for (const char* kind : {"nan", "infinite", "negative"}) EXPECT_EQ(bad.at(kind), 0) << component << " " << kind;
    const auto& seconds = stats.at("seconds");
    double sum = 0;
    for (const char* step : {"load", "context", "prepare", "compile", "render", "finish", "write"})
        sum += seconds.at(step).get<double>();
    EXPECT_NEAR(sum, seconds.at("total").get<double>(), 0.05 * sum + 0.01) << seconds;
    std::set<std::string> passes;
    for (const auto& pass : stats.at("passes")) {
        EXPECT_GE(pass.at("seconds"), 0);
        EXPECT_GE(pass.at("runs"), 2) << pass;
        passes.insert(pass.at("name"));
    }
    EXPECT_FALSE(passes.empty());
    const std::string dot = read_text(file("graph.dot"));
    EXPECT_TRUE(dot.starts_with("digraph")) << dot.substr(0, 80);
    EXPECT_NE(dot.find("gbuffer"), std::string::npos);
}

TEST_F(Output, StrictWritesNothingWhereAPassGoesWrong) {
    render({file("a.exr"), "--strict"});
    // A sky near the end of the float range: its radiance over its density passes that.
    const char* const sky = "3e38,3e38,3e38";
    const Outcome warned = render({file("b.exr"), "--env", sky, "--stats", file("stats.json")});
    EXPECT_NE(warned.err.find("shadow gave "), std::string::npos) << warned.err;
    EXPECT_GT(nlohmann::json::parse(read_text(file("stats.json"))).at("bad_values").at("shadow").at("infinite"), 0);
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

TEST_F(Output, TimeDecides) {
    render({file("a.exr"), "--samples", "1"});  // fills the driver's shader cache
    const Outcome outcome = run_program({"render", scene, file("b.exr"), "--width", "32", "--height", "32", "--time",
                                         "2", "--stats", file("stats.json")});
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    const auto stats = nlohmann::json::parse(read_text(file("stats.json")));
    // It ends where one sample more would be too late, however fast the machine is.
    const double samples = stats.at("samples");
    EXPECT_LT(samples, 1e6);
    EXPECT_GE(stats.at("seconds").at("total"), 2 * samples / (samples + 1));
}

TEST_F(Output, SceneWithoutLightGetsASky) {
    scene = copy_room(folder.path, false);
    EXPECT_NE(render({file("a.exr")}).err.find("a neutral sky is added"), std::string::npos);
    EXPECT_EQ(render({file("b.exr"), "--env", "0,0,0"}).err.find("sky"), std::string::npos);
    const Image dark = read_exr(file("b.exr")).image({"R", "G", "B"});
    EXPECT_TRUE(std::ranges::all_of(dark.pixels, [](float v) { return v == 0; }));
}

TEST_F(Output, ProgressInLines) {
    const Outcome plain = render({file("a.exr"), "--samples", "20"});
    EXPECT_TRUE(std::regex_match(plain.err, std::regex("(halflight: .*\n)*"))) << plain.err;
    EXPECT_NE(plain.err.find("20/20 samples, "), std::string::npos) << plain.err;
    EXPECT_LT(std::count(plain.err.begin(), plain.err.end(), '\n'), 15) << plain.err;
    EXPECT_EQ(render({file("b.exr"), "--quiet"}).err, "");
}

TEST_F(Output, ProgressAsABar) {
    if (!std::filesystem::exists("/dev/pts/ptmx")) GTEST_SKIP() << "there are no terminals here";
    RunOptions terminal{.environment = {"TERM=xterm"}, .terminal = true};
    const Strings arguments = {"render", scene, file("a.exr"), "--width", "32", "--height", "32", "--samples", "20"};
    const Outcome bar = run_program(arguments, terminal);
    EXPECT_EQ(bar.status, 0) << bar.err;
    EXPECT_TRUE(std::regex_search(bar.err, std::regex(R"(\r\[#*\.*\] [0-9]+/20 samples, 0:[0-9]+ elapsed, )")))
        << bar.err;
    for (std::size_t at = 0; (at = bar.err.find("\r[", at)) != std::string::npos; ++at)
        EXPECT_LT(bar.err.find("\033[K", at) - (at + 1), 80u) << "wider than the terminal";

    terminal.environment = {"TERM=dumb"};
    const Outcome dumb = run_program(arguments, terminal);
    EXPECT_EQ(dumb.err.find('\033'), std::string::npos) << dumb.err;
}

TEST_F(Output, NoOneHasToListen) {
    render({file("heard.exr"), "--samples", "10"});
    render({file("closed.exr"), "--samples", "10"}, {.in_child = [] {
               for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) close(stream);
           }});
    render({file("full.exr"), "--samples", "10"},
           {.in_child = [] { dup2(open("/dev/full", O_WRONLY), STDERR_FILENO); }});
    for (const char* name : {"closed.exr", "full.exr"}) EXPECT_TRUE(same_pixels(file("heard.exr"), file(name))) << name;
}

TEST_F(Output, StoppedInTheMiddleLeavesNothing) {
    const auto files = folder.entries();
    const Strings endless = {"render", scene,      file("a.exr"), file("a.png"), "--width",
                             "32",     "--height", "32",          "--samples",   "10000000"};
    for (const int signal : {SIGINT, SIGTERM, SIGKILL}) {
        bool sent = false;
        RunOptions options;
        options.watch = [&](pid_t child, const std::string& err) {
            // Once the device is known, rendering begins.
            if (!sent && err.find("pixels, camera") != std::string::npos) sent = kill(child, signal) == 0;
        };
        const Outcome outcome = run_program(endless, options);
        EXPECT_EQ(outcome.status, 128 + signal) << outcome.err;
        EXPECT_EQ(folder.entries(), files);
        if (signal == SIGKILL) continue;
        EXPECT_TRUE(
            std::regex_search(outcome.err, std::regex("halflight: .*a.exr: not written: interrupted after .*\n$")))
            << outcome.err;
    }
}

TEST_F(Output, OldPictureStaysUntilTheNewOneIsThere) {
    write_text(file("a.exr"), "old");
    const Outcome bad = run_program({"render", scene, file("a.exr"), "--camera", "rear"});
    EXPECT_EQ(bad.status, 1);
    EXPECT_EQ(read_text(file("a.exr")), "old");
    render({file("a.exr")});
    EXPECT_EQ(read_exr(file("a.exr")).width, 32);
}

TEST_F(Output, StatisticsTellHowRaysWereTraced) {
    const auto run = [&](const std::string& culling) {
        render({file("a.exr"), "--samples", "8", "--culling", culling, "--stats", file("stats.json")});
        return nlohmann::json::parse(read_text(file("stats.json")));
    };
    const std::map<std::string, Strings> ways = {
        {"off", {"plain"}}, {"compute", {"tiles"}}, {"raster", {"raster"}}, {"auto", {"plain", "tiles"}}};
    std::map<std::string, std::uint64_t> rays;
    for (const auto& [culling, names] : ways) {
        SCOPED_TRACE(culling);
        const auto stats = run(culling);
        std::set<std::string> batches;
        for (const auto& batch : stats.at("ray_batches")) {
            batches.insert(batch.at("batch"));
            EXPECT_FALSE(batch.at("reason").get<std::string>().empty());
            std::uint64_t runs = 0, alive = 0;
            for (const auto& [way, measured] : batch.at("ways").items()) {
                EXPECT_EQ(std::ranges::count(names, way), 1) << way;
                EXPECT_GT(measured.at("seconds"), 0);
                EXPECT_LE(measured.at("fastest_run_seconds"), measured.at("seconds"));
                runs += measured.at("runs").get<std::uint64_t>();
                alive += measured.at("rays").get<std::uint64_t>();
            }
            EXPECT_EQ(runs, 8u) << batch;
            EXPECT_LE(alive, 8u * 32 * 32);
            // The same picture, the same rays.
            EXPECT_EQ(rays.emplace(batch.at("batch"), alive).first->second, alive) << batch;
            ASSERT_EQ(batch.contains("tile_lists"), batch.at("ways").contains("tiles"));
            EXPECT_TRUE(culling != "raster" || batch.at("state_bytes") > 0);
            if (!batch.contains("tile_lists")) continue;
            const auto& lists = batch.at("tile_lists");
            EXPECT_LE(lists.at("made"), lists.at("wanted"));
            EXPECT_EQ(lists.at("kept").get<int>(), lists.at("wanted").get<int>() - lists.at("made").get<int>());
            EXPECT_LE(lists.at("mean_leaves"), lists.at("mean_entries"));
            EXPECT_LE(lists.at("mean_entries"), lists.at("most_entries"));
            EXPECT_LE(lists.at("most_entries"), 32);
            EXPECT_LE(lists.at("share_of_rays_beyond_leaves"), 1);
            EXPECT_LE(lists.at("share_of_rays_ended_by_remembered_leaves"), 1);
            for (const char* step : {"cull", "search", "rest"}) EXPECT_GE(lists.at("seconds").at(step), 0);
        }
        EXPECT_TRUE(batches.contains("shadow") && batches.contains("diffuse"));
        EXPECT_EQ(stats.at("raster_culling").empty(), culling != "raster");
        for (const auto& kind : stats.at("raster_culling")) {
            EXPECT_EQ(kind.at("runs").get<int>() % 8, 0);
            EXPECT_GT(kind.at("draws"), 0) << kind;
            EXPECT_LE(kind.at("multi_queries"), kind.at("queries_issued"));
        }
    }
    EXPECT_GT(rays.at("shadow"), 0u);
    scene = std::string(HALFLIGHT_SOURCE_DIR) + "/scenes/cornell.glb";  // where something stands in the light
    const nlohmann::json compute = run("compute");
    for (const auto& batch : compute.at("ray_batches")) {
        if (batch.at("batch") != "shadow") continue;
        EXPECT_GT(batch.at("tile_lists").at("kept"), 0) << "a still camera";
        EXPECT_GE(batch.at("tile_lists").at("mean_entries"), 1);
        EXPECT_GT(batch.at("tile_lists").at("share_of_rays_ended_by_remembered_leaves"), 0);
        EXPECT_GT(batch.at("state_bytes"), 0);
    }
}

TEST_F(Output, DebugLayersOnlyWhereAskedForByName) {
    render({file("a.exr"), "--aov", "nodes,culling", "--culling", "compute"});
    const ExrFile exr = read_exr(file("a.exr"));
    EXPECT_EQ(channel_names(exr), (Strings{"A", "B", "G", "R", "culling.leaves", "culling.others", "nodes.Y"}));
    EXPECT_GE(std::ranges::max(exr.find("culling.leaves")->values), 1);
    EXPECT_GE(std::ranges::min(exr.find("nodes.Y")->values), 1);
    render({file("b.exr"), "--aov", "culling", "--culling", "off"});
    EXPECT_EQ(std::ranges::max(read_exr(file("b.exr")).find("culling.leaves")->values), 0);
}

TEST_F(Output, InfoTellsTheScene) {
    const Outcome text = run_program({"info", scene});
    EXPECT_EQ(text.status, 0) << text.err;
    EXPECT_EQ(text.err, "");
    EXPECT_NE(text.out.find("front"), std::string::npos) << text.out;
    const Outcome json = run_program({"info", "--json", scene});
    ASSERT_EQ(json.status, 0) << json.err;
    const auto facts = nlohmann::json::parse(json.out);
    EXPECT_EQ(facts.at("counts").at("triangles"), 4);
    EXPECT_EQ(facts.at("cameras").at(1).at("name"), "above");
    EXPECT_EQ(facts.at("lights").at("emissive_triangles"), 2);
    EXPECT_EQ(facts.at("repaired").at("normals_generated"), 12);
    EXPECT_NEAR(facts.at("bounds").at("size").at(0), 4, 1e-6);
}

TEST_F(Output, InfoNamesThePassesThatRun) {
    const auto check = [&](const std::string& path) {
        const auto named = nlohmann::json::parse(run_program({"info", "--json", path}).out).at("passes").get<Strings>();
        const Outcome outcome = run_program({"render", path, file("a.exr"), "--env", "0,0,0", "--width", "8",
                                             "--height", "8", "--samples", "1", "--stats", file("stats.json")});
        ASSERT_EQ(outcome.status, 0) << outcome.err;
        std::set<std::string> left_out;
        const auto stats = nlohmann::json::parse(read_text(file("stats.json")));
        for (const auto& part : stats.at("left_out")) left_out.insert(part.at("what").get<std::string>());
        for (const char* pass : {"gbuffer", "shadow", "diffuse", "glossy", "continuation", "path reuse"})
            EXPECT_NE(std::ranges::count(named, pass), left_out.count(pass)) << pass;
    };
    check(scene);
    check(copy_room(folder.path, false));
}

TEST_F(Output, InfoListsWhatIsLeftOutWithTheBytes) {
    const Outcome json = run_program({"info", "--needs", "--json", scene});
    ASSERT_EQ(json.status, 0) << json.err;
    std::map<std::string, nlohmann::json> parts;
    const auto facts = nlohmann::json::parse(json.out);
    for (const auto& part : facts.at("left_out")) parts[part.at("what")] = part;
    EXPECT_EQ(parts.at("alpha tests").at("fact"), "alpha decides no hit");
    EXPECT_GE(parts.at("sums of squares").at("bytes"), 1280 * 720 * 24);
    EXPECT_FALSE(parts.contains("area lights"));
    const Outcome text = run_program({"info", "--needs", scene});
    EXPECT_TRUE(std::regex_search(text.out, std::regex("alpha tests +0  alpha decides no hit"))) << text.out;
    EXPECT_TRUE(std::regex_search(text.out, std::regex(R"(\n  light tree \* +\d)"))) << text.out;
    // What is told to be for --keep is taken by it, and nothing else is.
    for (const auto& [name, part] : parts) {
        const Outcome keeping = run_program({"render", scene, file("a.exr"), "--keep", name, "--clock"});
        const bool taken = keeping.err.find("cannot be kept") == std::string::npos;
        EXPECT_EQ(taken, part.at("can_be_kept").get<bool>()) << name << ": " << keeping.err;
    }
    EXPECT_EQ(run_program({"info", scene}).out.find("alpha decides"), std::string::npos);
    EXPECT_EQ(run_program({"info", "--device", "--needs"}).status, 2);
    EXPECT_TRUE(parts.contains("environment"));
    const Outcome lit = run_program({"info", "--needs", "--json", scene, "--env", "0.5,0.5,0.5"});
    ASSERT_EQ(lit.status, 0) << lit.err;
    const auto of_lit = nlohmann::json::parse(lit.out);
    for (const auto& part : of_lit.at("left_out")) EXPECT_NE(part.at("what"), "environment");
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
    // Whatever else lies there costs time at most.
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

TEST_F(Output, InfoListsDevices) {
    const Outcome text = run_program({"info", "--device"});
    EXPECT_EQ(text.status, 0) << text.err;
    EXPECT_EQ(std::count(text.out.begin(), text.out.end(), '*'), 1) << text.out;
    const auto devices = nlohmann::json::parse(run_program({"info", "--device", "--json"}).out).at("devices");
    for (const auto& device : devices) EXPECT_FALSE(device.at("reason").get<std::string>().empty()) << device;
}

TEST_F(Output, HelpAndVersion) {
    for (const Strings& arguments : {Strings{"--help"}, Strings{"render", "--help"}, Strings{"info", "-h"}}) {
        const Outcome help = run_program(arguments);
        EXPECT_EQ(help.status, 0);
        EXPECT_EQ(help.err, "");
        EXPECT_NE(help.out.find("Usage: halflight"), std::string::npos);
    }
    EXPECT_TRUE(std::regex_match(run_program({"--version"}).out, std::regex(R"(halflight \d+\.\d+\.\d+\n)")));
}

}  // namespace
}  // namespace halflight::test
