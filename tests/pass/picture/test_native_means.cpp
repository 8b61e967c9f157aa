// Tests that native non-local means filter as the shader does.
#include <gtest/gtest.h>

#include <random>

#include "engine/graph/execute.h"
#include "passes/picture/native_means.h"
#include "tests/pass/picture/pixels.h"
#include "tests/support/gpu_test.h"

namespace halflight::test {
namespace {

using Access = graph::Access;

/// Inputs in the order of MeansInput.
struct Pictures {
    ivec2 size;
    std::array<std::vector<float>, 5> of;
};
constexpr std::array kNames = {"light", "first", "second", "guide", "reflectance"};

class NativeMeansTest : public GpuTest {
  protected:
    std::mt19937 random{7};

    /// Returns noisy surfaces with steps of brightness, normals and albedo, and with holes that are not filtered.
    Pictures noisy(ivec2 size, float brightness) {
        std::exponential_distribution<float> noise(1);
        std::uniform_real_distribution<float> uniform(0, 1);
        Pictures p{size, {}};
        for (const auto& [x, y] : pixels_of(size)) {
            const float share = uniform(random) < 0.1f ? 0.0f : uniform(random) < 0.5f ? 0.5f : 1.0f / 3.0f;
            const float level = brightness * (x > y ? 3.0f : 1.0f);
            const vec4 one(level * noise(random), level * noise(random), level, share);
            const vec4 two(level * noise(random), level * noise(random), level, 0);
            const float variance = 0.5f * level * level * (0.1f + uniform(random));
            const vec4 texels[] = {{one.x, two.x, variance, share},
                                   one,
                                   two,
                                   {0.05f * uniform(random), x > size.x / 2 ? 1.0f : 0.8f, 0, 0.02f * noise(random)},
                                   {0.5f, y > size.y / 2 ? 0.5f : 0.4f, uniform(random), x % 7 == 0 ? 1.0f : 0.0f}};
            for (std::size_t i = 0; i < p.of.size(); ++i)
                for (int c = 0; c < 4; ++c) p.of[i].push_back(texels[i][c]);
        }
        return p;
    }

    static std::array<std::vector<float>, 2> native(const Pictures& p, const MeansKernel& kernel) {
        std::array<std::vector<float>, 2> out;
        for (auto& half : out) half.resize(p.of[0].size());
        filter_natively(kernel, p.size, {p.of[0], p.of[1], p.of[2], p.of[3], p.of[4]}, {out[0], out[1]});
        return out;
    }

    std::array<std::vector<float>, 2> by_shader(const Pictures& p, const MeansKernel& kernel) {
        const gpu::TextureDesc desc{p.size.x, p.size.y, GL_RGBA32F};
        graph::Graph graph;
        graph::Pass pass = graph.add_pass("non-local means");
        std::vector<gpu::Texture> inputs;
        inputs.reserve(kNames.size());
        for (std::size_t i = 0; i < kNames.size(); ++i) {
            inputs.emplace_back(kNames[i], desc).upload(p.of[i]);
            pass.read(graph.import_texture(kNames[i], inputs.back()), Access::texture_read, kNames[i]);
        }
        gpu::Texture first("first", desc), second("second", desc);
        graph.output(pass.write(graph.import_texture("first", first), Access::image_write, "filtered_first"));
        graph.output(pass.write(graph.import_texture("second", second), Access::image_write, "filtered_second"));
        pass.execute([&](graph::Resources& r) {
            gpu::Defines defines;
            if (kernel.patch == 1) defines.set("HALFLIGHT_PREVIEW");
            const gpu::Program& program = r.kernel({"shaders/nl_means.comp", defines});
            if (kernel.patch == 1) program.set("stride", kernel.stride);
            program.dispatch(static_cast<std::uint32_t>((p.size.x + 31) / 32),
                             static_cast<std::uint32_t>((p.size.y + 31) / 32));
        });
        graph::Executor executor(programs);
        executor.run(graph::compile(graph));
        return {first.read_float(), second.read_float()};
    }

    gpu::ProgramCache programs;
};

TEST_F(NativeMeansTest, EqualTheShaderUpToRounding) {
    const std::pair<ivec2, float> pictures[] = {{{1, 1}, 1.0f},     {{5, 3}, 1.0f},   {{64, 16}, 1.0f},
                                                {{65, 17}, 1e-12f}, {{65, 17}, 1.0f}, {{65, 17}, 1e12f},
                                                {{100, 70}, 1.0f}};
    for (const MeansKernel& kernel : {kFinalMeans, small_means(1), small_means(2), small_means(8)}) {
        for (const auto& [size, brightness] : pictures) {
            const Pictures p = noisy(size, brightness);
            const auto ours = native(p, kernel), theirs = by_shader(p, kernel);
            for (std::size_t half = 0; half < 2; ++half)
                for (std::size_t i = 0; i < ours[half].size(); ++i)
                    ASSERT_NEAR(ours[half][i], theirs[half][i], 2e-4f * (i % 4 == 3 ? 1.0f : brightness))
                        << size.x << "x" << size.y << ", value " << i << ", patch " << kernel.patch;
        }
    }
}

}  // namespace
}  // namespace halflight::test
