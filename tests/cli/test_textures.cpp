// Tests textures that do not fit into memory, as a user meets them.
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "tests/support/process.h"
#include "tools/common/temporary_folder.h"

namespace halflight::test {
namespace {

using Json = nlohmann::json;
using Strings = std::vector<std::string>;

class Textures : public testing::Test {
  protected:
    std::string file(const std::string& name) const { return folder / name; }
    std::string hall(int textures, int size) const {
        const Outcome made = run({HALFLIGHT_SCENES, "hall", "--textures", std::to_string(textures), "--texture-size",
                                  std::to_string(size), file("hall.glb")});
        EXPECT_EQ(made.status, 0) << made.err;
        return file("hall.glb");
    }
    Outcome render(const std::string& scene, const std::string& output, const Strings& more,
                   const RunOptions& options = {}) const {
        Strings arguments = {"render",    scene, file(output), "--width", "96",
                             "--samples", "2",   "--bounces",  "3",       "--quiet"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        RunOptions with_cache = options;
        with_cache.environment.push_back("XDG_CACHE_HOME=" + file("cache"));
        return run_program(arguments, with_cache);
    }
    std::vector<std::string> cached() const {
        std::vector<std::string> names;
        if (std::filesystem::exists(file("cache/halflight/textures")))
            for (const auto& entry : std::filesystem::directory_iterator(file("cache/halflight/textures")))
                names.push_back(entry.path().filename().string());
        return names;
    }
    const TemporaryFolder folder;
};

TEST_F(Textures, PicturesOfAllPoolsAreEqual) {
    const std::string scene = hall(30, 250);
    const Strings layers = {"--reproducible", "--aov",
                            "direct_diffuse,direct_glossy,indirect_diffuse,indirect_glossy,albedo,normal,depth,ids"};
    for (const char* primary : {"raster", "traced"}) {
        Strings more = layers;
        more.insert(more.end(), {"--primary", primary});
        const Outcome memory = render(scene, "memory.exr", more);
        ASSERT_EQ(memory.status, 0) << memory.err;
        more.insert(more.end(), {"--texture-pool", ""});
        for (const char* pool : {"1", "3M", "64M"}) {
            more.back() = pool;
            const Outcome tiled = render(scene, "tiled.exr", more);
            ASSERT_EQ(tiled.status, 0) << tiled.err;
            EXPECT_TRUE(read_text(file("tiled.exr")) == read_text(file("memory.exr"))) << pool << ' ' << primary;
        }
    }
}

TEST_F(Textures, CanBeUsedFromALaterFrameOn) {
    // The clear coat of a quad goes from 0 at 0 s to 1 at 1 s; its texture is white and black.
    write_text(file("coat.gltf"), R"({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
        "extensionsUsed": ["KHR_materials_clearcoat", "KHR_animation_pointer"],
        "nodes": [{"mesh": 0}], "textures": [{"source": 0}], "images": [{"uri":
        "data:image/png;base64,iVBORw0KGgoAAAANSUhEUgAAAAIAAAABCAAAAADRSSBWAAAAC0lEQVR42mP4zwAAAgEBAKEeXHUAAAAASUVORK5CYII="}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "indices": 4, "material": 0}]}],
        "materials": [{"pbrMetallicRoughness": {"baseColorFactor": [0, 0, 0, 1], "metallicFactor": 0},
            "extensions": {"KHR_materials_clearcoat": {"clearcoatFactor": 0, "clearcoatTexture": {"index": 0}}}}],
        "buffers": [{"byteLength": 102, "uri": "data:;base64,AACAvwAAgL8AAAAAAACAPwAAgL8AAAAAAACAPwAAgD8AAAAAAACAvwAAgD8AAAAAAAAAAAAAgD8AAIA/AACAPwAAgD8AAAAAAAAAAAAAAAAAAAAAAACAPwAAAAAAAIA/AAECAAID"}],
        "bufferViews": [{"buffer": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 32},
            {"buffer": 0, "byteOffset": 80, "byteLength": 8}, {"buffer": 0, "byteOffset": 88, "byteLength": 8},
            {"buffer": 0, "byteOffset": 96, "byteLength": 6}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [-1, -1, 0], "max": [1, 1, 0]},
            {"bufferView": 1, "componentType": 5126, "count": 4, "type": "VEC2"},
            {"bufferView": 2, "componentType": 5126, "count": 2, "type": "SCALAR", "min": [0], "max": [1]},
            {"bufferView": 3, "componentType": 5126, "count": 2, "type": "SCALAR"},
            {"bufferView": 4, "componentType": 5121, "count": 6, "type": "SCALAR"}],
        "animations": [{"samplers": [{"input": 2, "output": 3}], "channels": [{"sampler": 0, "target": {
            "path": "pointer", "extensions": {"KHR_animation_pointer": {
                "pointer": "/materials/0/extensions/KHR_materials_clearcoat/clearcoatFactor"}}}}]}]})");
    const auto frames = [&](const std::string& name, Strings more) {
        more.insert(more.end(), {"--frames", "0-1", "--fps", "1", "--env", "white", "--look-from", "0,0,3", "--look-at",
                                 "0,0,0", "--reproducible"});
        const Outcome outcome = render(file("coat.gltf"), name + ".#.exr", more);
        EXPECT_EQ(outcome.status, 0) << outcome.err;
        return read_text(file(name + ".1.exr"));
    };
    const std::string expected = frames("memory", {});
    EXPECT_TRUE(expected != read_text(file("memory.0.exr"))) << "the coat is seen";
    const Strings pool{"--texture-pool", "2M"}, all{"--keep-all"}, both{"--keep-all", "--texture-pool", "2M"};
    EXPECT_TRUE(frames("pool", pool) == expected);
    EXPECT_TRUE(frames("all", all) == expected);
    EXPECT_TRUE(frames("both", both) == expected);
}

