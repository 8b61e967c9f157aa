// Tests page files of animated scenes: pictures and sequences equal those of the scene in memory.
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "tests/cli/animated_scenes.h"
#include "tests/cli/pack_test.h"

namespace halflight::test {
namespace {

TEST_F(Pack, AnimatedScenesEqualThoseInMemory) {
    const std::string scene = write_animated_scene(std::filesystem::path(file("a")).parent_path());
    ASSERT_EQ(pack(scene, file("a.pages"), {"--quiet"}).status, 0);
    EXPECT_EQ(Json::parse(run_program({"info", file("a.pages"), "--json"}).out).at("triangles"), 24)
        << "pages hold the floor and the lamp";
    const auto render = [&](const std::string& output, const Strings& more) {
        Strings arguments = {"render",    scene,    file(output),
                             "--width",   "48",     "--samples",
                             "4",         "--aov",  "ids,depth,normal,motion,albedo,cryptoobject",
                             "--primary", "traced", "--reproducible",
                             "--quiet"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        const Outcome outcome = run_program(arguments);
        EXPECT_EQ(outcome.status, 0) << outcome.err;
    };
    const auto single = [&](const std::string& animation, const std::string& frame, const Strings& more) {
        Strings arguments = {"--frame", frame};
        if (!animation.empty()) arguments.insert(arguments.end(), {"--animation", animation, "--fps", "4"});
        arguments.insert(arguments.end(), more.begin(), more.end());
        render("single.exr", arguments);
        return read_text(file("single.exr"));
    };
    const Strings paged = {"--pages", file("a.pages"), "--page-pool", "1M"};
    std::string last;
    for (const char* frame : {"0", "1", "3"}) {
        const std::string core = single("all", frame, {});
        EXPECT_TRUE(core != last) << "frame " << frame << " shows no motion";
        EXPECT_TRUE(single("all", frame, paged) == core) << frame;
        last = core;
    }
    // Parts that may move are out of the pages, whether they do or not.
    EXPECT_TRUE(single("", "0", paged) == single("", "0", {})) << "at rest";
    EXPECT_TRUE(single("breathe", "2", paged) == single("breathe", "2", {})) << "one of the animations";
    EXPECT_TRUE(single("all", "2", {"--shutter", "1", "--pages", file("a.pages")}) ==
                single("all", "2", {"--shutter", "1"}))
        << "motion blur";

    // A frame is the same in a sequence, alone, and whatever the size of the pool.
    const auto sequence = [&](const std::string& name, const std::string& frames, const std::string& pool) {
        render(name + ".#.exr", {"--frames", frames, "--fps", "4", "--pages", file("a.pages"), "--page-pool", pool});
    };
    sequence("all", "0-3", "64M");
    sequence("two", "3,1", "1M");
    for (const char* frame : {"1", "3"})
        EXPECT_TRUE(read_text(file(std::string("all.") + frame + ".exr")) ==
                    read_text(file(std::string("two.") + frame + ".exr")))
            << frame;
}

/// Surfaces that have no area at rest, whole boxes or their sides alone, have their materials when they appear.
TEST_F(Pack, SurfacesThatAppearEqualThoseInMemory) {
    for (const vec3& rest : {vec3(0), vec3(1, 0, 1)}) {
        std::filesystem::remove(file("a.pages"));
        std::filesystem::remove(file("blinking.glb"));
        const std::string scene = write_blinking_scene(folder.path, {rest, vec3(1), vec3(0.5f)});
        ASSERT_EQ(pack(scene, file("a.pages"), {"--quiet"}).status, 0);
        const Strings view = {"--width",     "32",    "--samples", "2",     "--fps", "1",
                              "--look-from", "2,3,5", "--look-at", "0,1,0", "--aov", "albedo,ids,cryptomaterial"};
        std::string last;
        for (const char* frame : {"0", "1", "2"}) {
            Strings at = {"--frame", frame, "--animation", "blink"};
            ASSERT_EQ(render(scene, "core.exr", view, at).status, 0);
            const std::string core = read_text(file("core.exr"));
            EXPECT_TRUE(core != last) << frame;
            at.insert(at.end(), {"--pages", file("a.pages")});
            const Outcome paged = render(scene, "paged.exr", view, at);
            ASSERT_EQ(paged.status, 0) << paged.err;
            EXPECT_TRUE(read_text(file("paged.exr")) == core) << frame;
            last = core;
        }
    }
}

TEST_F(Pack, AssetsWithSkinsAndMorphTargetsPlay) {
    const std::filesystem::path assets = HALFLIGHT_SHARED_DIR "/assets/animation";
    if (!std::filesystem::exists(assets)) GTEST_SKIP() << "../shared/assets is not there";
    for (const char* name : {"Fox.glb", "MorphStressTest.gltf", "SimpleSkin/SimpleSkin.gltf"}) {
        const std::string scene = assets / name;
        ASSERT_EQ(pack(scene, file("a.pages"), {"--quiet"}).status, 0) << name;
        const auto render = [&](const std::string& output, const Strings& more) {
            Strings arguments = {
                "render",    scene, file(output), "--animation",      "all",       "--frame", "6",      "--width", "48",
                "--samples", "4",   "--aov",      "ids,depth,motion", "--primary", "traced",  "--quiet"};
            arguments.insert(arguments.end(), more.begin(), more.end());
            const Outcome outcome = run_program(arguments);
            EXPECT_EQ(outcome.status, 0) << name << ": " << outcome.err;
        };
        render("core.exr", {});
        render("paged.exr", {"--pages", file("a.pages")});
        // Origins of the tables may differ, because page files choose theirs at rest. So positions differ by rounding.
        const Outcome compared =
            run_program({"compare", file("core.exr"), file("paged.exr"), "--metric", "mse", "--fail", "1e-6"});
        EXPECT_EQ(compared.status, 0) << name << ": " << compared.out;
    }
}

TEST_F(Pack, AnimatedMaterialsAndLightsEqualThoseInMemory) {
    // A floor begins to glow, a veil over it becomes transparent, and a lamp fades.
    GltfBuilder b;
    const auto plane = [&](float height, int material) {
        Json& primitive = b.add_mesh({{"POSITION", b.floats("VEC3", {-2, height, -2, 2, height, -2, 2, height, 2,  //
                                                                     -2, height, 2})}});
        primitive["indices"] = b.accessor("SCALAR", kU8, std::vector<std::uint8_t>{0, 2, 1, 0, 3, 2});
        primitive["material"] = material;
    };
    b.json["materials"] = {{{"name", "floor"}, {"emissiveFactor", {0, 0, 0}}},
                           {{"name", "veil"}, {"alphaMode", "BLEND"}, {"doubleSided", true}}};
    plane(0, 0), plane(1, 1);
    b.json["extensions"]["KHR_lights_punctual"]["lights"] = {{{"type", "point"}, {"intensity", 30}}};
    b.push("nodes", {{"translation", {1, 2, 0}}, {"extensions", {{"KHR_lights_punctual", {{"light", 0}}}}}});
    b.json["extensionsUsed"] = {"KHR_lights_punctual", "KHR_animation_pointer"};
    const int times = b.floats("SCALAR", {0, 1});
    const auto channel = [&](int sampler, const std::string& pointer) -> Json {
        const Json target = {{"path", "pointer"}, {"extensions", {{"KHR_animation_pointer", {{"pointer", pointer}}}}}};
        return {{"sampler", sampler}, {"target", target}};
    };
    b.push("animations", {{"channels",
                           {channel(0, "/materials/0/emissiveFactor"),
                            channel(1, "/materials/1/pbrMetallicRoughness/baseColorFactor"),
                            channel(2, "/extensions/KHR_lights_punctual/lights/0/intensity")}},
                          {"samplers",
                           {{{"input", times}, {"output", b.floats("VEC3", {0, 0, 0, 1, 0.5f, 0.2f})}},
                            {{"input", times}, {"output", b.floats("VEC4", {1, 1, 1, 1, 1, 1, 1, 0.2f})}},
                            {{"input", times}, {"output", b.floats("SCALAR", {30, 0})}}}}});
    write_text(file("glow.glb"), b.glb());
    ASSERT_EQ(pack(file("glow.glb"), file("a.pages"), {"--quiet"}).status, 0);
    const auto render = [&](const std::string& frame, const Strings& more) {
        Strings arguments = {"render",
                             file("glow.glb"),
                             file("a.exr"),
                             "--width",
                             "48",
                             "--samples",
                             "4",
                             "--animation",
                             "all",
                             "--fps",
                             "4",
                             "--frame",
                             frame,
                             "--look-from",
                             "0,3,5",
                             "--look-at",
                             "0,0.5,0",
                             "--primary",
                             "traced",
                             "--env",
                             "none",
                             "--aov",
                             "emission,direct_diffuse",
                             "--quiet",
                             "--reproducible"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        const Outcome outcome = run_program(arguments);
        EXPECT_EQ(outcome.status, 0) << outcome.err;
        return read_text(file("a.exr"));
    };
    std::string last;
    for (const char* frame : {"0", "2", "4"}) {
        const std::string core = render(frame, {});
        EXPECT_TRUE(core != last) << frame;
        EXPECT_TRUE(render(frame, {"--pages", file("a.pages")}) == core) << frame;
        last = core;
    }
}

TEST_F(Pack, SequencesKeepTheirResidentPages) {
    const std::string scene = large_scene(8, 71, 2, true);
    ASSERT_EQ(pack(scene, file("a.pages"), {"--quiet"}).status, 0);
    const auto render = [&](const std::string& name, const std::string& pool, const std::string& frames) {
        const Outcome outcome = run_program({"render",
                                             scene,
                                             file(name + ".#.exr"),
                                             "--frames",
                                             frames,
                                             "--pages",
                                             file("a.pages"),
                                             "--page-pool",
                                             pool,
                                             "--width",
                                             "64",
                                             "--samples",
                                             "4",
                                             "--env",
                                             "1,0.9,0.8",
                                             "--look-from",
                                             "40,60,-50",
                                             "--look-at",
                                             "200,0,90",
                                             "--stats",
                                             file(name + ".json"),
                                             "--quiet",
                                             "--reproducible"});
        EXPECT_EQ(outcome.status, 0) << outcome.err;
    };
    render("large", "64M", "0-3");
    std::vector<int> read;  // pages that each frame has read from the file
    const std::string lines = read_text(file("large.json"));
    for (std::size_t at = 0; at < lines.size(); at = lines.find('\n', at) + 1) {
        const Json paging = Json::parse(lines.substr(at, lines.find('\n', at) - at)).at("paging");
        read.push_back(paging.at("loaded").get<int>() - paging.at("loaded_moving").get<int>());
        EXPECT_GT(paging.at("loaded_moving"), 0) << "the field that moves has new pages";
    }
    ASSERT_EQ(read.size(), 4u);
    EXPECT_GT(read[0], 5);
    for (const std::size_t frame : {1u, 2u, 3u}) EXPECT_LE(read[frame], read[0] / 5) << frame;
    render("small", "1M", "2");
    EXPECT_TRUE(read_text(file("large.2.exr")) == read_text(file("small.2.exr")));
}

}  // namespace
}  // namespace halflight::test
