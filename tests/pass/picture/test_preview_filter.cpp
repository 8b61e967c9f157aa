// Tests the preview filter on planes with synthetic noise: edges, fireflies, and its fading with many samples.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "passes/picture/denoiser.h"
#include "passes/preview/preview_texels.h"
#include "shaders/shared/preview_constants.h"
#include "tests/pass/picture/pixels.h"
#include "tests/pass/picture/preview_scene.h"

namespace halflight::test {
namespace {

constexpr ivec2 kSize(64, 48);
constexpr int kEdge = 32;  // column of the edge

/// Light over albedo, row by row; the alpha is 0 where nothing was filtered.
using Light = std::vector<vec4>;

class PreviewFilterTest : public PassTest {
  protected:
    Light filtered(const TexelData& data) {
        graph::Graph graph;
        TexelTextures texels(data);
        std::vector<vec4> white;
        for (const vec4& light : data.first) white.emplace_back(light.w < 0 ? vec4(0) : vec4(1));
        gpu::Texture albedo = texture_of(white, data.size);
        const PreviewTexels imported = texels.import(graph);
        const graph::TextureHandle of_light = graph.import_texture("albedo", albedo);
        const LightHalves halves = add_preview_halves(graph, imported, of_light);
        const FilteredHalves out = add_preview_filter(graph, halves, imported.guide, of_light);
        for (const graph::TextureHandle handle : {out.first, out.second, out.spread}) graph.output(handle);
        run(graph);
        const std::vector<vec4> first = texels_of(executor.texture(out.first)),
                                second = texels_of(executor.texture(out.second)),
                                spread = texels_of(executor.texture(out.spread));
        Light light;
        for (std::size_t i = 0; i < first.size(); ++i) {
            const float share = first[i].w;
            light.emplace_back(glm::mix(vec3(second[i]), vec3(first[i]), share) + vec3(spread[i]), share);
        }
        return light;
    }
    /// Returns noise around 5 left of the edge and around 6 right of it, with one plane per side. samples: 1 makes one
    /// half, more make two.
    TexelData two_sides(const Plane& left, const Plane& right, float samples, float of_right = 6) {
        std::uniform_real_distribution<float> noise(-3, 3);
        const auto light = [&](int x, int, const vec3&) { return vec3((x < kEdge ? 5 : of_right) + noise(random)); };
        TexelData data = seen_planes(
            frame, [&](int x, int) { return x < kEdge ? left : right; }, light, samples);
        if (samples == 1) return data;
        for (std::size_t i = 0; i < data.first.size(); ++i) {
            const int x = static_cast<int>(i) % kSize.x;
            data.first[i].w = samples / 2, data.second[i] = vec4(light(x, 0, {}), samples / 2);
        }
        return data;
    }

