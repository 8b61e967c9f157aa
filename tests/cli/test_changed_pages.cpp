// Tests what happens when a scene, its page file or the folder of page files changes between and during renderings.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <fstream>
#include <nlohmann/json.hpp>

#include "engine/io/files.h"
#include "engine/io/png.h"
#include "tests/support/process.h"
#include "tests/unit/io/gltf_builder.h"
#include "tools/common/temporary_folder.h"

namespace halflight::test {
namespace {

namespace fs = std::filesystem;
using Strings = std::vector<std::string>;

class ChangedPages : public testing::Test {
  protected:
    std::string file(const std::string& name) const { return folder / name; }

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
        std::vector<float> positions;
        std::vector<std::uint32_t> indices;
        for (int y = 0; y <= side; ++y)
            for (int x = 0; x <= side; ++x)
                positions.insert(positions.end(), {float(x), height * float((x * y) % 3), float(y)});
        for (int y = 0; y < side; ++y)
            for (int x = 0; x < side; ++x) {
                const auto i = static_cast<std::uint32_t>(y * (side + 1) + x);
                indices.insert(indices.end(), {i, i + 1, i + side + 1, i + 1, i + side + 2, i + side + 1});
            }
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
        const auto alpha = static_cast<std::uint8_t>(low);
        const std::vector<std::uint8_t> texels = {90, 200, 60, 255, 90, 200, 60, alpha};
        write_png(file("leaf.png"), 2, 1, 4, texels);
        write_text(file("list.parts.json"), R"({"parts": [{"uri": "scene.glb"}]})");
        return {file("scene.glb"), file("list.parts.json")};
    }

    /// Renders to a.exr; the cache of page files is in the folder.
    Outcome render(const std::string& scene, Strings more = {}, RunOptions options = {}) const {
        options.environment.push_back("XDG_CACHE_HOME=" + file("cache"));
        const std::string layers =
            "direct_diffuse,indirect_diffuse,indirect_glossy,albedo,normal,depth,ids,cryptoobject,cryptomaterial";
        Strings arguments = {"render", scene, file("a.exr"), "--width", "48", "--height", "32", "--samples", "2"};
        for (const char* word : {"--env", "1,0.9,0.8", "--primary", "traced", "--quiet", "--reproducible",
                                 "--look-from", "-10,40,-20", "--look-at", "20,0,20", "--aov", layers.c_str()})
            arguments.push_back(word);
        arguments.insert(arguments.end(), more.begin(), more.end());
        return run_program(arguments, options);
    }
    std::string picture(const std::string& scene, const Strings& more = {}) const {
        const Outcome outcome = render(scene, more);
        EXPECT_EQ(outcome.status, 0) << outcome.err;
        return outcome.status == 0 ? read_text(file("a.exr")) : "";
    }
    void pack(const std::string& scene) const {
        const Outcome outcome = run_program({"pack", scene, file("a.pages"), "--quiet"});
        EXPECT_EQ(outcome.status, 0) << outcome.err;
    }
    /// Returns the only file in the cache of page files.
    fs::path cached() const {
        const fs::path cache = file("cache/halflight/scenes");
        EXPECT_EQ(std::distance(fs::directory_iterator(cache), {}), 1);
        return fs::directory_iterator(cache)->path();
    }
    void expect_stale(const std::string& scene) const {
        const Outcome outcome = render(scene, {"--pages", file("a.pages")});
        EXPECT_EQ(outcome.status, 1);
        EXPECT_NE(outcome.err.find("a.pages: was not made of"), std::string::npos) << outcome.err;
        EXPECT_EQ(std::ranges::count(outcome.err, '\n'), 1) << outcome.err;
    }

