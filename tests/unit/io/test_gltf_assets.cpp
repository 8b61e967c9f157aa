// Tests files of other projects and files with wrong properties. Valid files load completely; invalid files load, or
// are refused in one line. tests/fuzz/test_regressions.cpp changes bytes.
#include <map>
#include <optional>
#include <set>
#include <sstream>

#include "tests/unit/io/gltf_builder.h"

namespace halflight {
namespace {

namespace fs = std::filesystem;

const fs::path kSharedAssets = fs::path(HALFLIGHT_SHARED_DIR) / "assets";

class GltfAssets : public testing::Test {
  protected:
    void SetUp() override {
        if (!fs::exists(kSharedAssets)) GTEST_SKIP() << "no assets in " << kSharedAssets;
    }
};

TEST_F(GltfAssets, LoadWithAllTheirTriangles) {
    // Lines of STATS.txt look like "path sizeMB ... instTri=123 ... inst=4 ..."; another program wrote them.
    std::ifstream stats(kSharedAssets / "STATS.txt");
    std::size_t loaded = 0;
    for (std::string line; std::getline(stats, line); ++loaded) {
        std::istringstream words(line);
        std::string path;
        words >> path;
        std::map<std::string, std::size_t> counts;
        for (std::string word; words >> word;) {
            const std::size_t equals = word.find('=');
            if (equals != std::string::npos)
                counts[word.substr(0, equals)] = std::strtoull(&word[equals + 1], nullptr, 10);
        }
        const Scene scene = load_gltf(kSharedAssets / path);
        std::size_t count = scene.report.degenerate_triangles_dropped + scene.report.non_finite_triangles_dropped;
        for (const Instance& i : scene.instances)
            count += scene.meshes[static_cast<std::size_t>(i.mesh)].triangles.size();
        EXPECT_EQ(count, counts["instTri"]) << path;
        EXPECT_EQ(scene.lights.size(), counts["lightNodes"]) << path;
        EXPECT_EQ(scene.cameras.size(), counts["cam"]) << path;
    }
    EXPECT_GE(loaded, 30u);
}

/// The upper end of the bar follows the second joint, at (0, 1, 0), which has turned by 90 degrees after one second.
TEST_F(GltfAssets, SimpleSkinBends) {
    GltfScene scene(kSharedAssets / "animation/SimpleSkin/SimpleSkin.gltf");
    ASSERT_EQ(scene.animations().size(), 1u);
    const std::size_t first[] = {0};
    const std::vector<vec3> straight = scene.at(0, first).meshes.at(0).positions;
    const std::vector<vec3> bent = scene.at(1, first).meshes.at(0).positions;
    ASSERT_EQ(straight.size(), bent.size());
    std::size_t ends = 0;
    for (std::size_t i = 0; i < straight.size(); ++i) {
        const vec3 p = straight[i];
        if (p.y == 0) {
            EXPECT_LT(glm::distance(bent[i], p), 1e-6f);
        }
        if (p.y < 2) continue;
        EXPECT_LT(glm::distance(bent[i], vec3(1 - p.y, 1 + p.x, p.z)), 1e-3f) << i;  // keys have three decimals
        ++ends;
    }
    EXPECT_GE(ends, 2u);
}

TEST_F(GltfAssets, AnimationsPlay) {
    const struct {
        const char* file;
        std::vector<std::string> names;
    } cases[] = {{"Fox.glb", {"Survey", "Walk", "Run"}}, {"MorphStressTest.gltf", {"Individuals", "Pulse", "TheWave"}}};
    for (const auto& [file, names] : cases) {
        GltfScene scene(kSharedAssets / "animation" / file);
        const WorldBounds rest = world_bounds(scene.at(0, {}));
        const double size = glm::distance(rest.lower, rest.upper);
        ASSERT_EQ(scene.animations().size(), names.size());
        for (std::size_t i = 0; i < names.size(); ++i) {
            const Animation& animation = scene.animations()[i];
            EXPECT_EQ(animation.name, names[i]);
            EXPECT_TRUE(scene.surfaces_move({&i, 1}));
            const Scene before = scene.at(0.3 * animation.end, {&i, 1}), after = scene.at(0.6 * animation.end, {&i, 1});
            EXPECT_NE(before.meshes.at(0).positions, after.meshes.at(0).positions) << file << " " << names[i];
            const WorldBounds bounds = world_bounds(after);
            EXPECT_LT(glm::distance(bounds.lower, rest.lower), size) << file << " " << names[i];
            EXPECT_LT(glm::distance(bounds.upper, rest.upper), size) << file << " " << names[i];
        }
    }
}

TEST_F(GltfAssets, InvalidFilesLoadOrAreRefusedWithTheReason) {
    const std::pair<const char*, const char*> reasons[] = {
        {"bad/lfs-buffers/", "Git LFS pointer"},
        {"bad/lfs-pointer/", "Git LFS pointer"},
        {"bad/truncated/", ": "},
        {"bad/gltf-validator/glb/truncated_chunk_data.glb", "truncated"},
        {"bad/gltf-validator/glb/chunk_too_big.glb", "damaged"},
        {"bad/gltf-validator/glb/invalid_magic.glb", "neither GLB nor"},
        {"bad/gltf-validator/mesh/unresolved_positions.gltf", "accessors"},
        {"bad/gltf-validator/accessor/unresolved_bufferviews.gltf", "bufferViews"},
    };
    std::set<std::string> found;
    for (const auto& entry : fs::recursive_directory_iterator(kSharedAssets / "bad")) {
        const fs::path& path = entry.path();
        if (path.extension() != ".glb" && path.extension() != ".gltf") continue;
        const std::string message = error_message([&] { load_gltf(path); });
        EXPECT_EQ(message.find('\n'), std::string::npos) << message;
        EXPECT_TRUE(message.empty() || message.starts_with(path.string() + ": ")) << message;
        for (const auto& [place, reason] : reasons) {
            if (path.string().find(place) == std::string::npos) continue;
            found.insert(place);
            EXPECT_NE(message.find(reason), std::string::npos) << path << ": " << message;
        }
    }
    EXPECT_EQ(found.size(), std::size(reasons));
}

/// Returns a scene with most features of the loader.
GltfBuilder rich_scene() {
    GltfBuilder b;
    Json& primitive = b.add_triangle();
    primitive["attributes"].update(
        {{"NORMAL", b.floats("VEC3", {0, 0, 1, 0, 0, 1, 0, 0, 1})},
         {"TEXCOORD_0", b.accessor("VEC2", kU16, std::vector<std::uint16_t>{0, 1, 2, 3, 4, 5}, true)},
         {"COLOR_0", b.floats("VEC4", std::vector<float>(12, 1))},
         {"JOINTS_0", b.accessor("VEC4", kU8, std::vector<std::uint8_t>(12, 0))},
         {"WEIGHTS_0", b.floats("VEC4", std::vector<float>(12, 0.25f))}});
    primitive["indices"] = b.accessor("SCALAR", kU16, std::vector<std::uint16_t>{0, 1, 2});
    primitive["targets"] = {{{"POSITION", 0}}};
    primitive["material"] =
        b.push("materials", {{"normalTexture", {{"index", 0}, {"texCoord", 0}}},
                             {"extensions", {{"KHR_materials_clearcoat", {{"clearcoatFactor", 1}}}}}});
    b.push("textures", {{"source", 0}, {"sampler", 0}});
    b.push("samplers", {{"wrapS", 33071}});
    b.push("images", {{"uri", kPng16}});
    b.json["meshes"][0]["weights"] = {0.5};
    b.make_sparse(0, {2}, {0, 2, 0});
    for (const char* part : {"indices", "values"}) b.json["accessors"][0]["sparse"][part]["byteOffset"] = 0;
    std::vector<float> bind(32, 0.0f);
    for (const std::size_t diagonal : {0u, 5u, 10u, 15u}) bind[diagonal] = bind[16 + diagonal] = 1;
    b.push("skins", {{"joints", {1, 2}}, {"inverseBindMatrices", b.floats("MAT4", bind)}});
    b.json["nodes"][0].update({{"skin", 0}, {"children", {1}}});
    b.push("nodes", {{"translation", {1, 2, 3}}, {"rotation", {0, 0, 0, 1}}, {"scale", {1, 2, 3}}, {"children", {2}}});
    b.push("nodes",
           {{"mesh", 0}, {"extensions", {{"EXT_mesh_gpu_instancing", {{"attributes", {{"TRANSLATION", 1}}}}}}}});
    b.push("nodes", {{"camera", 0}, {"extensions", {{"KHR_lights_punctual", {{"light", 0}}}}}});
    b.push("cameras",
           {{"type", "orthographic"}, {"orthographic", {{"xmag", 1}, {"ymag", 1}, {"znear", 1}, {"zfar", 2}}}});
    b.json["extensions"]["KHR_lights_punctual"]["lights"] = {
        {{"type", "spot"}, {"intensity", 2}, {"spot", {{"innerConeAngle", 0.1}, {"outerConeAngle", 0.2}}}}};
    b.push("scenes", {{"nodes", {0, 3}}});
    b.json["scene"] = 0;
    const int times = b.floats("SCALAR", {0, 1});
    b.push("animations", {{"name", "all"},
                          {"samplers",
                           {{{"input", times}, {"output", b.floats("VEC4", {0, 0, 0, 1, 0, 1, 0, 0})}},
                            {{"input", times}, {"output", b.floats("SCALAR", {0, 1})}, {"interpolation", "STEP"}},
                            {{"input", times},
                             {"output", b.floats("VEC3", std::vector<float>(18, 1))},
                             {"interpolation", "CUBICSPLINE"}}}},
                          {"channels",
                           {{{"sampler", 0}, {"target", {{"node", 1}, {"path", "rotation"}}}},
                            {{"sampler", 1}, {"target", {{"node", 2}, {"path", "weights"}}}},
                            {{"sampler", 2}, {"target", {{"node", 3}, {"path", "translation"}}}}}}});
    b.add_buffer();
    return b;
}

class GltfFuzz : public GltfTest {
  protected:
    /// Loads and poses a file. Its errors must be one line, and its scenes pass validate(), which loading calls.
    void read(const std::string& glb) {
        std::optional<GltfScene> scene;
        const std::filesystem::path path = write("scene.glb", glb);
        const std::string refusal = without_name(error_message([&] {
            scene.emplace(path);
            scene->at_rest();
        }));
        if (!refusal.empty()) return;
        ++loaded_;
        moved_ += without_name(error_message([&] {
                      for (std::size_t i = 0; i < scene->animations().size(); ++i) scene->at(0.5, {&i, 1});
                  })).empty();
    }

