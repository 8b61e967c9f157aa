// Tests the pass of docs/adding-a-pass.md: alone, and in whole pictures through renderer/render_develop.cpp.
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <vector>

#include "engine/color/color.h"
#include "engine/graph/compile.h"
#include "engine/graph/execute.h"
#include "engine/io/gltf/gltf.h"
#include "passes/picture/grey.h"
#include "renderer/render.h"
#include "tests/support/gpu_test.h"

namespace halflight {
namespace {

namespace fs = std::filesystem;

/// Fixture whose shader folder holds the checkout's shaders and the one of the page.
class Grey : public GpuTest {
  protected:
    Grey() {
        fs::remove_all(folder);
        fs::create_directories(folder);
        fs::copy(HALFLIGHT_SOURCE_DIR "/shaders", folder, fs::copy_options::recursive);
        fs::copy(PAGE_FOLDER "/shaders/grey.comp", folder);
        setenv("HALFLIGHT_SHADERS", folder.c_str(), 1);
    }
    ~Grey() override { fs::remove_all(folder); }

    fs::path folder = fs::path(PAGE_FOLDER) / "all" / "shaders";
};

#include <grey_test.inc>

TEST_F(Grey, TakesTheColourOutOfTheView) {
    const Scene scene = load_gltf(HALFLIGHT_SOURCE_DIR "/scenes/cornell.glb");
    RenderSettings settings;
    settings.camera = scene.cameras.at(0);
    settings.width = settings.height = 16;
    settings.samples = 2;
    settings.want_view = true;
    Renderer renderer(context, scene, ColorConfig::load({}), settings);
    const RenderResult result = renderer.render();

    int coloured = 0;
    for (int y = 0; y < 16; ++y) {
        for (int x = 0; x < 16; ++x) {
            const auto view = result.view.at(x, y), linear = result.beauty.at(x, y);
            EXPECT_EQ(view[0], view[1]);
            EXPECT_EQ(view[1], view[2]);
            if (linear[0] != linear[1]) ++coloured;
        }
    }
    EXPECT_GT(coloured, 50);
}

}  // namespace
}  // namespace halflight
