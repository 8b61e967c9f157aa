// Tests the viewer's window by scripts: the displayed picture is the one that `render` makes.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "engine/settings/layers.h"
#include "tests/cli/animated_scenes.h"
#include "tests/cli/view_test.h"

namespace halflight::test {
namespace {

class View : public ViewTest {};

TEST_F(View, PicturesEqualThoseOfRender) {
    expect_done(view(R"(
        wait first
        wait samples 3
        screenshot @seen.png
        screenshot @seen.exr
        window @window.png
        exposure 1.5
        screenshot @bright.png
        orbit 40 -10
        dolly 0.8
        wait samples 2
        screenshot @moved.png
        save
        key H
        window @panels.png
        timings @timings.json
        quit)"));
    render({file("render.exr"), file("render.png"), "--samples", "3"});
    EXPECT_TRUE(same_bits(exr("seen.exr"), exr("render.exr")));
    EXPECT_LE(difference(png("seen.png"), png("render.png")), 1.01);
    EXPECT_GT(mean(png("seen.png")), 0.002) << "it is black";
    EXPECT_EQ(difference(png("window.png"), png("seen.png")), 0) << "without panels it is the picture alone";
    EXPECT_GT(difference(png("panels.png"), png("moved.png")), 50) << "the panels are not there";

    render({file("bright-render.png"), "--samples", "3", "--exposure", "1.5"});
    EXPECT_LE(difference(png("bright.png"), png("bright-render.png")), 1.01);
    EXPECT_GT(mean(png("bright.png")), mean(png("seen.png")));

    render({file("moved-render.png"), "--settings", scene + ".halflight.json", "--samples", "2"});
    EXPECT_LE(difference(png("moved.png"), png("moved-render.png")), 1.01) << "or settings are not what was saved";
    EXPECT_GT(difference(png("moved.png"), png("bright.png")), 10);

    const auto timings = nlohmann::json::parse(read_text(file("timings.json")));
    EXPECT_EQ(timings["views"], 2);
    EXPECT_GT(timings["seconds_to_first_picture"]["median"], 0);
    EXPECT_EQ(timings["last_picture"]["samples"], 2);
}

TEST_F(View, EveryLayerCanBeShown) {
    std::string script;
    std::vector<std::string> views = {"final", "error"};
    for (const AovInfo& layer : known_aovs()) views.emplace_back(layer.name);
    for (const std::string& name : views) {
        script += fmt::format("view {0}\nwait samples 2\nscreenshot @{0}.png\n", name);
        if (name != "final") script += fmt::format("screenshot @{}.exr\n", name);
    }
    expect_done(view(script));
    render({file("all.exr"), "--samples", "2", "--aov", "all"});
    const ExrFile all = read_exr(file("all.exr"));
    for (const std::string& name : views) {
        SCOPED_TRACE(name);
        EXPECT_EQ(png(name + ".png").width, 320);
        if (name == "final") continue;
        const ExrFile own = read_exr(file(name + ".exr"));
        EXPECT_GT(own.channels.size(), 4u) << "the layer is not in it";
        const AovInfo* const layer = find_aov(name);
        const bool apart = layer && !layer->in_all();
        for (const ExrChannel& channel : own.channels) {
            const ExrChannel* expected = all.find(channel.name);
            EXPECT_TRUE(expected ? same_values(channel, *expected) : apart) << channel.name;
        }
    }
    for (const char* name : {"albedo", "normal", "position", "depth", "ids", "cryptoobject", "cryptomaterial"})
        EXPECT_GT(mean(png(name + std::string(".png"))), 0.02) << name << " is black";
}

TEST_F(View, ComponentsAndTwoPicturesSideBySide) {
    expect_done(view(R"(
        wait samples 2
        compare on
        component emission off
        component direct_diffuse off
        split 0.25
        wait samples 2
        exposure 1
        screenshot @both.png
        window @window.png
        compare off
        screenshot @without.png
        screenshot @without.exr
        component emission on
        component direct_diffuse on
        wait samples 2
        screenshot @with.png)"));
    const Image both = png("both.png"), without = png("without.png"), with = png("with.png");
    EXPECT_GT(difference(with, without), 10);
    const int split = both.width / 4;
    EXPECT_EQ(difference(crop(both, 0, split), crop(without, 0, split)), 0);
    EXPECT_EQ(difference(crop(both, split, both.width), crop(with, split, both.width)), 0)
        << "in the same exposure, although it was kept before that";
    EXPECT_GT(difference(png("window.png"), both), 50) << "there is no line between them";
    // The written file holds the displayed picture.
    const ExrFile exr = read_exr(file("without.exr"));
    const auto values = [&](const std::string& name) { return exr.find(name)->values; };
    const auto sum = values("R"), a = values("direct_glossy.R"), b = values("indirect_diffuse.R"),
               c = values("indirect_glossy.R");
    for (std::size_t i = 0; i < sum.size(); ++i) ASSERT_EQ(sum[i], a[i] + b[i] + c[i]);
    EXPECT_NE(exr.attributes.comments.find("no emission, no direct_diffuse"), std::string::npos);
}

TEST_F(View, ErrorsAreEstimatedAndBiasesNamed) {
    expect_done(view(R"(
        wait error 0.5
        timings @timings.json
        screenshot @plain.exr
        clamp 0.001
        wait samples 2
        screenshot @clamped.exr
        window @window.png
        screenshot @clamped.png)"));
    const auto last = nlohmann::json::parse(read_text(file("timings.json")))["last_picture"];
    EXPECT_LT(last["estimated_relmse"], 0.5);
    EXPECT_GE(last["samples"], 4);
    EXPECT_GT(difference(png("window.png"), png("clamped.png")), 50) << "nothing says that it is biased";
    const auto bias = [&](const char* name) { return read_exr(file(name)).attributes.extra["bias"]; };
    EXPECT_EQ(bias("plain.exr"), "");
    EXPECT_NE(bias("clamped.exr").find("clamped to a luminance of 0.001"), std::string::npos);
}

TEST_F(View, PreviewModesAreNamedAndHandOverToTheMean) {
    expect_done(view(R"(
        wait first
        preview temporal,filter
        wait samples 2
        orbit 20 5
        wait samples 4
        screenshot @early.png
        screenshot @early.exr
        window @early-window.png
        component emission off
        wait samples 4
        screenshot @sum.png
        screenshot @sum.exr
        window @sum-window.png
        component emission on
        preview temporal
        wait first
        orbit -20 -5
        wait samples 32
        screenshot @late.png
        screenshot @late.exr
        window @late-window.png
        save
        quit)"));
    const auto bias = [&](const char* name) { return read_exr(file(name)).attributes.extra["bias"]; };
    EXPECT_EQ(bias("early.exr"),
              "preview: light of earlier pictures is reused until there are 32 samples; "
              "preview: noise is filtered out until there are 256 samples");
    EXPECT_GT(difference(png("early-window.png"), png("early.png")), 20) << "they are not named in the window";
    EXPECT_EQ(bias("sum.exr"), "") << "components are as they are";
    EXPECT_EQ(difference(png("sum-window.png"), png("sum.png")), 0);
    EXPECT_EQ(bias("late.exr"), "");
    EXPECT_EQ(difference(png("late-window.png"), png("late.png")), 0);
    render({file("mean.exr"), "--settings", scene + ".halflight.json", "--samples", "32"});
    EXPECT_TRUE(same_bits(exr("late.exr"), exr("mean.exr")));
}

TEST_F(View, PreviewsAreTheDefaultAndBecomeTheMean) {
    const auto seen = [&](const std::vector<std::string>& options) {
        expect_done(view_by_default(R"(
            wait samples 2
            screenshot @early.png
            screenshot @early.exr
            window @early-window.png
            wait samples 256
            screenshot @late.png
            screenshot @late.exr
            window @late-window.png
            save)",
                                    options));
        return nlohmann::json::parse(read_text(scene + ".halflight.json"))["preview"];
    };
    const auto bias = [&](const char* name) { return read_exr(file(name)).attributes.extra["bias"]; };
    size = "48x32";
    EXPECT_EQ(seen({}), "cache,filter");
    EXPECT_EQ(bias("early.exr"),
              "preview: noise is filtered out until there are 256 samples; "
              "preview: 100 % of the light comes from the radiance cache, none from 32 samples on");
    EXPECT_GT(difference(png("early-window.png"), png("early.png")), 20) << "the window does not name the modes";
    EXPECT_EQ(bias("late.exr"), "");
    EXPECT_EQ(difference(png("late-window.png"), png("late.png")), 0);
    const Image with_modes = exr("late.exr");

    EXPECT_EQ(seen({"--preview", "none"}), "none") << "the option goes before the file";
    EXPECT_EQ(bias("early.exr"), "");
    EXPECT_EQ(difference(png("early-window.png"), png("early.png")), 0);
    // The picture with modes lacks the 4 cached samples, and is the mean of the others.
    const Outcome mean = run_program(
        {"render", scene, file("mean.exr"), "--width", "48", "--height", "32", "--samples", "252", "--quiet"});
    ASSERT_EQ(mean.status, 0) << mean.err;
    EXPECT_TRUE(same_bits(with_modes, exr("mean.exr")));
}

TEST_F(View, ErrorsAreMeasuredAgainstAReference) {
    render({file("reference.exr"), "--samples", "2"});
    expect_done(view("reference @reference.exr\nwait samples 2\nwait error 1e-8\ntimings @timings.json\n"));
    const auto last = nlohmann::json::parse(read_text(file("timings.json")))["last_picture"];
    EXPECT_EQ(last["relmse"], 0);
    EXPECT_EQ(last["samples"], 2);
    render({file("aces.exr"), "--samples", "2", "--working-space", "acescg"});
    expect_done(view("reference @aces.exr\nwait samples 2\nwait error 1e-8\ntimings @aces.json\n"));
    EXPECT_LT(nlohmann::json::parse(read_text(file("aces.json")))["last_picture"]["relmse"], 1e-10);
    size = "40x30";
    const Outcome outcome = view("wait first\nreference @reference.exr\nwait samples 1\n");
    EXPECT_EQ(outcome.status, 1);
    EXPECT_NE(outcome.err.find("reference: has 320x240 pixels, and the picture has 40x30"), std::string::npos)
        << outcome.err;
}

TEST_F(View, SizeAndModesAreSaved) {
    expect_done(view("preview filter\nclamp 0.5\nwait samples 2\nscreenshot @seen.exr\nsave\n"));
    const Outcome outcome =
        run_program({"render", scene, file("render.exr"), "--settings", scene + ".halflight.json", "--samples", "2"});
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_TRUE(same_bits(exr("seen.exr"), exr("render.exr")));
    EXPECT_EQ(read_exr(file("seen.exr")).attributes.extra["bias"],
              read_exr(file("render.exr")).attributes.extra["bias"]);
}

TEST_F(View, LightsMaterialsAndBookmarks) {
    expect_done(view(R"(
        wait samples 2
        screenshot @first.png
        bookmark here
        camera above
        clay on
        emission 0.5
        tint 1 0.5 0.25
        bounces 2
        wait samples 2
        screenshot @above.png
        save
        recall here
        clay off
        emission 1
        tint 1 1 1
        bounces 8
        wait samples 2
        screenshot @again.png)",
                     {"--env", "0.5,0.5,1"}));
    render({file("above-render.png"), "--settings", scene + ".halflight.json", "--samples", "2"});
    EXPECT_LE(difference(png("above.png"), png("above-render.png")), 1.01);
    EXPECT_GT(difference(png("above.png"), png("first.png")), 10);
    // The bookmark's camera differs from the scene's only by rounding.
    Image first = png("first.png"), again = png("again.png");
    EXPECT_NEAR(mean(first), mean(again), 0.01);

    // The next run uses the saved settings.
    expect_done(view("wait samples 2\nscreenshot @next.png\nrecall here\n"));
    EXPECT_EQ(difference(png("next.png"), png("above.png")), 0);
    expect_done(view("wait samples 2\nscreenshot @other.png\n", {"--camera", "front", "--bounces", "8"}));
    EXPECT_GT(difference(png("other.png"), png("above.png")), 10) << "the command line goes before the file";
}

TEST_F(View, OpensScenesAndEnvironments) {
    TemporaryFolder second;
    const std::string dark = copy_room(second.path, false);
    ExrLayer sky{{"R", "G", "B"}, Image(8, 4, 3)};
    std::ranges::fill(sky.image.pixels, 0.7f);
    write_exr(file("sky.exr"), {sky}, {});
    const std::string first = scene;
    expect_done(
        view(fmt::format("wait samples 1\nopen {}\nopen @sky.exr\nwait samples 2\nscreenshot @opened.exr\n", dark),
             {"--quiet"}));
    scene = dark;
    render({file("render.exr"), "--samples", "2", "--env", file("sky.exr")});
    EXPECT_TRUE(same_bits(exr("opened.exr"), exr("render.exr")));
}

TEST_F(View, AnimationFramesEqualThoseOfRender) {
    scene = write_animated_scene(folder.path).string();
    expect_done(view(R"(
        wait samples 1
        animation all
        frame 7
        wait samples 2
        screenshot @seven.exr
        animation fly
        camera moving
        frame 20
        wait samples 2
        screenshot @fly.exr
        screenshot @before.exr
        play 0.7
        wait samples 2
        screenshot @played.exr
        frame 20
        wait samples 2
        screenshot @again.exr)",
                     {"--quiet"}));
    render({file("7.exr"), "--samples", "2", "--animation", "all", "--frame", "7"});
    render({file("20.exr"), "--samples", "2", "--animation", "fly", "--frame", "20", "--camera", "moving"});
    EXPECT_TRUE(same_bits(exr("seven.exr"), exr("7.exr")));
    EXPECT_TRUE(same_bits(exr("fly.exr"), exr("20.exr")));
    EXPECT_FALSE(same_bits(exr("played.exr"), exr("before.exr"))) << "it has gone on";
    EXPECT_TRUE(same_bits(exr("again.exr"), exr("20.exr")));
    expect_done(view("wait samples 2\nscreenshot @start.exr\n", {"--quiet", "--animation", "all", "--frame", "7"}));
    EXPECT_TRUE(same_bits(exr("start.exr"), exr("7.exr")));

    expect_done(
        view("animation turn\nframe 11\ncamera moving\nwait samples 2\nscreenshot @saved.exr\nsave\n", {"--quiet"}));
    render({file("settings.exr"), "--samples", "2", "--settings", scene + ".halflight.json"});
    EXPECT_TRUE(same_bits(exr("settings.exr"), exr("saved.exr")));
    std::filesystem::remove(scene + ".halflight.json");

    EXPECT_EQ(view("animation jump\n", {"--quiet"}).err,
              fmt::format(
                  "halflight: {}1: {}: no animation 'jump': its animations: 0 'bend', 1 'breathe', 2 'turn', 3 'fly'\n",
                  file("script.txt:"), scene));
    EXPECT_EQ(view("play 1\n", {"--quiet"}).status, 1) << "nothing is chosen";
    EXPECT_EQ(view("quit\n", {"--frame", "1"}).err, "halflight: --frame: needs --animation\n");
}

TEST_F(View, LightsAreMoved) {
    const std::string lamp = R"({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0, 1, 2]}],
        "extensionsUsed": ["KHR_lights_punctual"],
        "extensions": {"KHR_lights_punctual": {"lights": [{"type": "spot", "intensity": 50, "spot": {}}]}},
        "nodes": [{"translation": [0, 0, 3], "extensions": {"KHR_lights_punctual": {"light": 0}}},
                  {"mesh": 0}, {"camera": 0, "translation": [0, 0, 4]}],
        "cameras": [{"type": "perspective", "perspective": {"yfov": 0.8, "znear": 0.1}}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [-2, -2, 0],
                       "max": [2, 2, 0]}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}], "buffers": [{"byteLength": 36, "uri":
            "data:application/octet-stream;base64,AAAAwAAAAMAAAAAAAAAAQAAAAMAAAAAAAAAAAAAAAEAAAAAA"}]})";
    scene = file("lamp.gltf");
    write_text(scene, lamp);
    expect_done(view(R"(
        wait samples 2
        screenshot @first.exr
        place 0 1 0 2
        aim 0 -0.2 0.3 -2
        wait samples 2
        screenshot @moved.exr
        save)",
                     {"--quiet"}));
    render({file("render.exr"), "--settings", scene + ".halflight.json", "--samples", "2"});
    EXPECT_TRUE(same_bits(exr("moved.exr"), exr("render.exr")));
    EXPECT_FALSE(same_bits(exr("moved.exr"), exr("first.exr")));
    // The commands continue edits of the file, also of earlier files: a colour takes the place of a temperature.
    write_text(scene + ".halflight.json",
               R"({"halflight_settings": 1, "lights": [{"temperature": 2700, "intensity": 80}]})");
    expect_done(view("light 0 0 1 0\nlight 0 2\nwait samples 2\nscreenshot @green.exr\nsave\n", {"--quiet"}));
    EXPECT_EQ(nlohmann::json::parse(read_text(scene + ".halflight.json")).at("lights"),
              nlohmann::json::parse(R"({"0": {"factor": 2.0, "intensity": 80.0, "color": [0.0, 1.0, 0.0]}})"));
    render({file("render.exr"), "--settings", scene + ".halflight.json", "--samples", "2"});
    EXPECT_TRUE(same_bits(exr("green.exr"), exr("render.exr")));
    EXPECT_EQ(view("place 1 0 0 0\n", {"--quiet"}).err,
              fmt::format("halflight: {}1: place: there is no light 1; the scene has 1, numbered from 0\n",
                          file("script.txt:")));
}