TEST_F(Textures, StayWithinTheMemoryBudget) {
    [[maybe_unused]] constexpr std::size_t kBudget = std::size_t{500} << 20;  // bytes; the textures in memory: 630 MB
    const std::string scene = hall(30, 1024);
    const Outcome outcome = render(scene, "a.exr", {"--memory", "500M", "--stats", file("a.json")});
    ASSERT_EQ(outcome.status, 0) << outcome.err;
#ifndef HALFLIGHT_SANITIZED
    EXPECT_LT(outcome.peak_bytes, kBudget);
#endif
    const Json stats = Json::parse(read_text(file("a.json")));
    const Json textures = stats.at("textures");
    ASSERT_TRUE(textures.is_object());
    EXPECT_EQ(textures.at("tiles"), 10 * (32 * 32 + 2 * 16 * 32)) << "colours in 32 x 32 texels, data in 64 x 32";
    EXPECT_GT(textures.at("loaded"), 0);
    EXPECT_GT(textures.at("loaded_bytes"), 0);
    EXPECT_GE(textures.at("rounds"), textures.at("batches"));
    EXPECT_GT(stats.at("memory").at("part_bytes").at("textures"), 0);

    const Outcome whole = render(scene, "b.exr", {"--stats", file("b.json")});
    ASSERT_EQ(whole.status, 0) << whole.err;
    EXPECT_TRUE(Json::parse(read_text(file("b.json"))).at("textures").is_null());
    const Outcome info = run_program({"info", scene, "--memory", "500M", "--json"});
    EXPECT_EQ(info.status, 0) << info.err;
}

TEST_F(Textures, AreCutOnce) {
    const std::string scene = hall(6, 250);
    const auto start = [&](const Strings& more = {}) {
        Strings arguments = {"--reproducible", "--texture-pool", "3M"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        const Outcome outcome = render(scene, "a.exr", arguments);
        EXPECT_EQ(outcome.status, 0) << outcome.err;
        return read_text(file("a.exr"));
    };
    const std::string first = start();
    EXPECT_EQ(cached().size(), 6u);
    EXPECT_TRUE(start() == first);
    for (const std::string& name : cached()) write_text(file("cache/halflight/textures/" + name), "foreign");
    EXPECT_TRUE(start() == first);
    EXPECT_EQ(cached().size(), 6u);
    start({"--texture-lod"});
    EXPECT_EQ(cached().size(), 12u) << "levels make other files";
}

TEST_F(Textures, KilledProgramsLeaveNothingForTheNextOne) {
    const std::string scene = hall(30, 700);
    for (int i = 0; i < 3; ++i) {
        RunOptions options{.wrapper = {"timeout", "-s", "KILL", std::to_string(0.4 + 0.3 * i)}};
        render(scene, "a.exr", {"--texture-pool", "3M"}, options);
    }
    EXPECT_EQ(render(scene, "a.exr", {"--texture-pool", "3M"}).status, 0);
    EXPECT_EQ(cached().size(), 30u);
    for (const std::string& name : cached()) {
        EXPECT_TRUE(name.ends_with("-1.tiles")) << name;
        EXPECT_FALSE(name.starts_with(".")) << "a temporary: " << name;
    }
}

TEST_F(Textures, OfMipLevelsAreABias) {
    const std::string scene = hall(6, 250);
    const Strings lod = {"--texture-lod", "--reproducible", "--stats", file("a.json")};
    ASSERT_EQ(render(scene, "a.exr", lod).status, 0);
    const Json stats = Json::parse(read_text(file("a.json")));
    EXPECT_EQ(stats.at("biases"), Json::array({"textures: mip levels by ray footprint"}));
    EXPECT_NE(read_text(file("a.exr")).find("textures: mip levels by ray footprint"), std::string::npos);
    Strings tiles = lod;
    tiles.insert(tiles.end(), {"--texture-pool", "1"});
    ASSERT_EQ(render(scene, "b.exr", tiles).status, 0);
    EXPECT_TRUE(read_text(file("a.exr")) == read_text(file("b.exr")));
    ASSERT_EQ(render(scene, "c.exr", {"--reproducible", "--stats", file("c.json")}).status, 0);
    EXPECT_FALSE(read_text(file("a.exr")) == read_text(file("c.exr")));
    const std::string without = read_text(file("c.json"));
    EXPECT_NE(without.find("no texture has any (--texture-lod)"), std::string::npos);
}

TEST_F(Textures, RefusalsAreOneLine) {
    const std::string scene = hall(6, 1024);
    const auto expect = [&](const Strings& more, const std::string& text, const RunOptions& options = {},
                            int status = 1) {
        const Outcome outcome = render(scene, "no.exr", more, options);
        EXPECT_EQ(outcome.status, status);
        EXPECT_NE(outcome.err.find(text), std::string::npos) << outcome.err;
        EXPECT_EQ(std::ranges::count(outcome.err, '\n'), 1) << outcome.err;
        EXPECT_FALSE(std::filesystem::exists(file("no.exr")));
    };
    expect({"--memory", "170M"}, "of the budget of 170 MiB are left (--memory)");
    expect({"--texture-pool", "much"}, "--texture-pool: expects a size", {}, 2);
    expect({"--texture-pool", "8M", "--no-shader-cache"},
           "temporary file of textures: cannot write temporary data: File too large",
           {.wrapper = {"prlimit", "--fsize=1000000"}});
}

}  // namespace
}  // namespace halflight::test