    const shared::Frame frame = constants_of(camera_at({0, 0, 0}), kSize);
    std::mt19937 random{7};
};

/// Returns the mean of the squared error of columns [from, to).
double error_of(const Light& light, int from, int to, float truth) {
    double sum = 0;
    for (const auto& [x, y] : pixels_of({from, 0}, {to, kSize.y})) {
        const double error = light[std::size_t(y * kSize.x + x)].x - truth;
        sum += error * error / (kSize.y * (to - from));
    }
    return sum;
}
/// Returns the mean of columns [from, to).
double mean_of(const Light& light, int from, int to) {
    double sum = 0;
    for (const auto& [x, y] : pixels_of({from, 0}, {to, kSize.y}))
        sum += double{light[std::size_t(y * kSize.x + x)].x} / (kSize.y * (to - from));
    return sum;
}

TEST_F(PreviewFilterTest, AConstantStays) {
    for (const ivec2 size : {ivec2(1, 1), ivec2(1, 70), ivec2(33, 2), kSize}) {
        for (const float value : {0.0f, 0.3f, 1e30f}) {
            const TexelData data = seen_planes(
                constants_of(camera_at({0, 0, 0}), size), [](int, int) { return Plane{}; },
                [&](int, int, const vec3&) { return vec3(value, 2 * value, 0); }, 1);
            const Light light = filtered(data);
            for (const vec4& l : light) {
                if (size == ivec2(1, 1))
                    ASSERT_EQ(l.w, 0) << "one pixel has no neighbours";
                else
                    ASSERT_GT(l.w, 0);
                ASSERT_NEAR(l.x, l.w > 0 ? value : 0, 1e-5f * value);
                ASSERT_NEAR(l.y, l.w > 0 ? 2 * value : 0, 2e-5f * value);
                ASSERT_EQ(l.z, 0);
            }
        }
    }
}

TEST_F(PreviewFilterTest, NoiseOfOneSurfaceIsRemoved) {
    for (const float samples : {1.0f, 8.0f}) {
        const Light smooth = filtered(two_sides({}, {}, samples, 5));
        EXPECT_LT(error_of(smooth, 0, kSize.x, 5), 0.05 * 3) << samples << " samples";
        EXPECT_NEAR(mean_of(smooth, 0, kSize.x), 5, 0.1);
        for (const vec4& light : smooth) ASSERT_GT(light.w, 0);
    }
}

TEST_F(PreviewFilterTest, NothingIsMixedAcrossAnEdge) {
    const Plane wall;
    const vec3 turned = glm::normalize(vec3(1, 0, 1));
    const Plane nearer{{0, 0, 1}, -3};          // parallel to the wall, with a gap
    const Plane corner{turned, -5 * turned.z};  // touches the other plane at x = 0, at the edge
    for (const float samples : {1.0f, 8.0f}) {
        for (const Plane& right : {nearer, corner}) {
            const Light smooth = filtered(two_sides(wall, right, samples));
            EXPECT_NEAR(mean_of(smooth, kEdge - 4, kEdge), 5, 0.25);
            EXPECT_NEAR(mean_of(smooth, kEdge, kEdge + 4), 6, 0.25);
        }
        // Light alone shows an edge that noise cannot explain.
        const Light smooth = filtered(two_sides(wall, wall, samples, 40));
        EXPECT_NEAR(mean_of(smooth, kEdge - 4, kEdge - 1), 5, 1);
        EXPECT_NEAR(mean_of(smooth, kEdge + 1, kEdge + 4), 40, 1);
    }
}

TEST_F(PreviewFilterTest, ConvergedTexelsAreKept) {
    TexelData data = two_sides({}, {}, 64);
    data.second = data.first;
    const Light light = filtered(data);
    for (std::size_t i = 0; i < light.size(); ++i) ASSERT_NEAR(light[i].x, data.first[i].x, 0.02f);
}

TEST_F(PreviewFilterTest, FirefliesAreSpread) {
    TexelData data = two_sides({}, {}, 8, 5);
    const double before = 5;
    data.light_at(20, 20) = vec4(vec3(4000), data.light_at(20, 20).w);
    const Light light = filtered(data);
    float most = 0;
    for (const vec4& l : light) most = std::max(most, l.x);
    EXPECT_LT(most, 40) << "half of 4000 without a filter";
    EXPECT_NEAR(mean_of(light, 0, kSize.x), before + 2000.0 / (kSize.x * kSize.y), 0.1) << "no light is lost";
}

TEST_F(PreviewFilterTest, TheBackgroundIsLeftOut) {
    for (const float samples : {1.0f, 8.0f}) {
        TexelData data = two_sides({}, {}, samples);
        for (const auto& [x, y] : pixels_of({kEdge, 0}, {kSize.x, kSize.y})) {
            const auto i = std::size_t(y * kSize.x + x);
            data.first[i] = data.second[i] = vec4(0, 0, 0, -1), data.guide[i] = vec4(0);
        }
        const Light light = filtered(data);
        EXPECT_NEAR(mean_of(light, kEdge - 4, kEdge), 5, 0.4);
        for (const auto& [x, y] : pixels_of({kEdge, 0}, {kSize.x, kSize.y}))
            ASSERT_EQ(light[std::size_t(y * kSize.x + x)].w, 0);
    }
}

TEST_F(PreviewFilterTest, WithManySamplesThePictureIsTheMean) {
    auto random_texels = [this](float a) {
        std::vector<vec4> all(std::size_t(kSize.x * kSize.y));
        std::uniform_real_distribution<float> value(0.01f, 3);
        for (vec4& t : all) t = vec4(value(random), value(random), value(random), a);
        return all;
    };
    const std::vector<vec4> beauty = random_texels(0.5f), albedo = random_texels(1), spread(beauty.size(), vec4(0.25f));
    std::vector<vec4> other(beauty.size(), vec4(1.5f, 1, 2, 1));
    constexpr std::size_t kSpeckle = 20 + 20 * 64;
    other[kSpeckle] = vec4(100, 100, 100, 1);  // becomes as bright as its neighbours
    for (const float samples : {shared::kFilterWeakens, 160.0f, shared::kFilterEnds, 4096.0f}) {
        TexelData data{kSize, random_texels(0.75f * samples), random_texels(0.25f * samples), {}, {}};
        data.guide.resize(beauty.size());
        data.place.resize(beauty.size());
        data.first[5].w = data.second[5].w = -1;  // no surface
        graph::Graph graph;
        TexelTextures texels(data);
        gpu::Texture textures[] = {texture_of(beauty, kSize), texture_of(albedo, kSize), texture_of(other, kSize),
                                   texture_of(spread, kSize)};
        const auto import = [&](int i) { return graph.import_texture("texels", textures[i]); };
        const PreviewPixels pixels{texels.import(graph), import(1), import(0)};
        const graph::TextureHandle out = add_preview_output(graph, pixels, pixels.texels,
                                                            FilteredHalves{import(2), pixels.texels.second, import(3)});
        graph.output(out);
        run(graph);
        const std::vector<vec4> result = texels_of(executor.texture(out));
        const float strength =
            std::clamp((shared::kFilterEnds - samples) / (shared::kFilterEnds - shared::kFilterWeakens), 0.0f, 1.0f);
        EXPECT_EQ(result[5], beauty[5]);
        for (std::size_t i = 6; i < result.size(); ++i) {
            if (samples >= shared::kFilterEnds) {
                ASSERT_EQ(result[i], beauty[i]) << i;
                continue;
            }
            const vec4 own = 0.75f * data.first[i] + 0.25f * data.second[i];
            const vec4 change = strength * albedo[i] * (other[i == kSpeckle ? 0 : i] + spread[i] - own);
            for (int c = 0; c < 3; ++c) ASSERT_NEAR(result[i][c], std::max(beauty[i][c] + change[c], 0.0f), 1e-5f) << i;
            ASSERT_EQ(result[i].w, beauty[i].w);
        }
    }
}

}  // namespace
}  // namespace halflight::test
