// Tests page files of animated scenes: pictures and sequences equal those of the scene in memory.
#include "tests/cli/animated_scenes.h"
#include "tests/cli/pack_test.h"

namespace halflight::test {
namespace {

TEST_F(Pack, AnimatedScenesEqualThoseInMemory) {
    const std::string scene = write_animated_scene(folder.path), pages = packed(scene);
    EXPECT_EQ(Json::parse(done({"info", pages, "--json"}).out).at("triangles"), 24)
        << "pages hold the floor and the lamp";
    const Strings view = words("--width 48 --samples 4 --aov ids,depth,normal,motion,albedo,cryptoobject");
    const Strings paged = words("--pages", pages, "--page-pool 1M");
    std::string last;
    const auto equal = [&](const char* pose) {
        last = picture(scene, view, pose);
        return picture(scene, view, pose, paged) == last;
    };
    for (const char* frame : {"0", "1", "3"}) {
        const std::string before = last;
        EXPECT_TRUE(equal(("--animation all --fps 4 --frame " + std::string(frame)).c_str())) << frame;
        EXPECT_TRUE(last != before) << "frame " << frame << " shows no motion";
    }
    // Parts that may move are out of the pages, whether they do or not.
    for (const char* pose :
         {"--frame 0", "--animation breathe --fps 4 --frame 2", "--animation all --fps 4 --frame 2 --shutter 1"})
        EXPECT_TRUE(equal(pose)) << pose;

    // A frame is the same in a sequence, alone, and whatever the size of the pool.
    const auto sequence = [&](const char* name, const char* frames) {
        done(words("render", scene, file(name), "--primary traced --reproducible --quiet --fps 4 --pages", pages, view,
                   frames));
    };
    sequence("all.#.exr", "--frames 0-3 --page-pool 64M");
    sequence("two.#.exr", "--frames 3,1 --page-pool 1M");
    EXPECT_TRUE(read_text(file("all.1.exr")) == read_text(file("two.1.exr")));
    EXPECT_TRUE(read_text(file("all.3.exr")) == read_text(file("two.3.exr")));
    // That frames of such a scene equal those in memory is not proven.
    refused(1,
            words("render", scene, file("all.#.exr"), "--primary traced --reproducible --quiet --fps 4 --pages none", view,
                  "--frames 0-3"),
            ": pages is yes, not as usual");
}

/// Surfaces that have no area at rest, whole boxes or their sides alone, have their materials when they appear.
TEST_F(Pack, SurfacesThatAppearEqualThoseInMemory) {
    for (const vec3& rest : {vec3(0), vec3(1, 0, 1)}) {
        std::filesystem::remove(file("blinking.glb"));
        const std::string scene = write_blinking_scene(folder.path, {rest, vec3(1), vec3(0.5f)}), pages = packed(scene);
        const char* const view =
            "--width 32 --samples 2 --fps 1 --look-from 2,3,5 --look-at 0,1,0 "
            "--aov albedo,ids,cryptomaterial --animation blink --frame";
        std::string last;
        for (const char* frame : {"0", "1", "2"}) {
            const std::string core = picture(scene, view, frame);
            EXPECT_TRUE(core != last) << frame;
            EXPECT_TRUE(picture(scene, view, frame, "--pages", pages) == core) << frame;
            last = core;
        }
    }
}

TEST_F(Pack, AssetsWithSkinsAndMorphTargetsPlay) {
    const std::filesystem::path assets = HALFLIGHT_SHARED_DIR "/assets/animation";
    if (!std::filesystem::exists(assets)) GTEST_SKIP() << "../shared/assets is not there";
    const std::pair<const char*, const char*> scenes[] = {{"Fox.glb", "150,80,150 --look-at 0,40,0"},
                                                          {"MorphStressTest.gltf", "0,3,6 --look-at 0,1,0"},
                                                          {"SimpleSkin/SimpleSkin.gltf", "0,1,4 --look-at 0,1,0"}};
    for (const auto& [name, look] : scenes) {  // default cameras of pages frame boxes
        SCOPED_TRACE(name);
        const std::string scene = assets / name, pages = packed(scene);
        const std::string wanted =
            fmt::format("--animation all --frame 6 --width 48 --samples 4 --aov ids,depth,motion --look-from {}", look);
        const char* const view = wanted.c_str();
        picture(scene, view);
        std::filesystem::rename(file("a.exr"), file("core.exr"));
        picture(scene, view, "--pages", pages);
        // Origins of the tables may differ, because page files choose theirs at rest. So positions differ by rounding.
        done(words("compare", file("core.exr"), file("a.exr"), "--metric mse --fail 1e-6"));
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
    b.json["extensionsUsed"] = {"KHR_lights_punctual"};
    animate_pointer(b, "/materials/0/emissiveFactor", "VEC3", {0, 0, 0, 1, 0.5f, 0.2f});
    animate_pointer(b, "/materials/1/pbrMetallicRoughness/baseColorFactor", "VEC4", {1, 1, 1, 1, 1, 1, 1, 0.2f});
    animate_pointer(b, "/extensions/KHR_lights_punctual/lights/0/intensity", "SCALAR", {30, 0});
    write_text(file("glow.glb"), b.glb());
    const std::string pages = packed(file("glow.glb"));
    const char* const view =
        "--width 48 --samples 4 --animation all --fps 4 --look-from 0,3,5 --look-at 0,0.5,0 "
        "--env none --aov emission,direct_diffuse --frame";
    std::string last;
    for (const char* frame : {"0", "2", "4"}) {
        const std::string core = picture(file("glow.glb"), view, frame);
        EXPECT_TRUE(core != last) << frame;
        EXPECT_TRUE(picture(file("glow.glb"), view, frame, "--pages", pages) == core) << frame;
        last = core;
    }
}

TEST_F(Pack, SequencesKeepTheirResidentPages) {
    const std::string scene = large_scene(8, 71, 2, true), pages = packed(scene);
    const auto render = [&](const char* name, const char* more) {
        done(words("render", scene, file(name), "--pages", pages, "--width 64 --samples 4 --env 1,0.9,0.8 --look-from",
                   "40,60,-50 --look-at 200,0,90 --quiet --reproducible --stats", file("stats.json"), more));
    };
    render("large.#.exr", "--page-pool 64M --frames 0-3");
    std::vector<int> read;  // pages that each frame has read from the file
    for (const Json& line : json_lines(read_text(file("stats.json")))) {
        const Json& paging = line.at("paging");
        read.push_back(paging.at("loaded").get<int>() - paging.at("loaded_moving").get<int>());
        EXPECT_GT(paging.at("loaded_moving"), 0) << "the field that moves has new pages";
    }
    ASSERT_EQ(read.size(), 4u);
    EXPECT_GT(read[0], 5);
    for (const std::size_t frame : {1u, 2u, 3u}) EXPECT_LE(read[frame], read[0] / 5) << frame;
    render("small.#.exr", "--page-pool 1M --frames 2");
    EXPECT_TRUE(read_text(file("large.2.exr")) == read_text(file("small.2.exr")));
}

}  // namespace
}  // namespace halflight::test