    TemporaryFolder folder;
};

TEST_F(ChangedPages, MeshesWithoutTrianglesAreNoObjects) {
    const auto [scene, list] = write_scene(0);
    pack(scene);
    const std::string core = picture(scene);
    EXPECT_TRUE(picture(scene, {"--pages", file("a.pages")}) == core);
    EXPECT_NE(picture(list), "");
}

TEST_F(ChangedPages, FramesDependOnTheFilesOfImages) {
    const auto [scene, list] = write_scene(0);
    pack(scene);
    for (const Strings& from : {Strings{scene, "--pages", file("a.pages")}, Strings{list}}) {
        write_scene(0);
        Strings arguments = {"render", from[0], file(from.size() > 1 ? "p.#.exr" : "l.#.exr")};
        arguments.insert(arguments.end(), from.begin() + 1, from.end());
        for (const char* word : {"--width", "16", "--samples", "1", "--frames", "1", "--quiet"})
            arguments.push_back(word);
        const RunOptions options{.environment = {"XDG_CACHE_HOME=" + file("cache")}};
        EXPECT_EQ(run_program(arguments, options).status, 0);
        EXPECT_EQ(run_program(arguments, options).status, 0) << "keeps the frame";
        write_png(file("leaf.png"), 2, 1, 4, std::vector<std::uint8_t>{10, 20, 200, 255, 10, 20, 200, 0});
        const Outcome outcome = run_program(arguments, options);
        EXPECT_EQ(outcome.status, 1) << from[0] << ": another image makes another frame";
    }
}

/// Page files hold times of the scene's files, which are no part of a frame.
TEST_F(ChangedPages, FramesDoNotDependOnThePageFileItself) {
    const auto [scene, list] = write_scene(0);
    Strings arguments = {"render", scene, file("p.#.exr"), "--pages", file("a.pages"), "--frames", "1"};
    for (const char* word : {"--width", "16", "--samples", "1", "--quiet"}) arguments.push_back(word);
    pack(scene);
    const std::string first = read_text(file("a.pages"));
    ASSERT_EQ(run_program(arguments).status, 0);
    fs::last_write_time(scene, fs::last_write_time(scene) + std::chrono::hours(1));
    fs::remove(file("a.pages"));
    pack(scene);
    ASSERT_FALSE(read_text(file("a.pages")) == first);
    const Outcome outcome = run_program(arguments);
    EXPECT_EQ(outcome.status, 0) << outcome.err;
}

TEST_F(ChangedPages, ChangedFilesAreNoticed) {
    const auto [scene, list] = write_scene(0);
    pack(scene);
    const std::string first = picture(list);
    // Another time alone makes no other scene. Another content of the same size does.
    fs::last_write_time(scene, fs::last_write_time(scene) + std::chrono::hours(1));
    EXPECT_EQ(render(scene, {"--pages", file("a.pages")}).status, 0);
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
    pack(scene);
    const std::string opaque = picture(list);
    EXPECT_NE(render(scene, {"--pages", file("a.pages")}).status, 1);
    write_scene(0);
    fs::last_write_time(scene, fs::last_write_time(scene) + std::chrono::seconds(1));
    expect_stale(scene);
    const std::string holes = picture(list);
    EXPECT_FALSE(holes == opaque);
    const std::string core = picture(scene);
    pack(scene);
    EXPECT_TRUE(picture(scene, {"--pages", file("a.pages")}) == core);
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
    pack(scene);
    const std::string unedited = picture(scene);
    write_text(file("clay.json"), R"({"halflight_settings": 1, "clay": true})");
    for (const Strings& edit : {Strings{"--settings", file("clay.json")}, Strings{"--material", "cloth.roughness=0.1"},
                                Strings{"--material", "veil.base_color=0.1,0.2,0.9"}}) {
        const std::string core = picture(scene, edit);
        EXPECT_FALSE(core == unedited) << edit.back();
        Strings paged = edit;
        paged.insert(paged.end(), {"--pages", file("a.pages")});
        EXPECT_TRUE(picture(scene, paged) == core) << edit.back();
    }
    const Strings thin = {"--material", "veil.base_color=1,1,1,0.5", "--pages", file("a.pages")};
    const Outcome outcome = render(scene, thin);
    EXPECT_EQ(outcome.status, 1);
    EXPECT_NE(outcome.err.find("material 1: its surfaces are opaque in the pages"), std::string::npos) << outcome.err;
    EXPECT_EQ(std::ranges::count(outcome.err, '\n'), 1) << outcome.err;
}

TEST_F(ChangedPages, DamagedFilesInTheCacheAreMadeAnew) {
    const auto [scene, list] = write_scene(0);
    const std::string first = picture(list);
    const fs::path pages = cached();
    std::string bytes = read_text(pages);
    for (std::size_t i = 64; i < bytes.size() / 2; i += 50) bytes[i] = static_cast<char>(bytes[i] ^ 1);
    write_text(pages, bytes);
    const Outcome damaged = render(list);
    EXPECT_EQ(damaged.status, 1);
    EXPECT_NE(damaged.err.find("is damaged; the file has been removed, and the next start makes it anew"),
              std::string::npos)
        << damaged.err;
    EXPECT_TRUE(picture(list) == first);
}

TEST_F(ChangedPages, PoolsTakeNoMoreThanThePagesNeed) {
    const auto [scene, list] = write_scene(0);
    pack(scene);
    const Outcome outcome = render(scene, {"--pages", file("a.pages"), "--page-pool", "8G", "--memory", "1200M"});
    EXPECT_EQ(outcome.status, 0) << outcome.err;
}

}  // namespace
}  // namespace halflight::test
