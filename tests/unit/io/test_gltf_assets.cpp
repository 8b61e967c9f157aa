// Tests files of other projects. Valid files load completely; invalid files load, or are refused in one line.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "engine/io/gltf/gltf.h"
#include "tests/support/error_message.h"

namespace halflight {
namespace {

namespace fs = std::filesystem;

const fs::path kAssets = fs::path(HALFLIGHT_SHARED_DIR) / "assets";

class GltfAssets : public testing::Test {
  protected:
    void SetUp() override {
        if (!fs::exists(kAssets)) GTEST_SKIP() << "no assets in " << kAssets;
    }
};

std::size_t count_triangles(const Scene& scene) {
    std::size_t count = 0;
    for (const Instance& i : scene.instances) count += scene.meshes[static_cast<std::size_t>(i.mesh)].triangles.size();
    return count;
}

std::vector<fs::path> scenes_below(const fs::path& folder) {
    std::vector<fs::path> paths;
    for (const auto& entry : fs::recursive_directory_iterator(folder)) {
        if (entry.path().extension() == ".glb" || entry.path().extension() == ".gltf") paths.push_back(entry.path());
    }
    return paths;
}

TEST_F(GltfAssets, LoadWithAllTheirTriangles) {
    // Lines of STATS.txt look like "path sizeMB ... instTri=123 ... inst=4 ..."; another program wrote them.
    std::ifstream stats(kAssets / "STATS.txt");
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
        const Scene scene = load_gltf(kAssets / path);
        const std::size_t dropped =
            scene.report.degenerate_triangles_dropped + scene.report.non_finite_triangles_dropped;
        EXPECT_EQ(count_triangles(scene) + dropped, counts["instTri"]) << path;
        EXPECT_EQ(scene.lights.size(), counts["lightNodes"]) << path;
        EXPECT_EQ(scene.cameras.size(), counts["cam"]) << path;
    }
    EXPECT_GE(loaded, 30u);
}

TEST_F(GltfAssets, SelectedFilesInDetail) {
    const Scene instanced = load_gltf(kAssets / "instancing/simple-instancing.glb");
    EXPECT_EQ(instanced.meshes.size(), 1u);
    EXPECT_EQ(instanced.instances.size(), 125u);
    EXPECT_EQ(count_triangles(instanced), 1500u);

    const Scene room = load_gltf(kAssets / "interior/living_room/living_room.glb");
    EXPECT_EQ(room.report.degenerate_triangles_dropped, 3537u) << "its exporter left two thirds of a mesh collapsed";

    const Scene modes = load_gltf(kAssets / "materials/PrimitiveModeNormalsTest.glb");
    EXPECT_EQ(modes.report.point_primitives_skipped, 8u);
    EXPECT_EQ(modes.report.line_primitives_skipped, 8u);

    const Scene lights = load_gltf(kAssets / "lights/Lights.glb");
    ASSERT_EQ(lights.lights.size(), 4u);
    EXPECT_EQ(lights.cameras.size(), 1u);

    const Scene normals = load_gltf(kAssets / "materials/NormalTangentTest.glb");
    EXPECT_EQ(normals.report.tangents_generated, normals.meshes.at(0).tangents.size());
}

/// The Fox stands on its feet, in centimetres. Without skinning it would lie around its joints.
TEST_F(GltfAssets, SkinnedFoxFollowsItsJoints) {
    const Scene fox = load_gltf(kAssets / "animation/Fox.glb");
    const WorldBounds bounds = world_bounds(fox);
    EXPECT_NEAR(bounds.lower.y, 0, 1);
    EXPECT_NEAR(bounds.upper.y, 79, 1);
    EXPECT_NEAR(bounds.upper.z - bounds.lower.z, 155, 2);
}

/// The upper end of the bar follows the second joint, at (0, 1, 0), which has turned by 90 degrees after one second.
TEST_F(GltfAssets, SimpleSkinBends) {
    GltfScene scene(kAssets / "animation/SimpleSkin/SimpleSkin.gltf");
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
        GltfScene scene(kAssets / "animation" / file);
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

TEST_F(GltfAssets, InvalidFilesNeverCrash) {
    const std::vector<fs::path> scenes = scenes_below(kAssets / "bad");
    EXPECT_GT(scenes.size(), 20u);
    for (const fs::path& path : scenes) {
        const std::string message = error_message([&] { load_gltf(path); });
        EXPECT_EQ(message.find('\n'), std::string::npos) << message;
        EXPECT_TRUE(message.empty() || message.starts_with(path.string() + ": ")) << message;
    }
}

TEST_F(GltfAssets, InvalidFilesAreRefusedWithTheReason) {
    const struct {
        const char* folder;
        const char* reason;
    } cases[] = {
        {"lfs-buffers", "Git LFS pointer"},
        {"lfs-pointer", "Git LFS pointer"},
        {"truncated", ""},
        {"gltf-validator/glb/truncated_chunk_data.glb", "truncated"},
        {"gltf-validator/glb/chunk_too_big.glb", "damaged"},
        {"gltf-validator/glb/invalid_magic.glb", "neither GLB nor"},
        {"gltf-validator/mesh/unresolved_positions.gltf", "accessors"},
        {"gltf-validator/accessor/unresolved_bufferviews.gltf", "bufferViews"},
    };
    for (const auto& [folder, reason] : cases) {
        const fs::path path = kAssets / "bad" / folder;
        const std::vector<fs::path> scenes = fs::is_directory(path) ? scenes_below(path) : std::vector{path};
        EXPECT_FALSE(scenes.empty()) << path;
        for (const fs::path& scene : scenes) {
            const std::string message = error_message([&] { load_gltf(scene); });
            EXPECT_FALSE(message.empty()) << scene;
            EXPECT_NE(message.find(reason), std::string::npos) << message;
        }
    }
}

}  // namespace
}  // namespace halflight