    std::size_t loaded_ = 0, moved_ = 0;
};

TEST_F(GltfFuzz, TheUndamagedSceneLoads) {
    const Scene scene = load(rich_scene());
    EXPECT_EQ(scene.instances.size(), 4u);
    EXPECT_EQ(scene.lights.size() + scene.cameras.size() + scene.images.size(), 3u);
    read(rich_scene().glb());
    EXPECT_EQ(moved_, 1u);
}

/// Each leaf takes numbers of all kinds of use, and the other types of JSON. The first two buffer views stand for all.
TEST_F(GltfFuzz, PropertiesOfAnyValue) {
    const GltfBuilder whole = rich_scene();
    const Json values = Json::parse(
        R"([0, 2, -1, 5126, 4294967295, 18446744073709551615, 1e300, true, null, "VEC4", [], {}, [0, 0, 0, 0]])");
    const Json leaves = whole.json.flatten();
    for (const auto& [pointer, leaf] : leaves.items()) {
        if (pointer.starts_with("/bufferViews/") && std::stoi(pointer.substr(13)) > 1) continue;
        for (const Json& value : values) {
            GltfBuilder b = whole;
            b.put(pointer, value);
            read(b.glb());
        }
    }
    EXPECT_GT(moved_, 100u);
    EXPECT_GT(loaded_, moved_) << "damaged animations do not affect the rest pose";
}

}  // namespace
}  // namespace halflight
