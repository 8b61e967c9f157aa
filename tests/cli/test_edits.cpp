// Tests `halflight render --settings`, edits by name on the command line and in settings files, names of `info`, and
// pictures of all cameras.
#include <cmath>
#include <utility>

#include "engine/core/image_tools.h"
#include "tests/cli/animated_scenes.h"
#include "tests/cli/output_test.h"
#include "tests/support/ies_files.h"

namespace halflight::test {
namespace {

class Edits : public Output {
  protected:
    Outcome run(const std::string& output, const Strings& more) {
        return run_program(words("render", scene, file(output), "--width 24 --height 18 --samples 2 --quiet", more));
    }
    Image render(const Strings& more) {
        const Outcome outcome = run("a.exr", more);
        EXPECT_EQ(outcome.status, 0) << outcome.err;
        return picture("a.exr");
    }
    Image picture(const std::string& name) const { return read_exr(file(name)).image({"R", "G", "B", "A"}); }
    std::string settings(const std::string& more) {
        write_text(file("s.json"), "{\"halflight_settings\": 1, " + more + "}");
        return file("s.json");
    }
};

TEST_F(Edits, OptionsAndFilesMakeTheSamePictures) {
    const Image plain = render({});
    const std::pair<const char*, const char*> cases[] = {
        {"--material floor.base_color=#20c040 --material floor.roughness=0.25",
         R"("materials": {"floor": {"base_color": "#20c040", "roughness": 0.25}})"},
        {"--node 1=translate:0.5,0,0,rotate:0,0,20",
         R"("nodes": {"1": {"translate": [0.5, 0, 0], "rotate": [0, 0, 20]}})"},
        {"--hide mesh:lamp --env white", R"("hide": ["mesh:lamp"], "environment": {"color": [1, 1, 1]})"},
        {"--shadow-catcher * --env white", R"("shadow_catchers": ["*"], "environment": {"color": [1, 1, 1]})"},
        {"--light *=temperature:2700,factor:2 --sky 40,20",
         R"("lights": {"*": {"temperature": 2700, "factor": 2}}, "environment": {"sky": {"elevation": 40, "azimuth": 20}})"},
        {"--add-light panel=kind:rectangle,position:0,1.5,0,intensity:4 --light panel=size:1,0.5 "
         "--add-light spot=kind:spot,position:0.5,1,0.5,outer:40 --light *=factor:2",
         R"("added_lights": {"panel": {"kind": "rectangle", "position": [0, 1.5, 0], "intensity": 4, "size": [1, 0.5]},
            "spot": {"kind": "spot", "position": [0.5, 1, 0.5], "outer": 40}}, "lights": {"*": 2})"}};
    for (const auto& [options, json] : cases) {
        const Image by_options = render(words(options));
        EXPECT_FALSE(same_bits(by_options, plain)) << options;
        EXPECT_TRUE(same_bits(by_options, render({"--settings", settings(json)}))) << options;
    }
    // Options come after the file, key by key.
    const std::string red = settings(R"("materials": {"floor": {"base_color": "#f00", "roughness": 0.25}})");
    EXPECT_TRUE(same_bits(render(words("--settings", red, "--material floor.base_color=#20c040")),
                          render(words(cases[0].first))));
    // Earlier files have indices.
    const std::string old = settings(R"("materials": {"0": {"base_color": [1, 0, 0, 1], "roughness": 0.25}})");
    EXPECT_TRUE(same_bits(render({"--settings", old}),
                          render(words("--material floor.base_color=#f00 --material floor.roughness=0.25"))));
}

TEST_F(Edits, NamesOfAddedLightsCanBePastedBack) {
    const Strings options = words("--add-light panel=kind:disc,position:0,1.5,0,intensity:4,size:0.5");
    const Image added = render(options);
    const Outcome names = done(words("info", scene, "--names", options));
    const std::size_t at = names.out.find("panel=");
    ASSERT_NE(at, std::string::npos) << names.out;
    const std::string again = names.out.substr(at, names.out.find('\n', at) - at);
    expect_has(again, ",size:0.5,0.5");
    EXPECT_TRUE(same_bits(added, render(words(options, "--light", again))));
    expect_has(done(words("info", scene, "--json", options)).out, "\"nits\"");
    refused(1, words("render", scene, file("a.exr"), options, "--add-light panel=kind:sun"), "'panel' is added twice");
    refused(2, words("render", scene, file("a.exr"), "--add-light panel=kind:lamp"),
            "--add-light: panel: kind: 'lamp'");
}

TEST_F(Edits, KeysOverFramesAreEditsOfEachFrame) {
    const auto keys = [&](const char* last) {
        return settings(fmt::format(R"("environment": {{"color": [1, 1, 1]}}, "keys": {{
            "materials": {{"floor": {{"base_color": {{"0": [0.2, 0.4, 0.8], "2": [0.2, 0.4, 0.8], "4": {}}}}}}},
            "nodes": {{"1": {{"translate": {{"0": [0, 0, 0], "4": [1, 0, 0]}}}}}},
            "hide": {{"mesh:lamp": {{"0": false, "4": true}}}}, "camera": {{"vfov_degrees": {{"0": 30, "4": 50}}}}}})",
                                    last));
    };
    const char* view = "--look-from 0,1,4 --look-at 0,1,0";  // cameras that frame the scene frame that of 0 s
    const Strings all = words(view, "--frames 0-5 --overwrite --reproducible --settings", keys("[0.6, 0.2, 0.4]"));
    ASSERT_EQ(run("f.#.exr", all).status, 0);
    const auto whole = [&](int frame) { return read_text(file(fmt::format("f.{}.exr", frame))); };
    const std::pair<int, const char*> same[] = {
        {0, "--material floor.base_color=0.2,0.4,0.8 --vfov 30"},
        {3, "--material floor.base_color=0.4,0.3,0.6 --node 1=translate:0.75,0,0 --vfov 45"},
        {5, "--material floor.base_color=0.6,0.2,0.4 --hide mesh:lamp --vfov 50"}};
    for (const auto& [frame, options] : same)
        EXPECT_TRUE(
            same_bits(picture(fmt::format("f.{}.exr", frame)),
                      render(words(view, options, "--env 1,1,1 --animation none --frame", std::to_string(frame)))))
            << options;
    // A frame is the same alone, and another key changes the frames between its neighbours alone.
    const std::vector<std::string> before{whole(0), whole(1), whole(2), whole(3)};
    fs::remove(file("f.1.exr"));
    ASSERT_EQ(run("f.#.exr", words(view, "--frames 1 --reproducible --settings", file("s.json"))).status, 0);
    EXPECT_EQ(whole(1), before[1]);
    keys("[0.5, 0.2, 0.4]");
    const Outcome refused_run = run("f.#.exr", words(view, "--frames 0-5 --reproducible --settings", file("s.json")));
    EXPECT_EQ(refused_run.status, 1);
    expect_has(refused_run.err,
               "f.3.exr: exists, but is not this frame of this scene with these settings and this "
               "version: edits+0 differs");
    ASSERT_EQ(run("f.#.exr", words(all, "--stats", file("stats.json"))).status, 0);
    EXPECT_EQ(json_lines(read_text(file("stats.json"))).size(), 3u) << "frames 3, 4 and 5";
    for (const int frame : {0, 1, 2}) EXPECT_EQ(whole(frame), before[std::size_t(frame)]) << frame;
    EXPECT_NE(whole(3), before[3]);
}

/// Edits over frames equal an animation of the file, also between frames.
TEST_F(Edits, KeysOverFramesBlurAndDenoiseLikeAnimations) {
    const std::string fading = write_fading_scene(folder.path, 8, 2);
    const std::string keys = settings(R"("keys": {"lights": {"0": {"intensity": {"0": 8, "24": 2}}}})");
    const Strings common =
        words("--width 16 --height 12 --samples 4 --frames 11-13 --fps 24 --reproducible --quiet", "--camera outside");
    for (const char* more : {"--shutter 1", "--denoise --denoise-frames 1", "--shutter 0.5 --denoise --keep-noisy"}) {
        done(words("render", fading, file("a.##.exr"), common, more, "--overwrite"));
        done(words("render", fading, file("k.##.exr"), common, more, "--animation none --overwrite --settings", keys));
        for (const char* frame : {"11", "12", "13"})
            EXPECT_TRUE(same_bits(picture(fmt::format("a.{}.exr", frame)), picture(fmt::format("k.{}.exr", frame))))
                << more << ", frame " << frame;
    }
    // Denoising as a step of its own, and processes that share the frames.
    const std::string direct = read_text(file("k.12.exr"));
    fs::remove(file("k.12.exr"));
    done(words("denoise", file("k.##.noisy.exr"), "--frames 11-13 -o", file("k.##.exr"), "--reproducible --quiet"));
    EXPECT_EQ(read_text(file("k.12.exr")), direct);
}

/// The denoiser uses frame 0 for frame 1, and not frame 2, which has other light.
TEST_F(Edits, KeyedLightPartsFramesOfTheDenoiser) {
    const std::pair<const char*, const char*> cases[] = {
        {"--sky 40,20", R"("lights": {"sun": {"intensity": {"1": 1, "2": 0}}})"},
        {"--env 1,1,1", R"("hide": {"mesh:lamp": {"1": false, "2": true}})"}};
    for (const auto& [options, keys] : cases) {
        const std::string keyed = settings(fmt::format(R"("keys": {{{}}})", keys));
        done(words("render", scene, file("a.#.exr"), options, "--width 16 --height 12 --samples 2 --frames 1 --denoise",
                   "--denoise-frames 1 --overwrite --quiet --stats", file("stats.json"), "--settings", keyed));
        const auto stats = json_lines(read_text(file("stats.json")));
        EXPECT_EQ(stats.back()["denoise_neighbours"]["frames"], 1) << keys;
    }
}

TEST_F(Edits, UnusableEditsAreOneLine) {
    const std::string missing = settings(R"("nodes": {"crate": {"scale": 2}})");
    for (const auto& [options, element] :
         {std::pair(words("--material flor.roughness=0.2"),
                    "room.gltf: there is no material 'flor'; did you mean 'floor'"),
          std::pair(words("--light sun=off"), "room.gltf: there is no light 'sun'"),
          std::pair(words("--hide nobody"), "nobody"),
          std::pair(Strings{"--settings", missing}, "room.gltf: there is no node 'crate'")})
        refused(1, words("render", scene, file("a.exr"), options), element);
    const std::string keyed = settings(R"("keys": {"materials": {"flor": {"roughness": {"1": 1}}}})");
    const auto line =
        "s.json: keys.materials.flor.roughness: " + scene + ": there is no material 'flor'; did you mean 'floor'";
    refused(1, words("render", scene, file("a.exr"), "--settings", keyed), line);
}

TEST_F(Edits, NamesCanBePastedBack) {
    const Outcome names = done({"info", scene, "--names"});
    Strings options;
    std::istringstream lines(names.out);
    for (std::string line; std::getline(lines, line);) {
        const auto space = line.find(' ');
        const std::string option = line.substr(0, space), value = line.substr(space + 1);
        if (option == "--camera" || option == "--variant" || option == "--hide") continue;
        options.push_back(option);
        options.push_back(value.starts_with('\'') ? value.substr(1, value.size() - 2) : value);
    }
    EXPECT_NE(std::ranges::find(options, "floor.base_color=0.7,0.5,0.3,1"), options.end()) << names.out;
    expect_has(names.out, "--camera above\n");
    expect_has(names.out, "--hide mesh:lamp\n");
    EXPECT_TRUE(same_bits(render(options), render({})));
    expect_has(done(words("info", scene, "--names --material floor.metallic=0.5")).out, "floor.metallic=0.5");
}

TEST_F(Edits, FingerprintsIncludeThem) {
    const auto status = [&](const char* more) { return run("f.#.exr", words("--frames 1 --bounces 0", more)).status; };
    ASSERT_EQ(status(""), 0);
    EXPECT_EQ(status(""), 0) << "the frame is kept";
    for (const char* edit :
         {"--hide mesh:lamp", "--node 1=scale:2", "--material floor.roughness=0.2", "--add-light day=kind:sun"})
        EXPECT_EQ(status(edit), 1) << edit << ": that is another frame";
}

TEST_F(Edits, HoldInAllFramesWithMotionBlur) {
    const Outcome outcome = run(
        "m.#.exr", words("--frames 1-2 --shutter 0.5 --shutter-times 2 --hide mesh:lamp", "--env white --aov motion"));
    ASSERT_EQ(outcome.status, 0) << outcome.err;
}

TEST_F(Edits, AllCamerasMakeAPictureEach) {
    ASSERT_EQ(run("shot.exr", words("--camera all")).status, 0);
    for (const std::string camera : {"front", "above"})
        EXPECT_TRUE(same_bits(picture("shot." + camera + ".exr"), render({"--camera", camera}))) << camera;
    std::string text = read_text(scene);  // cameras whose names are numbers of each other
    for (const auto& [from, to] : {std::pair("\"front\"", "\"1\""), std::pair("\"above\"", "\"0\"")})
        for (std::size_t at = 0; (at = text.find(from)) != std::string::npos;) text.replace(at, 7, to);
    const std::string named = std::exchange(scene, file("digits.gltf"));
    write_text(scene, text);
    ASSERT_EQ(run("digit.exr", words("--camera all")).status, 0);
    EXPECT_TRUE(same_bits(picture("digit.1.exr"), picture("shot.front.exr")));
    EXPECT_TRUE(same_bits(picture("digit.0.exr"), picture("shot.above.exr")));
    // Names of cameras may be longer than those of files.
    for (std::size_t at = 0; (at = text.find("\"1\"", at)) != std::string::npos;)
        text.replace(at, 3, '"' + std::string(300, 'n') + '"');
    write_text(scene, text);
    ASSERT_EQ(run("long.exr", words("--camera all")).status, 0);
    EXPECT_TRUE(std::filesystem::exists(file("long." + std::string(150, 'n') + ".exr")));
    scene = named;
    ASSERT_EQ(run("{camera}/shot.#.exr", words("--camera all --frames 1-2")).status, 0);
    EXPECT_TRUE(std::filesystem::exists(file("front/shot.2.exr")));
    EXPECT_TRUE(std::filesystem::exists(file("above/shot.1.exr")));
    EXPECT_FALSE(std::filesystem::exists(file("{camera}")));

    // One camera fails, and the other one does not.
    std::filesystem::create_directory(file("g.front.exr"));
    const Outcome failed = run("g.exr", words("--camera all"));
    EXPECT_EQ(failed.status, 1);
    expect_has(failed.err, "g.front.exr: ");
    expect_has(failed.err, "--camera all: ");
    EXPECT_TRUE(std::filesystem::exists(file("g.above.exr")));
}

TEST_F(Edits, NamesHoldThatOfTheCamera) {
    ASSERT_EQ(run("{camera}.exr", {}).status, 0);
    ASSERT_EQ(run("{camera}.exr", words("--camera above")).status, 0);
    ASSERT_EQ(run("{camera}.#.exr", words("--camera 1 --frames 1")).status, 0);
    for (const char* name : {"front.exr", "above.exr", "above.1.exr"})
        EXPECT_TRUE(std::filesystem::exists(file(name))) << name;
    EXPECT_FALSE(std::filesystem::exists(file("{camera}.exr")));
    refused(1, words("render", scene, file("{camera}.exr"), "--look-from 1,1,1 --look-at 0,0,0"), "{camera}");
}

TEST_F(Edits, TheSunOfTheSkyLeavesNamesToTheScene) {
    auto json = json_file(scene);
    json["extensionsUsed"].push_back("KHR_lights_punctual");
    json["extensions"]["KHR_lights_punctual"]["lights"] = {{{"name", "sun"}, {"type", "directional"}}};
    json["scenes"][0]["nodes"].push_back(json["nodes"].size());
    json["nodes"].push_back({{"name", "sun"}, {"extensions", {{"KHR_lights_punctual", {{"light", 0}}}}}});
    write_text(scene, json.dump());
    render(words("--sky 40,120 --light sun=0.5 --light", std::string("sky sun=0.5")));
}

class LightProfiles : public Edits {
  protected:
    void SetUp() override {
        auto json = json_file(scene);
        json["extensionsUsed"].push_back("KHR_lights_punctual");
        json["extensions"]["KHR_lights_punctual"]["lights"] = {{{"type", "point"}}, {{"type", "directional"}}};
        for (const auto& [light, name] : {std::pair(0, "desk"), {1, "sun"}}) {
            json["scenes"][0]["nodes"].push_back(json["nodes"].size());
            json["nodes"].push_back({{"name", name},
                                     {"translation", {0, 1, 0}},
                                     {"rotation", {-std::sqrt(0.5), 0, 0, std::sqrt(0.5)}},
                                     {"extensions", {{"KHR_lights_punctual", {{"light", light}}}}}});
        }
        write_text(scene, json.dump());
        write_text(file("lamp.ies"), downlight().text());
    }
    const std::string lamp = "desk=ies:" + file("lamp.ies");
};

TEST_F(LightProfiles, OfOptionsAndFilesMakeTheSamePictures) {
    const Image shown = render({"--light", lamp + ",radius:0.1"});
    EXPECT_FALSE(same_bits(shown, render(words("--light desk=radius:0.1"))));
    const std::string saved = settings(R"("lights": {"desk": {"ies": "lamp.ies", "radius": 0.1}})");
    EXPECT_TRUE(same_bits(shown, render({"--settings", saved})));
    const Outcome names = done({"info", scene, "--names", "--light", lamp + ",radius:0.1"});
    expect_has(names.out, ",radius:0.1");
    expect_has(names.out, ",ies:" + file("lamp.ies"));
    const std::size_t at = names.out.find("desk=");
    const Image again = render({"--light", names.out.substr(at, names.out.find('\n', at) - at)});
    double sum = 0, difference = 0;  // the direction is normalised again
    for (std::size_t i = 0; i < shown.pixels.size(); ++i) {
        sum += double{shown.pixels[i]};
        difference += std::abs(double{shown.pixels[i]} - double{again.pixels[i]});
    }
    EXPECT_LT(difference, 1e-3 * sum);
    expect_has(done({"info", scene, "--json", "--light", lamp}).out, "\"profile\"");
}

TEST_F(LightProfiles, BelongToTheFingerprint) {
    const auto status = [&](const Strings& more) {
        return run("f.#.exr", words("--frames 1 --bounces 0", more)).status;
    };
    ASSERT_EQ(status({"--light", lamp}), 0);
    EXPECT_EQ(status({"--light", lamp}), 0) << "the frame is kept";
    std::filesystem::rename(file("lamp.ies"), file("same.ies"));
    EXPECT_EQ(status({"--light", "desk=ies:" + file("same.ies")}), 0) << "the name does not matter";
    write_text(file("lamp.ies"), street_lamp().text());
    EXPECT_EQ(status({"--light", lamp}), 1) << "that is another frame";
}

TEST_F(LightProfiles, DamagedAreOneLine) {
    const std::string text = downlight().text();
    write_text(file("lamp.ies"), text.substr(0, text.size() - 20));
    const auto refuse = [&](const std::string& edit, const std::string& element) {
        refused(1, words("render", scene, file("a.exr"), "--light", edit), element);
    };
    refuse(lamp, "lamp.ies: ends before candela value");
    refuse("desk=ies:none.ies", "none.ies");
    refuse("sun=ies:none.ies", "a directional light has no profile");
    refused(2, words("render", scene, file("a.exr"), "--light desk=ies:"), "expects a file");
}

class Settings : public Edits {
  protected:
    /// Runs the program without a number of samples.
    Outcome run(const std::string& output, const Strings& more) {
        return run_program(words("render", scene, file(output), "--width 24 --height 18 --quiet", more));
    }
    ExrFile rendered(const Strings& more) {
        const Outcome outcome = run("a.exr", more);
        EXPECT_EQ(outcome.status, 0) << outcome.err;
        return read_exr(file("a.exr"));
    }
    static bool same(const ExrFile& a, const ExrFile& b) {
        return std::ranges::equal(a.channels, b.channels, same_values);
    }
};

TEST_F(Settings, AreEquivalentToOptions) {
    const std::string s = settings(R"("camera": "above", "samples": 3, "bounces": 1, "exposure": 1,
                                      "environment": {"color": [0.2, 0.6, 0.4], "intensity": 2, "tint": [1, 0.5, 1]})");
    const Strings options = words("--camera above --samples 3 --bounces 1 --env 0.4,0.6,0.8");
    const ExrFile expected = rendered(options), by_file = rendered({"--settings", s});
    EXPECT_TRUE(same(by_file, expected));
    expect_has(by_file.attributes.comments, "3 samples, 1 bounces");

    const Strings others = words("--camera front --samples 2 --bounces 0");
    const ExrFile own = rendered(words("--settings", s, others));
    EXPECT_FALSE(same(own, expected));
    EXPECT_TRUE(same(own, rendered(words(others, "--env 0.4,0.6,0.8"))));

    ASSERT_EQ(run("a.png", words(options, "--exposure 1")).status, 0);
    ASSERT_EQ(run("b.png", {"--settings", s}).status, 0);
    EXPECT_EQ(read_text(file("a.png")), read_text(file("b.png")));
}

TEST_F(Settings, HaveSizeAndBiases) {
    const std::string s = settings(R"("samples": 2, "size": [40, 20], "preview": "filter,temporal", "clamp": 0.01)");
    const auto picture = [&](const Strings& more) {
        done(words("render", scene, file("a.exr"), "--quiet", more));
        return read_exr(file("a.exr"));
    };
    const auto size = [&](const char* more) {
        const ExrFile exr = picture(words("--settings", s, "--bounces 0 --samples 1", more));
        return ivec2(exr.width, exr.height);
    };
    EXPECT_EQ(size(""), ivec2(40, 20));
    EXPECT_EQ(size("--width 10"), ivec2(10, 5)) << "the file's shape";
    EXPECT_EQ(size("--height 10"), ivec2(20, 10));
    EXPECT_EQ(size("--width 10 --height 10"), ivec2(10, 10));

    const auto bias = [](const ExrFile& exr) { return exr.attributes.extra.contains("bias"); };
    const ExrFile by_file = picture({"--settings", s});
    EXPECT_TRUE(bias(by_file));
    EXPECT_TRUE(same(by_file, picture(words("--width 40 --height 20 --samples 2 --preview filter --clamp 0.01"))))
        << "temporal is for frames";
    EXPECT_FALSE(bias(picture(words("--settings", s, "--preview none --clamp 0"))));
    // Options for an error target or a shutter take precedence over modes of the file that exclude them.
    EXPECT_FALSE(bias(picture(words("--settings", s, "--clamp 0 --error 1e9 --samples 16"))));
    for (const char* more : {"--denoise", "--crop 0,0,16,16", "--overscan 2", "--adaptive --samples 16",
                             "--sample-parts 2", "--checkpoint 60"}) {
        ExrFile made = picture(words("--settings", s, "--clamp 0", more));
        EXPECT_FALSE(has(made.attributes.extra["bias"], "preview")) << more;
    }
    EXPECT_EQ(run("p.exr", words("--settings", s, "--part 1/2")).status, 0);
    const Strings frames = words("--settings", s, "--frames 1-2");
    EXPECT_EQ(run("e.#.exr", words(frames, "--shutter 0.5 --shutter-times 2")).status, 0);
    refused(2, words("render", scene, file("f.#.exr"), frames, "--part 1/2"), "temporal");
    EXPECT_EQ(run("f.#.exr", words(frames, "--part 1/2 --preview filter")).status, 0);
    EXPECT_EQ(run("g.#.exr", frames).status, 0);
    expect_has(bias_of(file("g.2.exr")), "earlier pictures");
}

TEST_F(Settings, HaveALensWhoseApertureAnFNumberReplaces) {
    const std::string s = settings(R"("focus": "2", "aperture": 40, "exposure": 1)");
    const ExrFile wide = rendered({"--settings", s});
    const ExrFile narrow = rendered(words("--settings", s, "--fstop 8"));
    EXPECT_TRUE(same(wide, rendered(words("--focus 2 --aperture 40"))));
    EXPECT_TRUE(same(narrow, rendered(words("--focus 2 --fstop 8"))));
    EXPECT_FALSE(same(wide, narrow));
    ASSERT_EQ(run("b.png", words("--settings", s, "--fstop 8")).status, 0);
    ASSERT_EQ(run("c.png", words("--focus 2 --fstop 8 --exposure 1")).status, 0);
    EXPECT_EQ(read_text(file("b.png")), read_text(file("c.png"))) << "an f-number beside a focus sets no exposure";
}

TEST_F(Settings, HaveCamerasOfTheirOwn) {
    const std::string pose = R"("samples": 2, "camera": {"from": [1, 2, 5], "at": [0, 0.5, 0], "up": [0, 1, 0], )";
    for (const auto& [field, option] :
         {std::pair(R"("vfov": 0.7853981633974483})", ""), std::pair(R"("vfov_degrees": 33.3})", "--vfov 33.3")})
        EXPECT_TRUE(same(rendered({"--settings", settings(pose + field)}),
                         rendered(words("--look-from 1,2,5 --look-at 0,0.5,0 --samples 2", option))));
}

TEST_F(Settings, EditTheLightOfSequencesToo) {
    settings(R"("samples": 1)");
    const auto sequence = [&](const std::string& name) {
        return run(name + ".##.exr", words("--settings", file("s.json"), "--frames 1-2 --reproducible"));
    };
    ASSERT_EQ(sequence("a").status, 0);
    settings(R"("samples": 1, "emission": 0.5)");
    EXPECT_EQ(sequence("a").status, 1) << "those are other frames";
    ASSERT_EQ(sequence("b").status, 0);
    const Image bright = read_exr(file("a.01.exr")).image({"R", "G", "B"});
    const Image dim = read_exr(file("b.01.exr")).image({"R", "G", "B"});
    for (std::size_t i = 0; i < dim.pixels.size(); ++i) EXPECT_NEAR(dim.pixels[i], bright.pixels[i] / 2, 1e-4);
}

TEST_F(Settings, InvalidFilesAreRefused) {
    refused(1, words("render", scene, file("a.exr"), "--settings", file("no.json")), file("no.json") + ": ");
    const std::pair<const char*, std::string> rows[] = {
        {R"("samples": 0)", "samples: "},
        {R"("camera": "nobody")", scene + ": no camera 'nobody'"},
        {R"("materials": {"2": {"roughness": 0.5}})", "materials: " + scene + ": there is no material 2"}};
    for (const auto& [text, element] : rows)
        refused(1, words("render", scene, file("a.exr"), "--settings", settings(text)), "s.json: " + element);
    // The file's contents are checked together with the rest of the command line.
    write_exr(file("sky.exr"), {ExrLayer{{"R", "G", "B"}, Image(2, 1, 3)}}, {});
    const std::string sky = read_text(file("sky.exr"));
    EXPECT_EQ(run("sky.exr", {"--settings", settings(R"("environment": {"map": "sky.exr"})")}).status, 2);
    EXPECT_EQ(read_text(file("sky.exr")), sky);
    settings("\"samples\": 3");
    refused(2,
            words("render", scene, file("a.##.exr"), "--settings", file("s.json"),
                  "--frames 1 --shutter 0.5 --shutter-times 5"),
            "--shutter-times: ");
}

}  // namespace
}  // namespace halflight::test
