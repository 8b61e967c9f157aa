// Tests the viewer's window by scripts: the displayed picture is the one that `render` makes.
#include "engine/settings/layers.h"
#include "tests/cli/animated_scenes.h"
#include "tests/cli/view_test.h"

namespace halflight::test {
namespace {

using View = ViewTest;

TEST_F(View, ShowsTheDemoSceneWithoutAName) {
    const auto shown = [&](const Strings& named, const std::string& picture) {
        write_text(file("script.txt"), fmt::format("wait samples 2\nscreenshot {}\nquit\n", file(picture)));
        expect_done(run_program(words("view", named, "--size 64x48 --preview none --script", file("script.txt")),
                                on_display()));
        return png(picture);
    };
    const Image demo = shown({}, "a.png");
    EXPECT_EQ(difference(demo, shown({HALFLIGHT_SOURCE_DIR "/scenes/still-life.glb"}, "b.png")), 0);
    EXPECT_GT(mean(demo), 0.02);
}

TEST_F(View, PicturesEqualThoseOfRender) {
    show(R"(
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
        quit)");
    EXPECT_TRUE(same_bits(exr("seen.exr"), render("render.exr", file("render.png"), "--samples 3")));
    EXPECT_LE(difference(png("seen.png"), png("render.png")), 1.01);
    EXPECT_GT(mean(png("seen.png")), 0.002) << "it is black";
    EXPECT_EQ(difference(png("window.png"), png("seen.png")), 0) << "without panels it is the picture alone";
    EXPECT_GT(difference(png("panels.png"), png("moved.png")), 50) << "the panels are not there";

    render("bright-render.png", "--samples 3 --exposure 1.5");
    EXPECT_LE(difference(png("bright.png"), png("bright-render.png")), 1.01);
    EXPECT_GT(mean(png("bright.png")), mean(png("seen.png")));

    render("moved-render.png", "--settings", settings());
    EXPECT_LE(difference(png("moved.png"), png("moved-render.png")), 1.01) << "or settings are not what was saved";
    EXPECT_GT(difference(png("moved.png"), png("bright.png")), 10);

    const auto timings = json("timings.json");
    EXPECT_EQ(timings["views"], 2);
    EXPECT_GT(timings["seconds_to_first_picture"]["median"], 0);
    EXPECT_EQ(timings["last_picture"]["samples"], 2);
}

TEST_F(View, EveryLayerCanBeShown) {
    size = {96, 72};
    std::string script;
    Strings views = {"final", "error"};
    for (const AovInfo& layer : known_aovs()) views.emplace_back(layer.name);
    for (const std::string& name : views) {
        script += fmt::format("view {0}\nwait samples 2\nscreenshot @{0}.png\n", name);
        if (name != "final") script += fmt::format("screenshot @{}.exr\n", name);
    }
    show(script);
    render("all.exr", "--aov all");
    const ExrFile all = read_exr(file("all.exr"));
    for (const std::string& name : views) {
        SCOPED_TRACE(name);
        EXPECT_EQ(png(name + ".png").width, size.x);
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
    for (const std::string& name : words("albedo normal position depth ids cryptoobject cryptomaterial"))
        EXPECT_GT(mean(png(name + ".png")), 0.02) << name << " is black";
}

TEST_F(View, ComponentsAndTwoPicturesSideBySide) {
    show(R"(
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
        screenshot @with.png)");
    const Image both = png("both.png"), without = png("without.png"), with = png("with.png");
    EXPECT_GT(difference(with, without), 10);
    const ivec2 split(both.width / 4, 0), left(split.x, both.height), right(both.width - split.x, both.height);
    EXPECT_EQ(difference(part_of(both, {0, 0}, left), part_of(without, {0, 0}, left)), 0);
    EXPECT_EQ(difference(part_of(both, split, right), part_of(with, split, right)), 0)
        << "in the same exposure, although it was kept before that";
    EXPECT_GT(difference(png("window.png"), both), 50) << "there is no line between them";
    // The written file holds the displayed picture.
    const ExrFile exr = read_exr(file("without.exr"));
    const auto values = [&](const std::string& name) { return exr.find(name)->values; };
    const auto sum = values("R"), a = values("direct_glossy.R"), b = values("indirect_diffuse.R"),
               c = values("indirect_glossy.R");
    for (std::size_t i = 0; i < sum.size(); ++i) ASSERT_EQ(sum[i], a[i] + b[i] + c[i]);
    expect_has(exr.attributes.comments, "no emission, no direct_diffuse");
}

TEST_F(View, ErrorsAreEstimatedAndBiasesNamed) {
    show(R"(
        wait error 0.5
        timings @timings.json
        screenshot @plain.exr
        clamp 0.001
        wait samples 2
        screenshot @clamped.exr
        window @window.png
        screenshot @clamped.png)");
    const auto last = json("timings.json")["last_picture"];
    EXPECT_LT(last["estimated_relmse"], 0.5);
    EXPECT_GE(last["samples"], 4);
    EXPECT_GT(difference(png("window.png"), png("clamped.png")), 50) << "nothing says that it is biased";
    EXPECT_EQ(bias_of(file("plain.exr")), "");
    expect_has(bias_of(file("clamped.exr")), "0.001");
}

TEST_F(View, PreviewModesAreNamedAndHandOverToTheMean) {
    show(R"(
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
        quit)");
    for (const char* mode : {"earlier pictures", "noise"}) expect_has(bias_of(file("early.exr")), mode);
    EXPECT_GT(difference(png("early-window.png"), png("early.png")), 20) << "they are not named in the window";
    EXPECT_EQ(bias_of(file("sum.exr")), "") << "components are as they are";
    EXPECT_EQ(difference(png("sum-window.png"), png("sum.png")), 0);
    EXPECT_EQ(bias_of(file("late.exr")), "");
    EXPECT_EQ(difference(png("late-window.png"), png("late.png")), 0);
    EXPECT_TRUE(same_bits(exr("late.exr"), render("mean.exr", "--samples 32 --settings", settings())));
}

TEST_F(View, PreviewsAreTheDefaultAndBecomeTheMean) {
    const auto seen = [&](const Strings& options) {
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
        return json_file(settings())["preview"];
    };
    size = {48, 32};
    EXPECT_EQ(seen({}), "cache,filter");
    for (const char* mode : {"noise", "radiance cache"}) expect_has(bias_of(file("early.exr")), mode);
    EXPECT_GT(difference(png("early-window.png"), png("early.png")), 20) << "the window does not name the modes";
    EXPECT_EQ(bias_of(file("late.exr")), "");
    EXPECT_EQ(difference(png("late-window.png"), png("late.png")), 0);
    const Image with_modes = exr("late.exr");

    EXPECT_EQ(seen({"--preview", "none"}), "none") << "the option goes before the file";
    EXPECT_EQ(bias_of(file("early.exr")), "");
    EXPECT_EQ(difference(png("early-window.png"), png("early.png")), 0);
    // The picture with modes lacks the 4 cached samples, and is the mean of the others.
    EXPECT_TRUE(same_bits(with_modes, render("mean.exr", "--samples 252")));
}

TEST_F(View, ErrorsAreMeasuredAgainstAReference) {
    render("reference.exr");
    show("reference @reference.exr\nwait samples 2\nwait error 1e-8\ntimings @timings.json\n");
    const auto last = json("timings.json")["last_picture"];
    EXPECT_EQ(last["relmse"], 0);
    EXPECT_EQ(last["samples"], 2);
    render("aces.exr", "--working-space acescg");
    show("reference @aces.exr\nwait samples 2\nwait error 1e-8\ntimings @aces.json\n");
    EXPECT_LT(json("aces.json")["last_picture"]["relmse"], 1e-10);
    size = {40, 30};
    expect_has(view("wait first\nreference @reference.exr\nwait samples 1\n").err, "halflight: reference: ");
}

TEST_F(View, SizeAndModesAreSaved) {
    show("preview filter\nclamp 0.5\nwait samples 2\nscreenshot @seen.exr\nsave\n");
    done(words("render", scene, file("render.exr"), "--samples 2 --settings", settings()));
    EXPECT_TRUE(same_bits(exr("seen.exr"), exr("render.exr")));
    EXPECT_EQ(bias_of(file("seen.exr")), bias_of(file("render.exr")));
}

TEST_F(View, LightsMaterialsAndBookmarks) {
    show(R"(
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
         {"--env", "0.5,0.5,1"});
    render("above-render.png", "--settings", settings());
    EXPECT_LE(difference(png("above.png"), png("above-render.png")), 1.01);
    EXPECT_GT(difference(png("above.png"), png("first.png")), 10);
    // The bookmark's camera differs from the scene's only by rounding.
    EXPECT_NEAR(mean(png("first.png")), mean(png("again.png")), 0.01);

    // The next run uses the saved settings.
    show("wait samples 2\nscreenshot @next.png\nrecall here\n");
    EXPECT_EQ(difference(png("next.png"), png("above.png")), 0);
    show("wait samples 2\nscreenshot @other.png\n", words("--camera front --bounces 8"));
    EXPECT_GT(difference(png("other.png"), png("above.png")), 10) << "the command line goes before the file";
}

TEST_F(View, OpensScenesAndEnvironments) {
    TemporaryFolder second;
    const std::string dark = copy_room(second.path, false);
    ExrLayer sky{{"R", "G", "B"}, Image(8, 4, 3)};
    std::ranges::fill(sky.image.pixels, 0.7f);
    write_exr(file("sky.exr"), {sky}, {});
    show(fmt::format("wait samples 1\nopen {}\nopen @sky.exr\nwait samples 2\nscreenshot @opened.exr\n", dark),
         {"--quiet"});
    scene = dark;
    EXPECT_TRUE(same_bits(exr("opened.exr"), render("render.exr", "--env", file("sky.exr"))));
}

TEST_F(View, AnimationFramesEqualThoseOfRender) {
    scene = write_animated_scene(folder.path).string();
    show(R"(
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
        play 0.7
        wait samples 2
        screenshot @played.exr
        frame 20
        wait samples 2
        screenshot @again.exr)",
         {"--quiet"});
    const Image seven = render("7.exr", "--animation all --frame 7");
    const Image twenty = render("20.exr", "--animation fly --frame 20 --camera moving");
    EXPECT_TRUE(same_bits(exr("seven.exr"), seven));
    EXPECT_TRUE(same_bits(exr("fly.exr"), twenty));
    EXPECT_FALSE(same_bits(exr("played.exr"), exr("fly.exr"))) << "it has gone on";
    EXPECT_TRUE(same_bits(exr("again.exr"), twenty));
    show("wait samples 2\nscreenshot @start.exr\n", words("--quiet --animation all --frame 7"));
    EXPECT_TRUE(same_bits(exr("start.exr"), seven));

    show("animation turn\nframe 11\ncamera moving\nwait samples 2\nscreenshot @saved.exr\nsave\n", {"--quiet"});
    EXPECT_TRUE(same_bits(render("settings.exr", "--settings", settings()), exr("saved.exr")));
    std::filesystem::remove(settings());
    expect_error("animation jump\n", 1, "animated.glb: no animation 'jump'");
    expect_error("play 1\n", 1, "play: ");  // no animation is chosen
}

TEST_F(View, LightsAreMoved) {
    GltfBuilder b;
    b.add_mesh({{"POSITION", b.floats("VEC3", {-2, -2, 0, 2, -2, 0, 0, 2, 0})}});
    b.json["extensionsUsed"] = {"KHR_lights_punctual"};
    b.json["extensions"]["KHR_lights_punctual"]["lights"] = {
        {{"type", "spot"}, {"intensity", 50}, {"spot", Json::object()}}};
    b.push("nodes", {{"translation", {0, 0, 3}}, {"extensions", {{"KHR_lights_punctual", {{"light", 0}}}}}});
    b.push("cameras", {{"type", "perspective"}, {"perspective", {{"yfov", 0.8}, {"znear", 0.1}}}});
    b.push("nodes", {{"camera", 0}, {"translation", {0, 0, 4}}});
    scene = file("lamp.glb");
    write_text(scene, b.glb());
    show(R"(
        wait samples 2
        screenshot @first.exr
        place 0 1 0 2
        aim 0 -0.2 0.3 -2
        wait samples 2
        screenshot @moved.exr
        save)",
         {"--quiet"});
    EXPECT_TRUE(same_bits(exr("moved.exr"), render("render.exr", "--settings", settings())));
    EXPECT_FALSE(same_bits(exr("moved.exr"), exr("first.exr")));
    // The commands continue edits of the file, also of earlier files: a colour takes the place of a temperature.
    write_text(settings(), R"({"halflight_settings": 1, "lights": [{"temperature": 2700, "intensity": 80}]})");
    show("light 0 0 1 0\nlight 0 2\nwait samples 2\nscreenshot @green.exr\nsave\n", {"--quiet"});
    EXPECT_EQ(json_file(settings()).at("lights"),
              nlohmann::json::parse(R"({"0": {"factor": 2.0, "intensity": 80.0, "color": [0.0, 1.0, 0.0]}})"));
    EXPECT_TRUE(same_bits(exr("green.exr"), render("render.exr", "--settings", settings())));
    expect_error("place 1 0 0 0\n", 1, "there is no light 1");
}

/// The parser of scripts has a test of its own (test_view_logic.cpp). These errors come from the commands.
TEST_F(View, ErrorsNameTheLine) {
    expect_error("camera nobody\n", 1, scene + ": no camera 'nobody'");
    expect_error("wait first\nopen @no.glb\nquit\n", 2, file("no.glb: cannot read"));
    expect_error("open @script.txt\n", 1, file("script.txt: is neither"));
    // Another thread opens the device, so the window exists before the error.
    expect_error("wait first\n", 1, "GPU: ", {"--device", "no such device"});
    for (const auto& [command, element] : {std::pair("jump", "'jump'"),
                                           {"screenshot @a.png", "a.png: not written"},
                                           {"recall there", "'there'"},
                                           {"light 0 1 0 0", "there is no light 0"},
                                           {"component light on", "'light'"},
                                           {"compare on", "compare: "},
                                           {"culling some", "'some'"},
                                           {"view sideways", "'sideways'"},
                                           {"transform nothing Un-tone-mapped", ""}})
        expect_error(std::string("\n\n") + command + "\n", 3, element);
    EXPECT_EQ(view("quit\n", {"--view", "nothing"}).status, 1);
    for (const char* stale : {"display", "view", "look"}) {
        write_text(settings(), fmt::format(R"({{"halflight_settings": 1, "{}": "none"}})", stale));
        const Outcome outcome = view("quit\n");
        EXPECT_EQ(outcome.status, 0) << outcome.err;
        expect_has(outcome.err, "halflight.json: an entry is left out");
    }
    write_text(settings(), "{}");
    refused(1, words("view", scene), settings() + ": ", on_display());
}

TEST(ViewWithout, ADisplayIsAnError) {
    TemporaryFolder folder;
    const std::string scene = copy_room(folder.path);
    const RunOptions options{.environment = {"DISPLAY", "WAYLAND_DISPLAY", "XDG_RUNTIME_DIR"},
                             .most_seconds = kMostSeconds};
    const Outcome outcome = run_program({"view", scene}, options);
    EXPECT_EQ(outcome.status, 1);
    EXPECT_TRUE(outcome.err.starts_with("halflight: window: ")) << outcome.err;
    EXPECT_EQ(std::ranges::count(outcome.err, '\n'), 1) << outcome.err;
    EXPECT_EQ(run_program({"view", folder / "no.gltf"}, options).status, 1);
    EXPECT_EQ(run_program({"view", "--help"}, options).status, 0);
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
