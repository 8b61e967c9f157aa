// Tests what happens when a scene, its page file or the folder of page files changes between and during renderings.
#include <chrono>

#include "engine/io/png.h"
#include "tests/cli/pack_test.h"

namespace halflight::test {
namespace {

namespace fs = std::filesystem;

class ChangedPages : public Pack {
  protected:
    /// Writes a leaf with holes above a floor of 2 side^2 triangles, between meshes without triangles. `low` is the
    /// least alpha of the leaf's image, a file. Returns the names of the scene and of a list that contains only it.
    std::pair<std::string, std::string> write_scene(int low, int side = 40, float height = 1) const {
        GltfBuilder b;
        b.json["images"] = {{{"uri", "leaf.png"}}};
        b.json["textures"] = {{{"source", 0}}};
        b.json["materials"] = {{{"name", "floor"}},
                               {{"name", "leaf"},
                                {"alphaMode", "MASK"},
                                {"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}}};
        const auto [positions, indices] = field(side, 3, height);
        Json& lines = b.add_triangle();  // lines are left out
        lines["mode"] = 1;
        lines["material"] = 0;
        Json& floor = b.add_mesh({{"POSITION", b.floats("VEC3", positions)}});
        floor["indices"] = b.accessor("SCALAR", kU32, indices);
        floor["material"] = 0;
        b.add_mesh({{"POSITION", b.floats("VEC3", {0, 0, 0, 0, 0, 0, 0, 0, 0})}})["material"] = 0;  // degenerate
        const float s = float(side);
        Json& leaf = b.add_mesh({{"POSITION", b.floats("VEC3", {0, 9, 0, s, 9, 0, 0, 9, s, s, 9, s})},
                                 {"TEXCOORD_0", b.floats("VEC2", {0, 0, 8, 0, 0, 8, 8, 8})}});
        leaf["indices"] = b.accessor("SCALAR", kU32, std::vector<std::uint32_t>{0, 1, 2, 1, 3, 2});
        leaf["material"] = 1;
        write_text(file("scene.glb"), b.glb());
        write_png(file("leaf.png"), 2, 1, 4,
                  std::vector<std::uint8_t>{90, 200, 60, 255, 90, 200, 60, static_cast<std::uint8_t>(low)});
        write_text(file("list.parts.json"), R"({"parts": [{"uri": "scene.glb"}]})");
        return {file("scene.glb"), file("list.parts.json")};
    }

    Strings command(const std::string& scene, const Strings& more = {}) const {
        return words(
            "render", scene, file("a.exr"), "--width 48 --height 32 --samples 2 --env 1,0.9,0.8 --quiet",
            "--primary traced --reproducible --look-from -10,40,-20 --look-at 20,0,20 --aov",
            "direct_diffuse,indirect_diffuse,indirect_glossy,albedo,normal,depth,ids,cryptoobject,cryptomaterial",
            more);
    }
    std::string picture(const std::string& scene, const Strings& more = {}) const {
        const Outcome outcome = done(command(scene, more), cached);
        return outcome.status == 0 ? read_text(file("a.exr")) : "";
    }
    /// Returns the picture that the page file gives.
    std::string paged(const std::string& scene, const Strings& more = {}) const {
        return picture(scene, words("--pages", file("a.pages"), more));
    }
    /// Returns the only file in the cache of page files.
    fs::path cached_pages() const {
        const fs::path cache = file("cache/halflight/scenes");
        EXPECT_EQ(std::distance(fs::directory_iterator(cache), {}), 1);
        return fs::directory_iterator(cache)->path();
    }
    void expect_stale(const std::string& scene) const {
        refused(1, command(scene, {"--pages", file("a.pages")}), "a.pages: was not made of", cached);
    }

    const RunOptions cached{.environment = {"XDG_CACHE_HOME=" + file("cache")}};
};

TEST_F(ChangedPages, MeshesWithoutTrianglesAreNoObjects) {
    const auto [scene, list] = write_scene(0);
    packed(scene);
    EXPECT_TRUE(paged(scene) == picture(scene));
    EXPECT_NE(picture(list), "");
}

TEST_F(ChangedPages, FramesDependOnTheFilesOfImages) {
    const auto [scene, list] = write_scene(0);
    packed(scene);
    for (const Strings& from :
         {words(scene, "--pages", file("a.pages"), "-o", file("p.#.exr")), words(list, "-o", file("l.#.exr"))}) {
        write_scene(0);
        const Strings frame = words("render", from, "--width 16 --samples 1 --frames 1 --quiet");
        done(frame, cached);
        done(frame, cached);  // keeps the frame
        write_png(file("leaf.png"), 2, 1, 4, std::vector<std::uint8_t>{10, 20, 200, 255, 10, 20, 200, 0});
        EXPECT_EQ(run_program(frame, cached).status, 1) << from[0] << ": another image makes another frame";
    }
}

/// Page files hold times of the scene's files, which are no part of a frame.
TEST_F(ChangedPages, FramesDoNotDependOnThePageFileItself) {
    const std::string scene = write_scene(0).first, first = read_text(packed(scene));
    const Strings frame = words("render", scene, file("p.#.exr"), "--pages", file("a.pages"),
                                "--frames 1 --width 16 --samples 1 --quiet");
    done(frame);
    fs::last_write_time(scene, fs::last_write_time(scene) + std::chrono::hours(1));
    ASSERT_FALSE(read_text(packed(scene)) == first);
    done(frame);
}

TEST_F(ChangedPages, ChangedFilesAreNoticed) {
    const auto [scene, list] = write_scene(0);
    packed(scene);
    const std::string first = picture(list);
    // Another time alone makes no other scene. Another content of the same size does.
    fs::last_write_time(scene, fs::last_write_time(scene) + std::chrono::hours(1));
    paged(scene);
    const std::string bytes = read_text(scene);
    const auto time = fs::last_write_time(scene);
    write_scene(0, 40, 2);
    ASSERT_EQ(read_text(scene).size(), bytes.size());
    fs::last_write_time(scene, time + std::chrono::seconds(1));
    expect_stale(scene);
    EXPECT_FALSE(picture(list) == first);
}

TEST_F(ChangedPages, ImagesThatDecideAlphaTestsAreNoticed) {
    const auto [scene, list] = write_scene(255);
    packed(scene);
    const std::string opaque = picture(list);
    paged(scene);
    write_scene(0);
    fs::last_write_time(scene, fs::last_write_time(scene) + std::chrono::seconds(1));
    expect_stale(scene);
    const std::string holes = picture(list);
    EXPECT_FALSE(holes == opaque);
    const std::string core = picture(scene);
    packed(scene);
    EXPECT_TRUE(paged(scene) == core);
}

TEST_F(ChangedPages, EditsOfMaterialsEqualThoseInMemoryOrAreRefused) {
    GltfBuilder b;
    b.json["images"] = {{{"uri", "cloth.png"}}};
    b.json["textures"] = {{{"source", 0}}};
    b.json["materials"] = {{{"name", "cloth"}, {"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}},
                           {{"name", "veil"}, {"alphaMode", "BLEND"}}};
    for (const int material : {0, 1}) {
        const float height = 9.0f * float(material), side = 40 - height;
        Json& quad = b.add_mesh({{"POSITION", b.floats("VEC3", {0, height, 0, side, height, 0, 0, height, side,  //
                                                                side, height, side})},
                                 {"TEXCOORD_0", b.floats("VEC2", {0, 0, 8, 0, 0, 8, 8, 8})}});
        quad["indices"] = b.accessor("SCALAR", kU32, std::vector<std::uint32_t>{0, 2, 1, 1, 2, 3});
        quad["material"] = material;
    }
    write_text(file("scene.glb"), b.glb());
    write_png(file("cloth.png"), 2, 1, 4, std::vector<std::uint8_t>{200, 90, 60, 255, 60, 90, 200, 255});
    const std::string scene = file("scene.glb");
    packed(scene);
    const std::string unedited = picture(scene);
    write_text(file("clay.json"), R"({"halflight_settings": 1, "clay": true})");
    for (const Strings& edit : {Strings{"--settings", file("clay.json")}, Strings{"--material", "cloth.roughness=0.1"},
                                Strings{"--material", "veil.base_color=0.1,0.2,0.9"}}) {
        const std::string core = picture(scene, edit);
        EXPECT_FALSE(core == unedited) << edit.back();
        EXPECT_TRUE(paged(scene, edit) == core) << edit.back();
    }
    refused(1, command(scene, words("--material veil.base_color=1,1,1,0.5 --pages", file("a.pages"))),
            "material 1: ", cached);
    refused(1, command(scene, words("--material cloth.double_sided=1 --pages", file("a.pages"))),
            "material 0: ", cached);
}

TEST_F(ChangedPages, LightPassesSolidsInPagesAsInMemory) {
    GltfBuilder b;
    b.json["materials"] = {{{"name", "floor"}},
                           {{"name", "glass"},
                            {"pbrMetallicRoughness", {{"metallicFactor", 0}, {"roughnessFactor", 0}}},
                            {"extensions",
                             {{"KHR_materials_transmission", {{"transmissionFactor", 1}}},
                              {"KHR_materials_volume", {{"thicknessFactor", 1}}}}}}};
    b.json["extensionsUsed"] = {"KHR_materials_transmission", "KHR_materials_volume"};
    for (const auto& [height, material, up] : {std::tuple{0.0f, 0, true}, {8.0f, 1, false}, {9.0f, 1, true}}) {
        Json& quad = b.add_mesh({{"POSITION", b.floats("VEC3", {0, height, 0, 40, height, 0, 0, height, 40,  //
                                                                40, height, 40})}});
        const std::vector<std::uint32_t> upwards{0, 2, 1, 1, 2, 3}, downwards{0, 1, 2, 1, 3, 2};
        quad["indices"] = b.accessor("SCALAR", kU32, up ? upwards : downwards);
        quad["material"] = material;
    }
    write_text(file("scene.glb"), b.glb());
    write_text(file("list.parts.json"), R"({"parts": [{"uri": "scene.glb"}]})");
    const std::string scene = file("scene.glb"), list = file("list.parts.json");
    const Strings straight = words("--glass-shadows straight");
    const std::string core = picture(scene, straight);
    EXPECT_FALSE(core == picture(scene));
    EXPECT_FALSE(picture(list, straight) == picture(list));
    done(words("pack", scene, file("a.pages"), "--glass-shadows straight --quiet"));
    EXPECT_TRUE(paged(scene, straight) == core);
    refused(1, command(scene, words("--pages", file("a.pages"))), "--glass-shadows straight", cached);
    refused(1, command(list, words("--glass-shadows straight --material glass.straight_shadows=0")),
            "material 1: ", cached);
    done(words("pack", scene, file("a.pages"), "--quiet"));
    refused(1, command(scene, words("--glass-shadows straight --pages", file("a.pages"))), "--glass-shadows straight",
            cached);
    refused(2, words("render", scene, file("a.exr"), "--glass-shadows straightish"), "--glass-shadows");
}

TEST_F(ChangedPages, DamagedFilesInTheCacheAreMadeAnew) {
    const auto [scene, list] = write_scene(0);
    const std::string first = picture(list);
    const fs::path pages = cached_pages();
    std::string bytes = read_text(pages);
    for (std::size_t i = 64; i < bytes.size() / 2; i += 50) bytes[i] = static_cast<char>(bytes[i] ^ 1);
    write_text(pages, bytes);
    refused(1, command(list), pages.string(), cached);
    EXPECT_TRUE(picture(list) == first);
}

TEST_F(ChangedPages, PoolsTakeNoMoreThanThePagesNeed) {
    const auto [scene, list] = write_scene(0);
    packed(scene);
    paged(scene, words("--page-pool 8G --memory 1200M"));
}

}  // namespace
}  // namespace halflight::test
