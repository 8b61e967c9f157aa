// Tests the pass of docs/adding-a-pass.md in whole pictures, through renderer/render_develop.cpp. The page's own test
// of the pass is part of this program.
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <vector>

#include "engine/color/color.h"
#include "engine/io/gltf/gltf.h"
#include "renderer/render.h"
#include "tests/support/gpu_test.h"

namespace halflight {
namespace {

namespace fs = std::filesystem;

/// Makes a shader folder of the checkout's shaders and the one of the page.
class Shaders : public testing::Environment {
    void SetUp() override {
        fs::remove_all(folder_);
        fs::create_directories(folder_);
        fs::copy(HALFLIGHT_SOURCE_DIR "/shaders", folder_, fs::copy_options::recursive);
        fs::copy(PAGE_FOLDER "/shaders/grey.comp", folder_);
        setenv("HALFLIGHT_SHADERS", folder_.c_str(), 1);
    }
    void TearDown() override { fs::remove_all(folder_); }

    fs::path folder_ = fs::path(PAGE_FOLDER) / "all" / "shaders";
};

const testing::Environment* const shaders = testing::AddGlobalTestEnvironment(new Shaders);

using GreyPicture = GpuTest;

TEST_F(GreyPicture, HasNoColour) {
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
