// The pass that the README builds, taken from there, does what it says.
#include <gtest/gtest.h>

#include <cstdlib>

#include "engine/graph/compile.h"
#include "engine/graph/execute.h"
#include "engine/graph/graph.h"
#include "tests/support/gpu_test.h"

namespace halflight {
namespace {

#include <grey.cpp>

using Readme = GpuTest;

TEST_F(Readme, PassTakesTheColourOut) {
    setenv("HALFLIGHT_SHADERS", README_FOLDER, 1);

    gpu::Texture picture("picture", {.width = 3, .height = 2, .format = GL_RGBA32F});
    std::vector<float> pixels(3 * 2 * 4);
    for (std::size_t i = 0; i < pixels.size(); ++i) pixels[i] = static_cast<float>(i);
    picture.upload(std::span<const float>(pixels));

    graph::Graph g;
    const graph::TextureHandle grey = add_grey(g, g.import_texture("picture", picture));
    g.output(grey);
    gpu::ProgramCache programs;
    graph::Executor executor(programs);
    const graph::CompiledGraph compiled = compile(g);
    executor.run(compiled);

    const std::vector<float> result = executor.texture(grey).read_float();
    ASSERT_EQ(result.size(), pixels.size());
    for (std::size_t i = 0; i < pixels.size(); i += 4) {
        const float expected = 0.2126f * pixels[i] + 0.7152f * pixels[i + 1] + 0.0722f * pixels[i + 2];
        for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(result[i + c], expected, 1e-5f * (1 + expected));
        EXPECT_EQ(result[i + 3], pixels[i + 3]);
    }
}

}  // namespace
}  // namespace halflight
