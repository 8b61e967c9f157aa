// Tests that scenes of other projects load and render without a GL error, and without NaN or infinity in any output.
#include <algorithm>
#include <filesystem>

#include "engine/io/environment.h"
#include "engine/io/gltf/gltf.h"
#include "renderer/render.h"
#include "tests/support/gpu_test.h"

namespace halflight {
namespace {

namespace fs = std::filesystem;

std::vector<fs::path> scenes_under(const fs::path& folder) {
    std::vector<fs::path> found;
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder)) {
        const fs::path& path = entry.path();
        const bool bad = fs::relative(path, folder).begin()->string() == "bad";
        if (!bad && (path.extension() == ".gltf" || path.extension() == ".glb")) found.push_back(path);
    }
    std::sort(found.begin(), found.end());
    return found;
}

class Assets : public GpuTest {};

TEST_F(Assets, LoadAndRenderCleanly) {
    const fs::path folder = fs::path(HALFLIGHT_SHARED_DIR) / "assets";
    if (!fs::exists(folder)) GTEST_SKIP() << "no folder of other projects' scenes at " << folder;
    const std::vector<fs::path> scenes = scenes_under(folder);
    ASSERT_GE(scenes.size(), 30u);

    const ColorConfig colors = ColorConfig::load();
    RenderSettings settings;
    settings.width = 96, settings.height = 54, settings.samples = 2;
    settings.want_view = true;
    for (const AovInfo& aov : known_aovs()) settings.aovs.emplace_back(aov.name);

    for (const fs::path& file : scenes) {
        const std::string name = fs::relative(file, folder).string();
        SCOPED_TRACE(name);
        Scene scene = load_gltf(file);
        // A sky is also added if the only light is a small lamp, so that everything is visible.
        if (scene.lights.empty() && scene.environment.black()) scene.environment = default_sky();
        settings.camera = scene.cameras.empty() ? framing_camera(scene) : scene.cameras.front();
        RenderResult result;
        ASSERT_NO_THROW(result = Renderer(context, scene, colors, settings).render());
        EXPECT_NO_THROW(context.check(name));

        EXPECT_EQ(count_non_finite(result.beauty).nans + count_non_finite(result.beauty).infinities, 0u);
        double light = 0;
        for (float v : result.beauty.pixels) light += v;
        EXPECT_GT(light, 0);
        for (const ExrLayer& layer : result.aovs) {
            if (layer.type == ExrType::uint32) continue;
            const NonFinite bad = count_non_finite(layer.image);
            EXPECT_EQ(bad.nans, 0u) << layer.channels.front();
            EXPECT_EQ(bad.infinities, 0u) << layer.channels.front();
        }
        for (const BadValues& n : result.stats.bad_values) EXPECT_EQ(n.total(), 0u) << n.component;
    }
}

}  // namespace
}  // namespace halflight
