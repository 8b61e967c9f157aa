// Tests the oracle against Blender's Cycles, which shares no code with it; skipped if Blender is missing.
#include <gtest/gtest.h>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <random>

#include "engine/io/exr.h"
#include "engine/io/files.h"
#include "engine/io/gltf/gltf.h"
#include "engine/io/png.h"
#include "tests/support/image_tests.h"
#include "tests/support/process.h"
#include "tests/support/reference_renders.h"
#include "tests/unit/io/gltf_builder.h"

namespace halflight {
namespace {

using namespace test;

constexpr int kSize = 64;      // pixels
constexpr int kSamples = 512;  // per pixel, in both renderers
constexpr int kBounces = 8;

/// Renders with Cycles into `output`; returns false if Blender is missing.
bool render_with_cycles(const std::filesystem::path& scene, const std::filesystem::path& output) {
    const std::filesystem::path script = std::filesystem::path(HALFLIGHT_SHARED_DIR) / "peers/cycles_render.py";
    if (!std::filesystem::exists(script) || run({"sh", "-c", "command -v blender"}).status != 0) return false;
    const Outcome outcome =
        run({"blender", "-b", "--factory-startup", "-P", HALFLIGHT_SOURCE_DIR "/tools/figures/cycles_materials.py",
             "-P", script, "--", scene, output, "--spp", std::to_string(kSamples), "--size",
             fmt::format("{0}x{0}", kSize), "--bounces", std::to_string(kBounces - 1)});
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    return std::filesystem::exists(output);
}

void compare(const std::filesystem::path& path) {
    const std::string name = path.stem();
    const TemporaryFolder folder;
    const std::filesystem::path output = folder / "cycles.exr";
    if (!render_with_cycles(path, output)) GTEST_SKIP() << "needs blender and ../shared/peers/cycles_render.py";
    const Scene scene = load_gltf(path);
    ASSERT_FALSE(scene.cameras.empty());
    const ReferenceResult oracle = render_oracle(scene, scene.cameras[0], kSize, kSamples, kBounces);
    const Image cycles = read_exr(output).image({"R", "G", "B"});
    ASSERT_EQ(cycles.width, kSize);

    // Cycles does not report its variance. The variance of independent samples is an upper bound.
    const Estimate ours{oracle.beauty, oracle.variance, kSamples}, theirs{cycles, oracle.variance, kSamples};
    const ZTest whole = compare_means(ours, theirs, 16);
    std::string report = describe(whole);
    EXPECT_LE(std::abs(whole.relative_difference), 0.01 + 2 * whole.relative_error) << report;

    double greatest = 0;
    for (int y = 0; y < kSize; y += 16) {
        for (int x = 0; x < kSize; x += 16) {
            double sum = 0, difference = 0, variance = 0;
            for (int i = 0; i < 16 * 16; ++i) {
                for (int c = 0; c < 3; ++c) {
                    const int px = x + i % 16, py = y + i / 16;
                    sum += cycles.at(px, py)[c];
                    difference += oracle.beauty.at(px, py)[c] - cycles.at(px, py)[c];
                    // Channels are correlated, and both sides have noise.
                    variance += 3 * 2 * oracle.variance.at(px, py)[c] / kSamples;
                }
            }
            greatest = std::max(greatest, std::abs(difference / sum));
            EXPECT_LE(std::abs(difference), 0.02 * sum + 3 * std::sqrt(variance)) << "block at " << x << ", " << y;
        }
    }
    report += fmt::format("; greatest difference of a 16x16 block {:.2f} %", 100 * greatest);
    if (::testing::Test::HasFailure()) {
        ADD_FAILURE() << report << "; " << save_failure("cycles-" + name, oracle.beauty, cycles, whole.z);
    }
    std::cout << report << '\n';
}

std::filesystem::path own_scene(const char* name) {
    return std::filesystem::path(HALFLIGHT_SOURCE_DIR) / "scenes" / name;
}

/// Returns a quad below a lamp, whose material has vertex colours, a normal map, and textures of base colour, roughness
/// and metal. All textures are transformed and repeat mirrored.
GltfBuilder textured_quad(const std::filesystem::path& folder) {
    GltfBuilder b;
    std::mt19937 random(1);
    const auto add_texture = [&](const std::string& file, int least, int most, int blue) {
        std::uniform_int_distribution<int> any(least, most);
        std::vector<std::uint8_t> texels(8 * 8 * 3);
        for (std::size_t i = 0; i < texels.size(); ++i)
            texels[i] = static_cast<std::uint8_t>(i % 3 == 2 && blue > 0 ? blue : any(random));
        write_png(folder / file, 8, 8, 3, texels);
        const int texture = b.push("textures", {{"source", b.push("images", {{"uri", file}})}, {"sampler", 0}});
        return Json{{"index", texture},
                    {"extensions", {{"KHR_texture_transform", {{"rotation", 0.4}, {"scale", {1.5, 0.8}}}}}}};
    };
    b.push("samplers", {{"wrapS", 33648}, {"wrapT", 33071}});
    b.push("materials", {{"pbrMetallicRoughness",
                          {{"baseColorTexture", add_texture("color.png", 30, 255, 0)},
                           {"metallicRoughnessTexture", add_texture("rough.png", 80, 255, 0)}}},
                         {"normalTexture", add_texture("normal.png", 80, 175, 240)},
                         {"doubleSided", true}});
    b.push("materials", {{"emissiveFactor", {1, 1, 1}},
                         {"doubleSided", true},
                         {"pbrMetallicRoughness", {{"baseColorFactor", {0, 0, 0, 1}}}},
                         {"extensions", {{"KHR_materials_emissive_strength", {{"emissiveStrength", 5}}}}}});
    const auto quad = [&](float half, float y, float up, const char* attribute, int values) {
        const Json attributes = {
            {"POSITION", b.floats("VEC3", {-half, y, half, half, y, half, half, y, -half, -half, y, -half})},
            {"NORMAL", b.floats("VEC3", {0, up, 0, 0, up, 0, 0, up, 0, 0, up, 0})},
            {"TEXCOORD_0", b.floats("VEC2", {0, 1, 1, 1, 1, 0, 0, 0})},
            {attribute, values}};
        Json& primitive = b.add_mesh(attributes);
        primitive["indices"] = b.accessor<std::uint32_t>("SCALAR", kU32, {0, 1, 2, 0, 2, 3});
        return &primitive;
    };
    const int colors = b.floats("VEC3", {1, 0.2f, 0.4f, 0.3f, 1, 0.5f, 0.9f, 0.9f, 0.2f, 0.4f, 0.6f, 1});
    (*quad(1, 0, 1, "COLOR_0", colors))["material"] = 0;
    (*quad(0.5f, 1, -1, "COLOR_0", colors))["material"] = 1;
    b.add_perspective_camera();
    b.push("nodes", {{"camera", 0}, {"translation", {0, 0.9, 2}}, {"rotation", {-0.2079, 0, 0, 0.9781}}});
    b.json["extensionsUsed"] = {"KHR_texture_transform", "KHR_materials_emissive_strength"};
    return b;
}

TEST(ReferenceAgainstCycles, DiffuseCornellBox) {
    compare(own_scene("cornell.glb"));
}

TEST(ReferenceAgainstCycles, TexturesAndVertexColors) {
    const TemporaryFolder folder;
    write_file(folder / "textured.glb", textured_quad(folder.path).glb());
    compare(folder / "textured.glb");
}

// Uses our material model, which tools/figures/cycles_materials.py builds of Cycles nodes. The importer's materials are
// up to 4 % darker.
TEST(ReferenceAgainstCycles, MetalCornellBox) {
    compare(own_scene("cornell-metal.glb"));
}

}  // namespace
}  // namespace halflight
