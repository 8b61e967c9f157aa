// Tests sequences: frames do not depend on how they are rendered, and finished frames are kept.
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <regex>
#include <sstream>

#include "tests/cli/sequence_test.h"

namespace halflight::test {
namespace {

using Json = nlohmann::json;

/// Kills a run of frames 1 to 24 after five frames; returns false if the run was too fast.
bool kill_in_the_middle(const std::function<Outcome(const RunOptions&)>& start, const fs::path& folder) {
    bool sent = false;
    RunOptions options;
    options.watch = [&](pid_t child, const std::string&) {
        const auto frames = std::count_if(fs::directory_iterator(folder), {}, [](const auto& entry) {
            return entry.path().filename().string().starts_with("f.");
        });
        if (!sent && frames >= 5) sent = kill(child, SIGKILL) == 0;
    };
    return start(options).status == 128 + SIGKILL;
}

TEST_F(Sequence, FramesDoNotDependOnTheRun) {
    const Strings all = {"--animation", "all", "--camera", "moving", "--aov", "depth,motion,ids"};
    make("whole", "1-24", all);
    const auto whole = contents("whole");
    ASSERT_EQ(whole.size(), 24u);
    EXPECT_FALSE(same_pixels(file("whole", 1), file("whole", 12))) << "nothing moves";

    for (const char* chunk : {"1-8", "9-16", "17-24"}) make("chunks", chunk, all);
    EXPECT_TRUE(contents("chunks") == whole) << "in chunks";

    std::string backwards = "24";
    for (int frame = 23; frame >= 1; --frame) backwards += fmt::format(",{}", frame);
    make("backwards", backwards, all);
    EXPECT_TRUE(contents("backwards") == whole) << "backwards";

    for (const char* threads : {"1", "2"}) {
        const std::string into = fmt::format("threads{}", threads);
        make(into, "1-24x5", all, {.environment = {std::string("LP_NUM_THREADS=") + threads}});
        for (int frame = 1; frame <= 24; frame += 5)
            EXPECT_EQ(read_text(file(into, frame)), whole.at(file(into, frame).filename())) << threads << " threads";
    }

    bool killed = false;
    for (int attempt = 0; attempt < 3 && !killed; ++attempt) {
        fs::remove_all(folder / "killed");
        killed = kill_in_the_middle([&](const RunOptions& o) { return run("killed", "1-24", all, o); },
                                    (fs::create_directory(folder / "killed"), folder / "killed")) &&
                 contents("killed").size() < 24;
    }
    const Outcome resumed = make("killed", "1-24", all);
    if (killed) {
        EXPECT_NE(resumed.err.find(" of 24 frames are there already"), std::string::npos) << resumed.err;
    }
    EXPECT_TRUE(contents("killed") == whole) << "killed and resumed";

    // Renders one frame as a single picture.
    Strings alone = {"render",   scene, folder / "alone.exr", "--frame", "12", "--width", "16",
                     "--height", "16",  "--samples",          "2"};
    alone.insert(alone.end(), all.begin(), all.end());
    ASSERT_EQ(run_program(alone).status, 0);
    EXPECT_TRUE(same_pixels(folder / "alone.exr", file("whole", 12))) << "alone";
}

TEST_F(Sequence, StatisticsReportHierarchyUpdates) {
    // Floor and lamp are static and share a hierarchy. Three boxes move. Frame 0 is the reference pose.
    make("out", "0-2,24", {"--animation", "all", "--camera", "moving", "--stats", folder / "all.jsonl"});
    std::vector<std::array<int, 3>> found;
    const auto read = [&](const fs::path& file) {
        found.clear();
        std::istringstream lines(read_text(file));
        for (std::string line; std::getline(lines, line);) {
            const Json h = Json::parse(line).at("hierarchies");
            found.push_back({h.at("kept"), h.at("refitted"), h.at("built")});
        }
    };
    read(folder / "all.jsonl");
    using Counts = std::vector<std::array<int, 3>>;
    EXPECT_EQ(found, (Counts{{0, 0, 4}, {1, 3, 0}, {1, 3, 0}, {1, 3, 0}}));
    make("fly", "0-2", {"--animation", "fly", "--camera", "moving", "--stats", folder / "fly.jsonl"});
    read(folder / "fly.jsonl");
    EXPECT_EQ(found, (Counts{{0, 0, 1}, {1, 0, 0}, {1, 0, 0}})) << "a camera alone";
}

/// Copies all shaders. In the copy, deformed vertices are `units` higher, which shows that the GPU deformed them.
void write_raised_shaders(const fs::path& folder, double units) {
    fs::copy(fs::path(HALFLIGHT_SOURCE_DIR) / "shaders", folder, fs::copy_options::recursive);
    std::string text = read_text(folder / "deform.comp");
    const std::string place = "write(3 * vertex, position);";
    ASSERT_NE(text.find(place), std::string::npos);
    write_text(folder / "deform.comp",
               text.replace(text.find(place), place.size(),
                            fmt::format("write(3 * vertex, position + vec3(0, {}, 0));", units)));
}

TEST_F(Sequence, DeformationRunsOnTheGpuInEveryFrame) {
    write_raised_shaders(folder / "shaders", 0.25);
    const RunOptions raised{.environment = {fmt::format("HALFLIGHT_SHADERS={}", (folder / "shaders").string())}};
    const Strings layers = {"--animation", "all", "--aov", "position,motion"};
    make("plain", "0-2", layers);
    make("whole", "0-2", layers, raised);
    make("backwards", "2,1,0", layers, raised);
    for (const char* frame : {"0", "1", "2"}) make("alone", frame, layers, raised);
    EXPECT_TRUE(contents("backwards") == contents("whole"));
    EXPECT_TRUE(contents("alone") == contents("whole"));
    for (int frame = 0; frame <= 2; ++frame)
        EXPECT_FALSE(same_pixels(file("whole", frame), file("plain", frame))) << frame << " is of the CPU";
    // Before 0 s the pose is that of 0 s. Motion would show that the GPU deformed only one of the two poses.
    const ExrFile first = read_exr(file("whole", 0));
    for (const char* channel : {"motion.X", "motion.Y"})
        for (const float pixels : first.find(channel)->values) EXPECT_NEAR(pixels, 0, 0.01f) << channel;
}

TEST_F(Sequence, PanoramasShowTheMotionOfTheirCamera) {
    constexpr int kWidth = 96, kHeight = 48;
    const Outcome outcome = run_program({"render", scene, folder / "a" / "f.####.exr", "--frames", "0-1", "--samples",
                                         "1", "--width", std::to_string(kWidth), "--animation", "fly", "--camera",
                                         "moving", "--projection", "panorama", "--aov", "position,motion,depth"});
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    const ExrFile earlier = read_exr(file("a", 0)), later = read_exr(file("a", 1));
    const auto place = [&](const ExrFile& of, const dvec3& point) {
        const dvec3 p(*of.attributes.world_to_camera * dvec4(point, 1));
        return dvec2((std::atan2(p.x, -p.z) / (2 * kPi) + 0.5) * kWidth,
                     (0.5 - std::asin(p.y / glm::length(p)) / kPi) * kHeight);
    };
    ASSERT_NE(*earlier.attributes.world_to_camera, *later.attributes.world_to_camera) << "the camera moves";
    const Image position = later.image({"position.X", "position.Y", "position.Z"});
    const Image motion = later.image({"motion.X", "motion.Y"});
    int surfaces = 0;
    for (int i = 0; i < kWidth * kHeight; ++i) {
        if (later.find("Z")->values[std::size_t(i)] >= 1e9f) continue;
        ++surfaces;
        const float* const p = position.at(i % kWidth, i / kWidth);
        const dvec3 point(p[0], p[1], p[2]);
        dvec2 way = place(later, point) - place(earlier, point);
        way.x -= kWidth * std::round(way.x / kWidth);
        EXPECT_NEAR(motion.at(i % kWidth, i / kWidth)[0], way.x, 2e-3) << i;
        EXPECT_NEAR(motion.at(i % kWidth, i / kWidth)[1], way.y, 2e-3) << i;
    }
    EXPECT_GT(surfaces, 64);
}

TEST_F(Sequence, FramesHaveTheSameLightGroups) {
    scene = write_sliding_light(folder.path);
    make("groups", "0-1",
         {"--animation", "slide", "--camera", "still", "--light-group", "each", "--env", "0.2,0.2,0.2"});
    const ExrFile first = read_exr(file("groups", 0)), second = read_exr(file("groups", 1));
    const auto names = [](const ExrFile& exr) {
        Strings all;
        for (const auto& channel : exr.channels) all.push_back(channel.name);
        return all;
    };
    EXPECT_EQ(names(first), names(second));
    const auto* const sky = second.find("light_environment.R");
    ASSERT_TRUE(sky);
    EXPECT_FLOAT_EQ(sky->values.at(0), 0.2f) << "a corner, which the light does not cover";
}

TEST_F(Sequence, StatisticsReportDeformation) {
    const auto deformed = [&](const char* into, const Strings& more) {
        Strings all = {"--stats", folder / into / "stats.jsonl"};
        all.insert(all.end(), more.begin(), more.end());
        make(into, "1-2", all);
        std::vector<Json> found;
        std::istringstream lines(read_text(folder / into / "stats.jsonl"));
        for (std::string line; std::getline(lines, line);) found.push_back(Json::parse(line).at("deformed"));
        return found;
    };
    // Two boxes with eight vertices each are deformed. Frame 1 also needs the reference pose.
    const std::vector<Json> all = deformed("all", {});
    ASSERT_EQ(all.size(), 2u);
    EXPECT_EQ(all[0].at("vertices"), 32);
    EXPECT_EQ(all[1].at("vertices"), 16);
    EXPECT_EQ(all[1].at("vertices_on_cpu"), 0);
    EXPECT_GT(all[1].at("seconds"), 0);
    EXPECT_EQ(deformed("motion", {"--aov", "motion"}).at(1).at("vertices"), 32) << "and the frame before";
    EXPECT_EQ(deformed("turn", {"--animation", "turn"}), std::vector<Json>(2, Json())) << "none deforms";
    EXPECT_EQ(deformed("fly", {"--animation", "fly"}), std::vector<Json>(2, Json())) << "a camera alone";
}

TEST_F(Sequence, OnlyTheCameraMoves) {
    const Strings fly = {"--animation", "fly", "--camera", "moving"};
    make("whole", "0-6", fly);
    make("chunks", "3-6", fly);
    make("chunks", "0-2", fly);
    EXPECT_TRUE(contents("chunks") == contents("whole")) << "what was learned of visibility shows";
    const ExrFile first = read_exr(file("whole", 0)), last = read_exr(file("whole", 6));
    // The origin of camera space is (-1, 1, 6) at frame 0 and a quarter of the way further at frame 6.
    EXPECT_NEAR(glm::length(dvec3(*first.attributes.world_to_camera * dvec4(-1, 1, 6, 1))), 0, 1e-5);
    EXPECT_NEAR(glm::length(dvec3(*last.attributes.world_to_camera * dvec4(-0.5, 1.125, 5.75, 1))), 0, 1e-5);
    const dvec4 ahead = *last.attributes.world_to_clip * dvec4(-0.5, 1.125, 0, 1);
    EXPECT_NEAR(ahead.x / ahead.w, 0, 1e-5);
}

/// At 0 s the light's edges are between pixels and need no extra samples; later they do.
TEST_F(Sequence, APilotCoversAllFrames) {
    scene = write_sliding_light(folder.path);
    const Strings open = {"--animation", "pan", "--camera", "panning", "--estimator", "auto"};
    make("whole", "0,13", open);
    for (const char* frame : {"13", "0"}) make("alone", frame, open);
    EXPECT_TRUE(contents("alone") == contents("whole")) << "a frame has its own pilot";
}

TEST_F(Sequence, HeaderContainsTheFrame) {
    const Outcome one = make("out", "49", {"--fps", "24"});
    EXPECT_NE(one.err.find(": 1 frame in "), std::string::npos) << one.err;
    const ExrAttributes whole = read_exr(file("out", 49)).attributes;
    EXPECT_EQ(whole.frame_rate, (FrameRate{24, 1}));
    EXPECT_EQ(whole.time_code, (TimeCode{0, 0, 2, 1}));
    EXPECT_EQ(whole.capture_date, "");
    make("ntsc", "49", {"--fps", "23.976"});
    const ExrAttributes ntsc = read_exr(file("ntsc", 49)).attributes;
    EXPECT_EQ(ntsc.frame_rate, (FrameRate{24000, 1001}));
    EXPECT_EQ(ntsc.time_code, (TimeCode{0, 0, 2, 1})) << "counted as 24";
}

TEST_F(Sequence, TheScenesFrameRateIsTheDefault) {
    scene = write_sliding_light(folder.path, 29.97);
    const Strings slide = {"--animation", "slide", "--camera", "still"};
    const auto with = [&](const char* fps) {
        Strings all = slide;
        all.insert(all.end(), {"--fps", fps});
        return all;
    };
    EXPECT_NE(make("out", "15", slide).err.find("halflight: 30000/1001 frames per second, as the scene's extras say"),
              std::string::npos);
    EXPECT_EQ(read_exr(file("out", 15)).attributes.frame_rate, (FrameRate{30000, 1001}));
    const Outcome same = make("out", "15", with("30000/1001"));
    EXPECT_EQ(same.err, "halflight: 1 of 1 frames are there already\n") << "the same fingerprint";
    write_text(folder / "eyes.json", R"({"halflight_settings": 1, "eye-distance": 0.1, "fisheye-fov": 90})");
    Strings eyes = with("30000/1001");
    eyes.insert(eyes.end(), {"--settings", folder / "eyes.json"});
    EXPECT_EQ(make("out", "15", eyes).err, same.err) << "no pixel depends on the eyes";
    EXPECT_NE(run("out", "15", with("24")).status, 0) << "another one";
    make("given", "15", with("24"));
    EXPECT_EQ(read_exr(file("given", 15)).attributes.frame_rate, (FrameRate{24, 1}));
    EXPECT_FALSE(same_pixels(file("given", 15), file("out", 15))) << "at another time";
    EXPECT_NE(run_program({"info", scene}).out.find("frames_per_second                29.97\n"), std::string::npos);
}

TEST_F(Sequence, WholeFramesOfTheSameSettingsAreKept) {
    EXPECT_NE(make("out", "1-3").err.find(": 3 frames in "), std::string::npos);
    const auto before = contents("out");
    const auto time = fs::last_write_time(file("out", 2));
    EXPECT_EQ(make("out", "1-3").err, "halflight: 3 of 3 frames are there already\n");
    EXPECT_EQ(fs::last_write_time(file("out", 2)), time);

    // The files are truncated in the pixels, in the header, and to nothing.
    const std::string second = before.at("f.0002.exr");
    for (const std::size_t length : {second.size() - 100, second.size() / 2, std::size_t{40}, std::size_t{0}}) {
        write_text(file("out", 2), second.substr(0, length));
        const Outcome mended = make("out", "1-3");
        EXPECT_NE(mended.err.find("damaged and made again: frames 2\n"), std::string::npos) << mended.err;
        EXPECT_TRUE(contents("out") == before) << length;
    }
}

TEST_F(Sequence, InPartsAndChecked) {
    const Outcome none = run("a", "1-5", {"--check"});
    EXPECT_EQ(none.status, 1);
    EXPECT_NE(none.err.find("frames 1-5 (5 of 5): missing, damaged, or of another scene or other settings"),
              std::string::npos)
        << none.err;
    for (const char* part : {"2/3", "1/3", "3/3"}) make("a", "1-5", {"--part", part});
    EXPECT_NE(make("a", "1-5", {"--check"}).err.find("all 5 frames are whole"), std::string::npos);
    EXPECT_NE(make("a", "1-5", {"--part", "2/9"}).err.find("1 of 1 frames are there already"), std::string::npos);
    EXPECT_NE(make("a", "1-5", {"--part", "1/9"}).err.find("fewer frames than parts"), std::string::npos);
    EXPECT_EQ(contents("a").size(), 5u);
    make("b", "1-5");
    EXPECT_EQ(contents("a"), contents("b"));

    fs::resize_file(file("a", 2), fs::file_size(file("a", 2)) - 1);
    fs::remove(file("a", 4));
    const auto before = contents("a");
    EXPECT_NE(run("a", "1-5", {"--check"}).err.find("frames 2,4 (2 of 5)"), std::string::npos);
    EXPECT_NE(run("a", "1-5", {"--check", "--seed", "2"}).err.find("frames 1-5 (5 of 5)"), std::string::npos);
    EXPECT_NE(run("a", "1-5", {"--check", "--part", "2/3"}).err.find("frame 2 (1 of part 2/3): missing"),
              std::string::npos);
    EXPECT_EQ(contents("a"), before);

    // Other programs keep attributes when they resize a picture or remove layers.
    const ExrFile third = read_exr(file("a", 3));
    const Image picture = third.image({"R", "G", "B"});
    write_exr(file("a", 3), {{{"R", "G", "B"}, picture}}, third.attributes);
    EXPECT_NE(run("a", "1-5", {"--check"}).err.find("frames 2-4 (3 of 5)"), std::string::npos);
    EXPECT_EQ(run("a", "1-5", {"--check", "--overwrite"}).status, 2);
    EXPECT_EQ(run("a", "1-5", {"--part", "4/3"}).status, 2);
}

TEST_F(Sequence, FramesOfOtherSettingsAreAnError) {
    make("out", "1-3");
    const auto before = contents("out");
    const auto refused = [&](const std::string& what, const Strings& more) {
        const Outcome outcome = run("out", "3-4", more);
        EXPECT_EQ(outcome.status, 1) << what;
        EXPECT_TRUE(std::regex_match(last_line(outcome), std::regex("halflight: .*f.0003.exr: exists, but is not .*")))
            << what << ": " << outcome.err;
        EXPECT_TRUE(contents("out") == before) << what;
    };
    refused("samples", {"--seed", "1"});
    refused("time", {"--fps", "25"});
    refused("light", {"--env", "1,1,1"});
    refused("camera", {"--camera", "moving"});
    refused("animation", {"--animation", "turn"});
    refused("layers", {"--aov", "depth"});
    write_text(scene, read_text(scene) + " ");
    refused("scene", {});
    const Outcome replaced = make("out", "3-4", {"--overwrite"});
    EXPECT_EQ(contents("out").at("f.0002.exr"), before.at("f.0002.exr"));
    EXPECT_NE(contents("out").at("f.0003.exr"), before.at("f.0003.exr")) << "by its fingerprint";

    write_text(file("out", 5), "a letter");
    EXPECT_EQ(run("out", "5").status, 1);
    EXPECT_EQ(read_text(file("out", 5)), "a letter");
    // A frame is not kept under the name of another frame.
    fs::copy_file(file("out", 3), file("out", 6));
    EXPECT_EQ(run("out", "6").status, 1);
}

TEST_F(Sequence, TracingMethodsDoNotChangeTheFingerprint) {
    make("out", "1", {"--culling", "off"});
    EXPECT_EQ(make("out", "1", {"--culling", "compute", "--stats", folder / "s.json"}).err,
              "halflight: 1 of 1 frames are there already\n");
}

TEST_F(Sequence, WritesPngsToo) {
    const Strings arguments = {"render",    scene, folder / "f.##.exr", folder / "f.%d.png",
                               "--frames",  "1-2", "--width",           "16",
                               "--samples", "1"};
    ASSERT_EQ(run_program(arguments).status, 0);
    for (const char* name : {"f.01.exr", "f.02.exr", "f.1.png", "f.2.png"}) EXPECT_TRUE(fs::exists(folder / name));
    EXPECT_EQ(run_program(arguments).err, "halflight: 2 of 2 frames are there already\n");
    const std::string png = read_text(folder / "f.2.png");
    write_text(folder / "f.2.png", png.substr(0, png.size() - 20));
    EXPECT_EQ(run_program(arguments).status, 0);
    EXPECT_EQ(read_text(folder / "f.2.png"), png);
}

TEST_F(Sequence, AnimationsByNameAndNumber) {
    make("all", "6");
    make("name", "6", {"--animation", "turn"});
    make("number", "6", {"--animation", "2"});
    make("none", "6", {"--animation", "none"});
    EXPECT_TRUE(same_pixels(file("name", 6), file("number", 6)));
    EXPECT_FALSE(same_pixels(file("name", 6), file("none", 6)));
    EXPECT_FALSE(same_pixels(file("name", 6), file("all", 6)));
    const Outcome unknown = run("all", "7", {"--animation", "swim"});
    EXPECT_EQ(unknown.status, 1);
    EXPECT_TRUE(std::regex_match(
        unknown.err,
        std::regex(".*animated.glb: no animation 'swim': its animations: 0 'bend', 1 'breathe', 2 'turn', 3 'fly'\n")))
        << unknown.err;
}

TEST_F(Sequence, DamagedAnimationsAreAnErrorWhereTheyArePlayed) {
    scene = copy_room(folder.path);
    std::string text = read_text(scene);
    write_text(scene, text.insert(text.find('{') + 1, R"("animations": [{"samplers": []}],)"));
    const Outcome played = run("out", "1");
    EXPECT_EQ(played.status, 1);
    EXPECT_TRUE(std::regex_match(played.err, std::regex("halflight: .*room.gltf: animations.0.: has no 'channels'\n")))
        << played.err;
    make("out", "1", {"--animation", "none"});
    // The other animations of the file can play.
    const std::string good = R"({"name": "still", "channels": [], "samplers": []})";
    write_text(scene, text.replace(text.find(R"({"samplers": []})"), 0, good + ","));
    EXPECT_EQ(run("out", "1").status, 1);
    make("still", "1", {"--animation", "still"});
    const Outcome damaged = run("still", "1", {"--animation", "1"});
    EXPECT_EQ(damaged.status, 1);
    EXPECT_NE(damaged.err.find("room.gltf: animations[1]: has no 'channels'\n"), std::string::npos) << damaged.err;
    const Outcome info = run_program({"info", scene, "--json"});
    EXPECT_EQ(info.status, 0) << info.err;
    EXPECT_NE(Json::parse(info.out).at("warnings").dump().find("has no 'channels'"), std::string::npos) << info.out;
}

TEST_F(Sequence, ValuesThatAnAnimationDrivesOutOfRangeAreReported) {
    // The intensity of a lamp goes from 1 at 0 s to -1 at 1 s.
    scene = folder / "lamp.gltf";
    write_text(scene,
               R"({"asset": {"version": "2.0"}, "extensionsUsed": ["KHR_lights_punctual", "KHR_animation_pointer"],
        "extensions": {"KHR_lights_punctual": {"lights": [{"type": "point"}]}},
        "nodes": [{"extensions": {"KHR_lights_punctual": {"light": 0}}}],
        "buffers": [{"byteLength": 16, "uri": "data:;base64,AAAAAAAAgD8AAIA/AACAvw=="}],
        "bufferViews": [{"buffer": 0, "byteLength": 8}, {"buffer": 0, "byteOffset": 8, "byteLength": 8}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 2, "type": "SCALAR", "min": [0], "max": [1]},
                      {"bufferView": 1, "componentType": 5126, "count": 2, "type": "SCALAR"}],
        "animations": [{"samplers": [{"input": 0, "output": 1}], "channels": [{"sampler": 0, "target": {
            "path": "pointer", "extensions": {"KHR_animation_pointer": {
                "pointer": "/extensions/KHR_lights_punctual/lights/0/intensity"}}}}]}]})");
    const std::string warning = "lights[0]: light intensity is negative or too large, clamped\n";
    const auto count = [&](const std::string& text) {
        std::size_t found = 0;
        for (std::size_t at = 0; (at = text.find(warning, at)) != std::string::npos; ++at) ++found;
        return found;
    };
    EXPECT_EQ(count(make("out", "1-12").err), 0u);
    EXPECT_EQ(count(make("out", "13-24").err), 1u) << "told once";
    const Outcome still = run_program({"render", scene, folder / "still.exr", "--animation", "all", "--frame", "24",
                                       "--width", "8", "--height", "8", "--samples", "1"});
    EXPECT_EQ(still.status, 0) << still.err;
    EXPECT_EQ(count(still.err), 1u) << still.err;
}

