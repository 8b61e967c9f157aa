// Tests the preview filter on planes with synthetic noise: edges, outliers, and its fading with many samples.
#include "passes/preview/denoise.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "shaders/shared/preview.h"
#include "tests/pass/picture/preview_scene.h"

namespace halflight::test {
namespace {

constexpr ivec2 kSize(64, 48);
constexpr int kEdge = 32;  // column of the edge

class DenoiseTest : public PassTest {
  protected:
    TexelData filtered(const TexelData& data) {
        graph::Graph graph;
        TexelTextures texels(data);
        gpu::Buffer constants("frame constants", sizeof(frame), &frame);
        const graph::TextureHandle out =
            add_denoise(graph, texels.import(graph), graph.import_buffer("frame constants", constants));
        graph.output(out);
        run(graph);
        TexelData result = data;
        result.light = texels_of(executor.texture(out));
        return result;
    }

    /// Returns radiance 5 left of the edge and 6 right of it, with one plane per side. The noise of +-3 has a known
    /// mean over any few pixels.
    TexelData two_sides(const Plane& left, const Plane& right) {
        return seen_planes(
            frame, [&](int x, int) { return x < kEdge ? left : right; },
            [&](int x, int y, const vec3&) { return vec3((x < kEdge ? 5 : 6) + ((x ^ y) & 1 ? 3 : -3)); }, 1);
    }
    /// Returns the error of the mean over the eight columns left of the edge and right of it.
    vec2 mixed(const TexelData& data) const {
        vec2 sum(0);
        for (int y = 0; y < kSize.y; ++y) {
            for (int x = 0; x < 8; ++x) {
                sum.x += data.light_at(kEdge - 1 - x, y).x - 5;
                sum.y += 6 - data.light_at(kEdge + x, y).x;
            }
        }
        return sum / static_cast<float>(kSize.y * 8);
    }

