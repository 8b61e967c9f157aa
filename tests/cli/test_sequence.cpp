// Tests sequences: frames do not depend on how they are rendered, and finished frames are kept.
#include <signal.h>
#include <unistd.h>

#include <array>
#include <regex>

#include "tests/cli/sequence_test.h"

namespace halflight::test {
namespace {

using Json = nlohmann::json;

TEST_F(Sequence, FramesDoNotDependOnTheRun) {
    const Strings all = words("--animation all --camera moving --aov depth,motion,ids");
    make("whole", "1-12", all);
    const auto whole = contents("whole");
    ASSERT_EQ(whole.size(), 12u);
    EXPECT_FALSE(same_pixels(file("whole", 1), file("whole", 12))) << "nothing moves";

    for (const char* chunk : {"1-4", "5-8", "9-12"}) make("chunks", chunk, all);
    EXPECT_TRUE(contents("chunks") == whole) << "in chunks";
    make("backwards", "12,11,10,9,8,7,6,5,4,3,2,1", all);
    EXPECT_TRUE(contents("backwards") == whole) << "backwards";
    for (const char* threads : {"1", "2"}) {
        make(threads, "1-12x5", all, {.environment = {std::string("LP_NUM_THREADS=") + threads}});
        for (const auto& [name, bytes] : contents(threads)) EXPECT_EQ(bytes, whole.at(name)) << threads << " threads";
    }
    RunOptions killed;
    killed.watch = [](pid_t child, const std::string& err) {
        if (has(err, "frame 3 written")) kill(child, SIGKILL);
    };
    EXPECT_EQ(run("killed", "1-12", all, killed).status, 128 + SIGKILL);
    expect_has(make("killed", "1-12", all).err, " of 12 frames are there already");
    EXPECT_TRUE(contents("killed") == whole) << "killed and resumed";

    // Renders one frame as a single picture.
    done(words("render", scene, file("alone.exr"), "--frame 12 --width 16 --height 16 --samples 2", all));
    EXPECT_TRUE(same_pixels(file("alone.exr"), file("whole", 12))) << "alone";
}

TEST_F(Sequence, StatisticsReportHierarchyUpdates) {
    // Floor and lamp are static and share a hierarchy. Three boxes move. Frame 0 is the reference pose.
    using Counts = std::vector<std::array<int, 3>>;
    const auto counts = [&](const std::string& animation, const std::string& frames) {
        make("f-" + animation, frames, words("--camera moving --animation", animation, "--stats", file(animation)));
        Counts found;
        for (const Json& line : json_lines(read_text(file(animation)))) {
            const Json& h = line.at("hierarchies");
            found.push_back({h.at("kept"), h.at("refitted"), h.at("built")});
        }
        return found;
    };
    EXPECT_EQ(counts("all", "0-2,24"), (Counts{{0, 0, 4}, {1, 3, 0}, {1, 3, 0}, {1, 3, 0}}));
    EXPECT_EQ(counts("fly", "0-2"), (Counts{{0, 0, 1}, {1, 0, 0}, {1, 0, 0}})) << "a camera alone";
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
    const Strings layers = words("--animation all --aov position,motion");
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
    done(words("render", scene, folder / "a" / "f.####.exr", "--frames 0-1 --samples 1 --animation fly --camera moving",
               "--projection panorama --aov position,motion,depth --width", std::to_string(kWidth)));
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
    make("groups", "0-1", words("--animation slide --camera still --light-group each --env 0.2,0.2,0.2"));
    const ExrFile first = read_exr(file("groups", 0)), second = read_exr(file("groups", 1));
    EXPECT_EQ(channel_names(first), channel_names(second));
    const auto* const sky = second.find("light_environment.R");
    ASSERT_TRUE(sky);
    EXPECT_FLOAT_EQ(sky->values.at(0), 0.2f) << "a corner, which the light does not cover";
}

TEST_F(Sequence, StatisticsReportDeformation) {
    const auto deformed = [&](const char* into, const char* more) {
        make(into, "1-2", words(more, "--stats", folder / into / "stats.jsonl"));
        std::vector<Json> found;
        for (const Json& line : json_lines(read_text(folder / into / "stats.jsonl")))
            found.push_back(line.at("deformed"));
        return found;
    };
    // Two boxes with eight vertices each are deformed. Frame 1 also needs the reference pose.
    const std::vector<Json> all = deformed("all", "");
    ASSERT_EQ(all.size(), 2u);
    EXPECT_EQ(all[0].at("vertices"), 32);
    EXPECT_EQ(all[1].at("vertices"), 16);
    EXPECT_EQ(all[1].at("vertices_on_cpu"), 0);
    EXPECT_GT(all[1].at("seconds"), 0);
    EXPECT_EQ(deformed("motion", "--aov motion").at(1).at("vertices"), 32) << "and the frame before";
    EXPECT_EQ(deformed("turn", "--animation turn"), std::vector<Json>(2, Json())) << "none deforms";
    EXPECT_EQ(deformed("fly", "--animation fly"), std::vector<Json>(2, Json())) << "a camera alone";
}

TEST_F(Sequence, OnlyTheCameraMoves) {
    const Strings fly = words("--animation fly --camera moving");
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
    const Strings open = words("--animation pan --camera panning --estimator auto");
    make("whole", "0,13", open);
    for (const char* frame : {"13", "0"}) make("alone", frame, open);
    EXPECT_TRUE(contents("alone") == contents("whole")) << "a frame has its own pilot";
}

TEST_F(Sequence, HeaderContainsTheFrame) {
    for (const auto& [fps, rate] : {std::pair("24", FrameRate{24, 1}), {"23.976", FrameRate{24000, 1001}}}) {
        make(fps, "49", {"--fps", fps});
        const ExrAttributes whole = read_exr(file(fps, 49)).attributes;
        EXPECT_EQ(whole.frame_rate, rate);
        EXPECT_EQ(whole.time_code, (TimeCode{0, 0, 2, 1})) << "both are counted as 24";
        EXPECT_EQ(whole.capture_date, "");
    }
}

const char* const kOneThere = "halflight: 1 of 1 frames are there already\n";

TEST_F(Sequence, TheScenesFrameRateIsTheDefault) {
    scene = write_sliding_light(folder.path, 29.97);
    const Strings slide = words("--animation slide --camera still");
    expect_has(make("out", "15", slide).err, "30000/1001 frames per second");
    EXPECT_EQ(read_exr(file("out", 15)).attributes.frame_rate, (FrameRate{30000, 1001}));
    EXPECT_EQ(make("out", "15", words(slide, "--fps 30000/1001")).err, kOneThere) << "the same fingerprint";
    write_text(file("eyes.json"), R"({"halflight_settings": 1, "eye-distance": 0.1, "fisheye-fov": 90})");
    EXPECT_EQ(make("out", "15", words(slide, "--fps 30000/1001 --settings", file("eyes.json"))).err, kOneThere)
        << "no pixel depends on the eyes";
    EXPECT_NE(run("out", "15", words(slide, "--fps 24")).status, 0) << "another one";
    make("given", "15", words(slide, "--fps 24"));
    EXPECT_EQ(read_exr(file("given", 15)).attributes.frame_rate, (FrameRate{24, 1}));
    EXPECT_FALSE(same_pixels(file("given", 15), file("out", 15))) << "at another time";
    expect_has(done({"info", scene}).out, " 29.97\n");
}

TEST_F(Sequence, WholeFramesOfTheSameSettingsAreKept) {
    expect_has(make("out", "1-3").err, ": 3 frames in ");
    const auto before = contents("out");
    const auto time = fs::last_write_time(file("out", 2));
    EXPECT_EQ(make("out", "1-3").err, "halflight: 3 of 3 frames are there already\n");
    EXPECT_EQ(fs::last_write_time(file("out", 2)), time);

    // The files are truncated in the pixels, in the header, and to nothing.
    const std::string second = before.at("f.0002.exr");
    for (const std::size_t length : {second.size() - 100, second.size() / 2, std::size_t{40}, std::size_t{0}}) {
        write_text(file("out", 2), second.substr(0, length));
        const Outcome mended = make("out", "1-3");
        expect_has(mended.err, "damaged and made again: frames 2\n");
        EXPECT_TRUE(contents("out") == before) << length;
    }
}

TEST_F(Sequence, InPartsAndChecked) {
    const Outcome none = run("a", "1-5", {"--check"});
    EXPECT_EQ(none.status, 1);
    expect_has(none.err, "frames 1-5 (5 of 5)");
    for (const char* part : {"2/3", "1/3", "3/3"}) make("a", "1-5", {"--part", part});
    expect_has(make("a", "1-5", {"--check"}).err, "all 5 frames are whole");
    expect_has(make("a", "1-5", {"--part", "2/9"}).err, "1 of 1 frames are there already");
    expect_has(make("a", "1-5", {"--part", "1/9"}).err, "fewer frames than parts");
    EXPECT_EQ(contents("a").size(), 5u);
    make("b", "1-5");
    EXPECT_EQ(contents("a"), contents("b"));

    fs::resize_file(file("a", 2), fs::file_size(file("a", 2)) - 1);
    fs::remove(file("a", 4));
    const auto before = contents("a");
    expect_has(run("a", "1-5", {"--check"}).err, "frames 2,4 (2 of 5)");
    expect_has(run("a", "1-5", {"--check", "--seed", "2"}).err, "frames 1-5 (5 of 5)");
    expect_has(run("a", "1-5", words("--check --part 2/3")).err, "frame 2 (1 of part 2/3)");
    EXPECT_EQ(contents("a"), before);

    // Other programs keep attributes when they resize a picture or remove layers.
    const ExrFile third = read_exr(file("a", 3));
    const Image picture = third.image({"R", "G", "B"});
    write_exr(file("a", 3), {{{"R", "G", "B"}, picture}}, third.attributes);
    expect_has(run("a", "1-5", {"--check"}).err, "frames 2-4 (3 of 5)");
}

TEST_F(Sequence, FramesOfOtherSettingsAreAnError) {
    make("out", "1-3");
    const auto before = contents("out");
    const std::pair<const char*, const char*> others[] = {{"--seed 1", ": seed is as usual, not 1."},
                                                          {"--fps 25", ": fps is 24/1, not 25/1."},
                                                          {"--env 1,1,1", ": environment differs."},
                                                          {"--camera moving", ": camera differs."},
                                                          {"--animation turn", ": animation is "},
                                                          {"--aov depth", ": aov is as usual, not depth."},
                                                          {"", ": scene differs."}};
    for (const auto& [more, difference] : others) {
        if (!*more) write_text(scene, read_text(scene) + " ");  // another scene
        const Outcome outcome = run("out", "3-4", words(more));
        EXPECT_EQ(outcome.status, 1) << more;
        expect_has(last_line(outcome), "f.0003.exr: exists");
        expect_has(last_line(outcome), difference);
        EXPECT_TRUE(contents("out") == before) << more;
    }
    make("out", "3-4", {"--overwrite"});
    EXPECT_EQ(contents("out").at("f.0002.exr"), before.at("f.0002.exr"));
    EXPECT_NE(contents("out").at("f.0003.exr"), before.at("f.0003.exr")) << "by its fingerprint";

    write_text(file("out", 5), "a letter");
    EXPECT_EQ(run("out", "5").status, 1);
    EXPECT_EQ(read_text(file("out", 5)), "a letter");
    // A frame is not kept under the name of another frame.
    fs::copy_file(file("out", 3), file("out", 6));
    EXPECT_EQ(run("out", "6").status, 1);
}

TEST_F(Sequence, ViewsForHdrDisplaysNeedPngs) {
    fs::create_directory(folder / "out");
    const Strings hdr = words("--display rec.2100-pq --view un-tone-mapped --quiet");
    for (const char* name : {"out/f.####.jpg", "out/f.####.tif"})
        refused(1, words(command("out", "1", hdr), "-o", folder / name), "is for an HDR display; .png and movies can");
    EXPECT_FALSE(fs::exists(file("out", 1))) << "nothing was rendered";
    make("out", "1", words(hdr, "-o", folder / "out/f.####.png"));
}

/// Returns the bytes of a file with other digits after "sources=".
std::string of_other_sources(std::string bytes, const std::string& digits) {
    const std::size_t at = bytes.find("sources=");
    return at == std::string::npos ? bytes : bytes.replace(at + 8, digits.size(), digits);
}

TEST_F(Sequence, FramesOfAcceptedSourcesAreKept) {
    const std::string old = "0123456789abcdef";
    const Strings views = words("-o", folder / "out/f.####.png", "-o", folder / "out/f.####.jpg");
    make("out", "1-2", views);
    for (const auto& [name, bytes] : contents("out")) {
        EXPECT_NE(bytes.find("sources="), std::string::npos) << name;
        if (!name.ends_with("png")) write_text(folder / "out" / name, of_other_sources(bytes, old));
    }
    const auto before = contents("out");
    expect_has(last_line(run("out", "1-3", views)), "f.0001.exr: exists");
    expect_has(last_line(run("out", "1-3", views)), ": sources is " + old + ", not ");
    EXPECT_EQ(run("out", "1-3", words(views, "--accept-sources fedcba9876543210")).status, 1);
    expect_has(last_line(run("out", "1-3", words(views, "--seed 1 --accept-sources", old))), "seed is as usual, not 1");
    expect_has(make("out", "1-3", words(views, "--accept-sources", old)).err, "2 of 3 frames are there already");
    for (const auto& [name, bytes] : before) EXPECT_TRUE(contents("out").at(name) == bytes) << name;
    EXPECT_EQ(run("out", "1-3", words(views, "--check --accept-sources", old)).status, 0);
    EXPECT_EQ(run("out", "1-3", words(views, "--check")).status, 1);
}

TEST_F(Sequence, TracingMethodsDoNotChangeTheFingerprint) {
    make("out", "1", {"--culling", "off"});
    EXPECT_EQ(make("out", "1", words("--culling compute --stats", file("s.json"))).err, kOneThere);
}

TEST_F(Sequence, WritesPngsToo) {
    const Strings arguments =
        words("render", scene, file("f.##.exr"), file("f.%d.png"), "--frames 1-2 --width 16 --samples 1");
    done(arguments);
    for (const char* name : {"f.01.exr", "f.02.exr", "f.1.png", "f.2.png"}) EXPECT_TRUE(fs::exists(folder / name));
    EXPECT_EQ(run_program(arguments).err, "halflight: 2 of 2 frames are there already\n");
    const std::string png = read_text(folder / "f.2.png");
    write_text(folder / "f.2.png", png.substr(0, png.size() - 20));
    done(arguments);
    EXPECT_EQ(read_text(folder / "f.2.png"), png);
}

TEST_F(Sequence, PicturesAreDevelopedFromWholeExrs) {
    for (const char* more : {"--aov depth --exr-parts", "--denoise --transparent", "--preview filter --stereo views"}) {
        const auto into = [&](const char* name, const char* exposure) {
            return words(command(name, "1-2", words(more, "--animation all --camera moving")), "-o",
                         folder / name / "f.####.png", "--exposure", exposure);
        };
        for (const char* name : {"at-once", "developed"}) fs::remove_all(folder / name);
        done(into("at-once", "1"));
        make("developed", "1-2", words(more, "--animation all --camera moving"));
        const auto time = fs::last_write_time(file("developed", 2));
        expect_has(done(into("developed", "1")).err, "2 frames are developed from their .exr, and not rendered");
        EXPECT_TRUE(contents("developed") == contents("at-once")) << more;
        EXPECT_EQ(done(into("developed", "1")).err, "halflight: 2 of 2 frames are there already\n");
        refused(1, words(into("developed", "2"), "--quiet"), "f.0001.png: exists");
        done(words(into("developed", "2"), "--overwrite"));
        done(words(into("at-once", "2"), "--overwrite --reproducible"));
        EXPECT_TRUE(contents("developed") == contents("at-once")) << more;
        EXPECT_EQ(fs::last_write_time(file("developed", 2)), time);
    }
    // Half floats round colours.
    const Strings png = words("-o", folder / "half" / "f.####.png");
    make("half", "1", {"--half"});
    refused(1, command("half", "1-2", words("--half --develop --quiet"), png),
            "f.####.exr: frame 2 (1 of 2): no complete .exr");
    make("half", "1", words("--half --develop", png));
    refused(1, command("half", "1", words("--half --quiet"), png), "f.0001.png: exists");
    EXPECT_FALSE(has(make("half", "1", words("--half --overwrite", png)).err, "developed"));
}

TEST_F(Sequence, FramesBeforeZero) {
    const Strings all = words("--animation all --camera moving --aov position");
    make("out", "-2-1", all);
    EXPECT_EQ(contents("out").size(), 4u);
    EXPECT_TRUE(fs::exists(folder / "out" / "f.-0002.exr"));
    expect_has(make("out", "-2--1,0-1", all).err, "4 of 4 frames are there already\n");
    EXPECT_EQ(read_exr(folder / "out" / "f.-0001.exr").attributes.time_code, (TimeCode{23, 59, 59, 23}));
    make("early", "-9", words(all, "--frame-offset -10"));
    done(words("render", scene, file("alone.exr"), "--frame -9 --frame-offset -10 --width 16 --height 16 --samples 2",
               all));
    EXPECT_TRUE(same_pixels(file("alone.exr"), folder / "early" / "f.-0009.exr"));
    const ExrFile early = read_exr(file("alone.exr")), first = read_exr(file("out", 1));
    EXPECT_TRUE(same_values(*early.find("position.X"), *first.find("position.X"))) << "at the same time";
    EXPECT_FALSE(same_pixels(file("alone.exr"), file("out", 1))) << "with the same noise";
}

TEST_F(Sequence, AnimationsByNameAndNumber) {
    make("all", "6");
    make("name", "6", {"--animation", "turn"});
    make("number", "6", {"--animation", "2"});
    make("none", "6", {"--animation", "none"});
    EXPECT_TRUE(same_pixels(file("name", 6), file("number", 6)));
    EXPECT_FALSE(same_pixels(file("name", 6), file("none", 6)));
    EXPECT_FALSE(same_pixels(file("name", 6), file("all", 6)));
    refused(1, command("all", "7", "--animation swim --quiet"), "animated.glb: no animation 'swim'");
}

TEST_F(Sequence, DamagedAnimationsAreAnErrorWhereTheyArePlayed) {
    scene = copy_room(folder.path);
    std::string text = read_text(scene);
    write_text(scene, text.insert(text.find('{') + 1, R"("animations": [{"samplers": []}],)"));
    make("out", "1", {"--animation", "none"});
    refused(1, command("out", "2", "--quiet"), "room.gltf: animations[0]");
    // The other animations of the file can play.
    const std::string good = R"({"name": "still", "channels": [], "samplers": []})";
    write_text(scene, text.replace(text.find(R"({"samplers": []})"), 0, good + ","));
    EXPECT_EQ(run("out", "1").status, 1);
    make("still", "1", {"--animation", "still"});
    refused(1, command("still", "2", "--animation 1 --quiet"), "room.gltf: animations[1]");
    expect_has(Json::parse(done({"info", scene, "--json"}).out).at("warnings").dump(), "animations[1]");
}

TEST_F(Sequence, ValuesThatAnAnimationDrivesOutOfRangeAreReported) {
    // The intensity of a lamp goes from 1 at 0 s to -1 at 1 s.
    GltfBuilder b;
    b.json["extensionsUsed"] = {"KHR_lights_punctual"};
    b.json["extensions"]["KHR_lights_punctual"]["lights"] = {{{"type", "point"}}};
    b.push("nodes", {{"extensions", {{"KHR_lights_punctual", {{"light", 0}}}}}});
    animate_pointer(b, "/extensions/KHR_lights_punctual/lights/0/intensity", "SCALAR", {1, -1});
    scene = file("lamp.glb");
    write_text(scene, b.glb());
    const std::string warning = "lights[0]: ";
    const auto count = [&](const std::string& text) {
        std::size_t found = 0;
        for (std::size_t at = 0; (at = text.find(warning, at)) != std::string::npos; ++at) ++found;
        return found;
    };
    EXPECT_EQ(count(make("out", "1-12").err), 0u);
    EXPECT_EQ(count(make("out", "13-24").err), 1u) << "told once";
    const Outcome still = done(
        words("render", scene, file("still.exr"), "--animation all --frame 24 --width 8", "--height 8 --samples 1"));
    EXPECT_EQ(count(still.err), 1u) << still.err;
}

TEST_F(Sequence, InfoListsAnimations) {
    const auto info = [&] { return Json::parse(done({"info", scene, "--json"}).out); };
    const Json facts = info();
    ASSERT_EQ(facts.at("animations").size(), 4u);
    EXPECT_EQ(facts["animations"][0], (Json{{"name", "bend"}, {"seconds", 1.0}, {"channels", 1}}));
    EXPECT_TRUE(facts.at("frames_per_second").is_null());
    EXPECT_EQ(facts.at("skins").at(0).at("joints"), 2);
    EXPECT_EQ(facts.at("morph_targets").at(0).at("targets"), 1);
    expect_has(done({"info", scene}).out, "breathe");
    scene = copy_room(folder.path);
    EXPECT_EQ(info().at("animations").size(), 0u);
}

}  // namespace
}  // namespace halflight::test
