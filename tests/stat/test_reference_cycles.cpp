// Tests the oracle against Blender's Cycles, which shares no code with it; skipped where Blender is missing.
#include <gtest/gtest.h>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iostream>

#include "engine/io/exr.h"
#include "engine/io/gltf/gltf.h"
#include "tests/support/image_tests.h"
#include "tests/support/process.h"
#include "tests/support/reference_renders.h"

namespace halflight {
namespace {

using namespace test;

constexpr int kSize = 64;      // pixels
constexpr int kSamples = 512;  // per pixel, in both renderers
constexpr int kBounces = 8;

/// Renders with Cycles into `output`; returns false where Blender is missing.
bool render_with_cycles(const std::filesystem::path& scene, const std::filesystem::path& output) {
    const std::filesystem::path script = std::filesystem::path(HALFLIGHT_SHARED_DIR) / "peers/cycles_render.py";
    if (!std::filesystem::exists(script) || run({"sh", "-c", "command -v blender"}).status != 0) return false;
    const Outcome outcome =
        run({"blender", "-b", "--factory-startup", "-P", HALFLIGHT_SOURCE_DIR "/tools/cycles_materials.py", "-P",
             script, "--", scene, output, "--spp", std::to_string(kSamples), "--size", fmt::format("{0}x{0}", kSize),
             "--bounces", std::to_string(kBounces - 1)});
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    return std::filesystem::exists(output);
}

void compare(const std::string& name) {
    const std::filesystem::path path = std::filesystem::path(HALFLIGHT_SOURCE_DIR) / "scenes" / (name + ".glb");
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

TEST(ReferenceAgainstCycles, DiffuseCornellBox) {
    compare("cornell");
}

// Uses our material model, which tools/cycles_materials.py builds of Cycles nodes. The importer's materials are up to 4
// % darker.
TEST(ReferenceAgainstCycles, MetalCornellBox) {
    compare("cornell-metal");
}

}  // namespace
}  // namespace halflight