    const shared::Frame frame = constants_of(camera_at({0, 0, 0}), kSize);
};

double spread(const TexelData& data, int from, int to) {
    double sum = 0, squares = 0, count = 0;
    for (int y = 0; y < data.size.y; ++y) {
        for (int x = from; x < to; ++x) {
            const double value = data.light_at(x, y).x;
            sum += value, squares += value * value, ++count;
        }
    }
    return std::sqrt(squares / count - sum / count * sum / count);
}

TEST_F(DenoiseTest, AConstantStays) {
    for (const Plane& plane : {Plane{}, Plane{glm::normalize(vec3(0.5f, 0.3f, 1)), -3}}) {
        const TexelData data = seen_planes(
            frame, [&](int, int) { return plane; }, [](int, int, const vec3&) { return vec3(0.3f, 7, 1e-4f); }, 1);
        for (const vec4& light : filtered(data).light)
            for (int c = 0; c < 3; ++c) ASSERT_NEAR(light[c], data.light[0][c], 1e-5f * data.light[0][c]);
    }
}

TEST_F(DenoiseTest, NoiseOfOneSurfaceIsRemoved) {
    const TexelData noisy = two_sides({}, {});
    const TexelData smooth = filtered(noisy);
    EXPECT_LT(spread(smooth, 0, 16), 0.3 * spread(noisy, 0, 16));
    EXPECT_LT(spread(smooth, 48, 64), 0.3 * spread(noisy, 48, 64));
    // The noise hides the edge of the light. Without an edge of the surfaces, the filter mixes both sides.
    EXPECT_GT(mixed(smooth).x, 0.1f);
    EXPECT_GT(mixed(smooth).y, 0.1f);
}

TEST_F(DenoiseTest, NothingIsMixedAcrossAnEdge) {
    const Plane wall;
    const vec3 turned = glm::normalize(vec3(1, 0, 1));
    const Plane nearer{{0, 0, 1}, -4};          // parallel, with a gap
    const Plane corner{turned, -5 * turned.z};  // touches the other plane at x = 0, at the edge
    for (const Plane& right : {nearer, corner}) {
        const TexelData noisy = two_sides(wall, right);
        const TexelData smooth = filtered(noisy);
        EXPECT_NEAR(mixed(smooth).x, 0, 0.02f);
        EXPECT_NEAR(mixed(smooth).y, 0, 0.02f);
        EXPECT_LT(spread(smooth, kEdge - 8, kEdge), 0.3 * spread(noisy, kEdge - 8, kEdge));
        EXPECT_LT(spread(smooth, kEdge, kEdge + 8), 0.3 * spread(noisy, kEdge, kEdge + 8));
    }
}

TEST_F(DenoiseTest, ConvergedTexelsAreKept) {
    // Stripes of texels of 64 equal samples have no noise, whatever their neighbours are.
    const TexelData stripes = seen_planes(
        frame, [](int, int) { return Plane{}; }, [](int x, int, const vec3&) { return vec3(x % 4 < 2 ? 1 : 2); }, 64);
    const TexelData result = filtered(stripes);
    for (std::size_t i = 0; i < result.light.size(); ++i) ASSERT_NEAR(result.light[i].x, stripes.light[i].x, 1e-3f);
}

TEST_F(DenoiseTest, OutliersAreClampedToTheirNeighbours) {
    // The texels have many equal samples, so the filter changes only the bad ones.
    TexelData data = seen_planes(
        frame, [](int, int) { return Plane{}; }, [](int, int, const vec3&) { return vec3(1, 2, 3); }, 64);
    const vec4 around = data.light[0];
    for (const ivec2 at : {ivec2(0, 0), ivec2(63, 47), ivec2(20, 20)}) data.light_at(at.x, at.y) *= 1000.0f;
    data.light_at(40, 20) = vec4(0);
    for (const vec4& light : filtered(data).light) ASSERT_LT(glm::length(vec3(light) - vec3(around)), 1e-4f);
}

TEST_F(DenoiseTest, TheBackgroundStaysBlack) {
    TexelData data = two_sides({}, {});
    for (int y = 0; y < kSize.y; ++y) {
        for (int x = kEdge; x < kSize.x; ++x) {
            const auto i = std::size_t(y * kSize.x + x);
            data.light[i] = vec4(1e6f, 1e6f, 1e6f, -1), data.guide[i] = vec4(0);
        }
    }
    const TexelData result = filtered(data);
    for (int y = 0; y < kSize.y; ++y)
        for (int x = 0; x < kEdge; ++x) ASSERT_LT(result.light_at(x, y).x, 8) << x << ", " << y;
}

TEST_F(DenoiseTest, WithManySamplesThePictureIsTheMean) {
    auto random_texels = [random = std::mt19937(7)](float a) mutable {
        std::vector<vec4> all(std::size_t(kSize.x * kSize.y));
        std::uniform_real_distribution<float> value(0.01f, 3);
        for (vec4& t : all) t = vec4(value(random), value(random), value(random), a);
        return all;
    };
    const std::vector<vec4> beauty = random_texels(0.5f), albedo = random_texels(1), other = random_texels(0);
    for (const float samples : {shared::kFilterWeakens, 160.0f, shared::kFilterEnds, 4096.0f}) {
        TexelData data{kSize, random_texels(1), {}, {}};
        data.guide.resize(beauty.size());
        data.place.assign(beauty.size(), vec4(0, 0, 0, samples));
        data.light[5].w = -1;  // no surface
        graph::Graph graph;
        TexelTextures texels(data);
        gpu::Texture beauty_texture = texture_of(beauty, kSize), albedo_texture = texture_of(albedo, kSize),
                     other_texture = texture_of(other, kSize);
        const PreviewPixels pixels{texels.import(graph), graph.import_texture("albedo", albedo_texture),
                                   graph.import_texture("beauty", beauty_texture)};
        const graph::TextureHandle out =
            add_preview_output(graph, pixels, pixels.texels.light, graph.import_texture("other", other_texture));
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
            const vec4 change = strength * albedo[i] * (other[i] - data.light[i]);
            for (int c = 0; c < 3; ++c) ASSERT_NEAR(result[i][c], std::max(beauty[i][c] + change[c], 0.0f), 1e-5f) << i;
            ASSERT_EQ(result[i].w, beauty[i].w);
        }
    }
}

}  // namespace
}  // namespace halflight::test