TEST_F(Sequence, InvalidNames) {
    const auto refused = [&](const Strings& outputs, const Strings& more, const std::string& message) {
        Strings arguments = {"render", scene};
        for (const std::string& output : outputs) arguments.push_back(folder / output);
        arguments.insert(arguments.end(), more.begin(), more.end());
        const Outcome outcome = run_program(arguments);
        EXPECT_EQ(outcome.status, 2) << message;
        EXPECT_TRUE(std::regex_match(outcome.err, std::regex("halflight: " + message + "\n"))) << outcome.err;
    };
    const Strings frames = {"--frames", "1-2"};
    refused({"f.exr"}, frames, ".*f.exr: has no placeholder for the frame number, .*");
    refused({"f.#.exr", "f.png"}, frames, ".*f.png: has no placeholder .*");
    refused({"f.##.exr"}, {}, ".*f.##.exr: has a placeholder .* but --frames is missing");
    refused({"f.%04d.exr"}, {"--frame", "3"}, ".*f.%04d.exr: has a placeholder .*");
    refused({"f.#.%d.exr"}, frames, ".*: has 2 placeholders for the frame number");
    refused({"f.#.exr", "f.%d.exr"}, frames, ".*f.1.exr: is given twice as output");
    refused({"animated.glb#.exr"}, {"--frames", "2-1"}, "--frames: '2-1' ends before it begins");
    refused({"f.#.exr"}, {"--frames", "1-2", "--frame", "1"}, "--frames: cannot be given together with --frame");
    refused({"f.exr"}, {"--overwrite"}, "--overwrite: needs --frames, --checkpoint or --part");
    refused({"f.exr"}, {"--fps", "24"}, "--fps: needs --frames or --animation");
    for (const char* fps : {"0", "-1", "nan", "24/0", "1e3", "24/1.5", "2000000"})
        refused({"f.#.exr"}, {"--frames", "1", "--fps", fps}, "--fps: expects .* not '.*'");
    fs::create_symlink(scene, folder / "f.2.exr");
    refused({"f.#.exr"}, frames, ".*f.2.exr: is both input and output");
}

TEST_F(Sequence, InfoListsAnimations) {
    const Outcome json = run_program({"info", scene, "--json"});
    ASSERT_EQ(json.status, 0) << json.err;
    const Json facts = Json::parse(json.out);
    ASSERT_EQ(facts.at("animations").size(), 4u);
    EXPECT_EQ(facts["animations"][0], (Json{{"name", "bend"}, {"seconds", 1.0}, {"channels", 1}}));
    EXPECT_TRUE(facts.at("frames_per_second").is_null());
    EXPECT_EQ(facts.at("skins").at(0).at("joints"), 2);
    EXPECT_EQ(facts.at("morph_targets").at(0).at("targets"), 1);
    EXPECT_NE(run_program({"info", scene}).out.find("breathe"), std::string::npos);
    scene = copy_room(folder.path);
    EXPECT_EQ(Json::parse(run_program({"info", scene, "--json"}).out).at("animations").size(), 0u);
}

}  // namespace
}  // namespace halflight::test