/// Taps of keys that are shorter than a frame, and fast clicks, while samples are made.
TEST_F(View, ErrorsNameTheLine) {
    const auto expect_error = [&](const Outcome& outcome, int status, const std::string& message) {
        EXPECT_EQ(outcome.status, status);
        EXPECT_EQ(outcome.err, fmt::format("halflight: {}\n", message));
    };
    const std::string at = file("script.txt:");
    expect_error(view("wait first\njump\n"), 1, at + "2: unknown command 'jump'");
    expect_error(view("camera nobody\n"), 1,
                 at + "1: " + scene + ": no camera 'nobody': its cameras: 0 'front', 1 'above'");
    expect_error(view("screenshot @a.png\n"), 1, at + "1: " + file("a.png: not written: there is no picture yet"));
    expect_error(view("recall there\n"), 1, at + "1: bookmarks: there is no 'there'");
    expect_error(view("light 0 1 0 0\n"), 1, at + "1: light: there is no light 0; the scene has 0, numbered from 0");
    expect_error(view("component light on\n"), 1,
                 at + "1: component: unknown component 'light'; valid are emission, direct_diffuse, direct_glossy, "
                      "indirect_diffuse, indirect_glossy");
    expect_error(view("compare on\n"), 1, at + "1: compare: there is no picture yet");
    expect_error(view("culling some\n"), 1,
                 at + "1: culling: expects one of auto, compute, raster, off, native, not 'some'");
    EXPECT_NE(view("clay on\ntransform nothing \"Un-tone-mapped\"\nquit\n").err.find("script.txt:2: "),
              std::string::npos);
    expect_error(view("wait first\nopen @no.glb\nquit\n"), 1,
                 at + "2: " + file("no.glb: cannot read: No such file or directory"));
    expect_error(view("light 0 1\n"), 1, at + "1: light: there is no light 0; the scene has 0, numbered from 0");
    expect_error(view("open @script.txt\n"), 1,
                 at + "1: " + file("script.txt: is neither a scene (.glb, .gltf) nor an environment (.exr, .hdr)"));
    expect_error(run_program({"view", scene, "--size", "640"}), 2, "--size: expects WIDTHxHEIGHT in pixels, not '640'");
    EXPECT_NE(view("\n\nview sideways\n")
                  .err.find("script.txt:3: view: unknown layer 'sideways'; valid are final, error, emission"),
              std::string::npos);
    EXPECT_EQ(view("quit\n", {"--view", "nothing"}).status, 1);
    for (const char* stale : {"display", "view", "look"}) {
        write_text(scene + ".halflight.json", fmt::format(R"({{"halflight_settings": 1, "{}": "none"}})", stale));
        const Outcome outcome = view("quit\n");
        EXPECT_EQ(outcome.status, 0) << outcome.err;
        EXPECT_NE(outcome.err.find("halflight.json: an entry is left out"), std::string::npos) << outcome.err;
    }
    write_text(scene + ".halflight.json", "{}");
    expect_error(view("quit\n"), 1, scene + ".halflight.json: has no 'halflight_settings', the version of its format");
}

