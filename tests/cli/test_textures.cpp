// Tests textures that do not fit into memory, as a user meets them.
#include "tests/cli/animated_scenes.h"
#include "tests/cli/command_test.h"

namespace halflight::test {
namespace {

using Json = nlohmann::json;

class Textures : public CommandTest {
  protected:
    std::string hall(int textures, int size) const {
        const Outcome made = run(words(std::string(HALFLIGHT_SCENES), "hall", file("hall.glb"), "--textures",
                                       std::to_string(textures), "--texture-size", std::to_string(size)));
        EXPECT_EQ(made.status, 0) << made.err;
        return file("hall.glb");
    }
    Strings command(const std::string& scene, const std::string& output, const Strings& more) const {
        return words("render", scene, file(output), "--width 96 --samples 2 --bounces 3 --quiet", more);
    }
    RunOptions cached(Strings wrapper = {}) const {
        return {.environment = {"XDG_CACHE_HOME=" + file("cache")}, .wrapper = std::move(wrapper)};
    }
    /// Renders, and returns the file.
    std::string render(const std::string& scene, const Strings& more) const {
        done(command(scene, "a.exr", more), cached());
        return read_text(file("a.exr"));
    }
    Strings cache() const {
        Strings names;
        if (std::filesystem::exists(file("cache/halflight/textures")))
            for (const auto& entry : std::filesystem::directory_iterator(file("cache/halflight/textures")))
                names.push_back(entry.path().filename().string());
        return names;
    }
};

TEST_F(Textures, PicturesOfAllPoolsAreEqual) {
    const std::string scene = hall(30, 250);
    for (const char* primary : {"raster", "traced"}) {
        const Strings layers = words(
            "--reproducible --aov",
            "direct_diffuse,direct_glossy,indirect_diffuse,indirect_glossy,albedo,normal,depth,ids --primary", primary);
        const std::string memory = render(scene, layers);
        for (const char* pool : {"1", "3M", "64M"})
            EXPECT_TRUE(render(scene, words(layers, "--texture-pool", pool)) == memory) << pool << ' ' << primary;
    }
}

/// A PNG of two pixels.
constexpr const char* kWhiteAndBlack =
    "data:image/"
    "png;base64,iVBORw0KGgoAAAANSUhEUgAAAAIAAAABCAAAAADRSSBWAAAAC0lEQVR42mP4zwAAAgEBAKEeXHUAAAAASUVORK5CYII=";

/// The clear coat of a quad goes from 0 at 0 s to 1 at 1 s.
TEST_F(Textures, CanBeUsedFromALaterFrameOn) {
    GltfBuilder b;
    Json& quad = b.add_mesh({{"POSITION", b.floats("VEC3", {-1, -1, 0, 1, -1, 0, 1, 1, 0, -1, 1, 0})},
                             {"TEXCOORD_0", b.floats("VEC2", {0, 0, 1, 0, 1, 1, 0, 1})}});
    quad["indices"] = b.accessor("SCALAR", kU8, std::vector<std::uint8_t>{0, 1, 2, 0, 2, 3});
    quad["material"] = 0;
    b.push("images", {{"uri", kWhiteAndBlack}});
    b.push("textures", {{"source", 0}});
    b.push("materials",
           {{"pbrMetallicRoughness", {{"baseColorFactor", {0, 0, 0, 1}}, {"metallicFactor", 0}}},
            {"extensions",
             {{"KHR_materials_clearcoat", {{"clearcoatFactor", 0}, {"clearcoatTexture", {{"index", 0}}}}}}}});
    b.json["extensionsUsed"] = {"KHR_materials_clearcoat"};
    animate_pointer(b, "/materials/0/extensions/KHR_materials_clearcoat/clearcoatFactor", "SCALAR", {0, 1});
    write_text(file("coat.glb"), b.glb());
    const auto frames = [&](const std::string& name, const char* more) {
        done(command(file("coat.glb"), name + ".#.exr",
                     words("--frames 0-1 --fps 1 --env white --look-from 0,0,3 --look-at 0,0,0 --reproducible", more)),
             cached());
        return read_text(file(name + ".1.exr"));
    };
    const std::string expected = frames("memory", "");
    EXPECT_TRUE(expected != read_text(file("memory.0.exr"))) << "the coat is seen";
    EXPECT_TRUE(frames("pool", "--texture-pool 2M") == expected);
    EXPECT_TRUE(frames("all", "--keep-all") == expected);
    EXPECT_TRUE(frames("both", "--keep-all --texture-pool 2M") == expected);
}

TEST_F(Textures, StayWithinTheMemoryBudget) {
    [[maybe_unused]] constexpr std::size_t kBudget = std::size_t{500} << 20;  // bytes; the textures in memory: 630 MB
    const std::string scene = hall(30, 1024);
    const Outcome outcome = done(command(scene, "a.exr", words("--memory 500M --stats", file("a.json"))), cached());
#ifndef HALFLIGHT_SANITIZED
    EXPECT_LT(outcome.peak_bytes, kBudget);
#endif
    const Json stats = json_file(file("a.json"));
    const Json textures = stats.at("textures");
    ASSERT_TRUE(textures.is_object());
    EXPECT_EQ(textures.at("tiles"), 10 * (32 * 32 + 2 * 16 * 32)) << "colours in 32 x 32 texels, data in 64 x 32";
    EXPECT_GT(textures.at("loaded"), 0);
    EXPECT_GT(textures.at("loaded_bytes"), 0);
    EXPECT_GE(textures.at("rounds"), textures.at("batches"));
    EXPECT_GT(stats.at("memory").at("part_bytes").at("textures"), 0);

    render(scene, {"--stats", file("b.json")});
    EXPECT_TRUE(json_file(file("b.json")).at("textures").is_null());
    done(words("info", scene, "--memory 500M --json"));
}

TEST_F(Textures, AreCutOnce) {
    const std::string scene = hall(6, 250);
    const Strings pool = words("--reproducible --texture-pool 3M");
    const std::string first = render(scene, pool);
    EXPECT_EQ(cache().size(), 6u);
    EXPECT_TRUE(render(scene, pool) == first);
    for (const std::string& name : cache()) write_text(file("cache/halflight/textures/" + name), "foreign");
    EXPECT_TRUE(render(scene, pool) == first);
    EXPECT_EQ(cache().size(), 6u);
    render(scene, words(pool, "--texture-lod"));
    EXPECT_EQ(cache().size(), 12u) << "levels make other files";
}

TEST_F(Textures, KilledProgramsLeaveNothingForTheNextOne) {
    const std::string scene = hall(30, 700);
    const Strings pool = words("--texture-pool 3M");
    for (int i = 0; i < 3; ++i)
        run_program(command(scene, "a.exr", pool), cached(words("timeout -s KILL", std::to_string(0.4 + 0.3 * i))));
    render(scene, pool);
    EXPECT_EQ(cache().size(), 30u);
    for (const std::string& name : cache()) {
        EXPECT_TRUE(name.ends_with("-2.tiles")) << name;
        EXPECT_FALSE(name.starts_with(".")) << "a temporary: " << name;
    }
}

TEST_F(Textures, OfMipLevelsAreABias) {
    const std::string scene = hall(6, 250);
    const Strings lod = words("--texture-lod --reproducible --stats", file("a.json"));
    const std::string memory = render(scene, lod);
    const std::string bias = bias_of(file("a.exr"));
    EXPECT_TRUE(bias.starts_with("textures: ")) << bias;
    EXPECT_EQ(json_file(file("a.json")).at("biases"), Json::array({bias}));
    EXPECT_TRUE(render(scene, words(lod, "--texture-pool 1")) == memory);
    EXPECT_FALSE(render(scene, words("--reproducible --stats", file("c.json"))) == memory);
    expect_has(read_text(file("c.json")), "--texture-lod");
}

TEST_F(Textures, RefusalsAreOneLine) {
    const std::string scene = hall(6, 1024);
    refused(1, command(scene, "no.exr", words("--memory 170M")), "(--memory)");
    const TemporaryFolder empty;  // the usual cache may hold the tiles already
    refused(1, command(scene, "no.exr", words("--texture-pool 8M --no-shader-cache")), "temporary file of textures: ",
            {.environment = {"XDG_CACHE_HOME=" + empty.path.string()}, .wrapper = {"prlimit", "--fsize=1000000"}});
}

}  // namespace
}  // namespace halflight::test