TEST_F(View, AMissingDeviceIsAnError) {
    // Another thread opens the device, so the window exists before the error.
    const Outcome outcome = view("wait first\n", {"--device", "no such device"});
    EXPECT_EQ(outcome.status, 1);
    EXPECT_NE(outcome.err.find("script.txt:1: GPU: no OpenGL 4.5 context for device 'no such device'"),
              std::string::npos)
        << outcome.err;
}

TEST(ViewWithout, ADisplayIsAnError) {
    TemporaryFolder folder;
    const std::string scene = copy_room(folder.path);
    const RunOptions options{.environment = {"DISPLAY", "WAYLAND_DISPLAY", "XDG_RUNTIME_DIR"},
                             .most_seconds = kMostSeconds};
    const Outcome outcome = run_program({"view", scene}, options);
    EXPECT_EQ(outcome.status, 1);
    EXPECT_TRUE(outcome.err.starts_with("halflight: window: there is no display: ")) << outcome.err;
    EXPECT_EQ(std::ranges::count(outcome.err, '\n'), 1) << outcome.err;
    EXPECT_EQ(run_program({"view", folder / "no.gltf"}, options).status, 1);
    const Outcome help = run_program({"view", "--help"}, options);
    EXPECT_EQ(help.status, 0);
    EXPECT_NE(help.out.find("--budget"), std::string::npos);
}

TEST(ViewWithout, OtherCommandsNeedNoWindowSystem) {
    const std::string program = read_text(HALFLIGHT_PROGRAM);
    ASSERT_GT(program.size(), 1u << 20);
    for (const char* library : {"libglfw.so", "libX11.so"}) {
        // Names of linked libraries have a terminating zero on both sides.
        EXPECT_EQ(program.find(std::string(1, '\0') + library), std::string::npos) << library;
    }
}

}  // namespace
}  // namespace halflight::test
