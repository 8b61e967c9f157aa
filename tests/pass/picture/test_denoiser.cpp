// Tests the denoiser of final pictures on halves with synthetic noise: what must stay as it is, bit for bit, and what
// must become better.
#include "passes/picture/denoiser.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>

#include "shaders/shared/denoise.h"
#include "tests/pass/picture/preview_scene.h"

namespace halflight::test {
namespace {

constexpr vec3 kAlbedo(0.5f);

/// A grey picture of direct diffuse light, row by row.
struct HalfData {
    ivec2 size{0};
    std::vector<vec4> first, second, guide, reflectance;

    vec4 mean(std::size_t i) const { return vec4(kAlbedo * glm::mix(vec3(second[i]), vec3(first[i]), first[i].w), 1); }
};

struct Filtered {
    std::vector<vec4> picture, weights;
};

/// Returns light whose values in both halves are light(x, y, half).
HalfData halves(const ivec2& size, const std::function<float(int, int, int)>& light) {
    HalfData data{size, {}, {}, {}, {}};
    for (int y = 0; y < size.y; ++y) {
        for (int x = 0; x < size.x; ++x) {
            data.first.emplace_back(vec3(light(x, y, 0)), 0.5f);
            data.second.emplace_back(vec3(light(x, y, 1)), 0.5f);
            data.guide.emplace_back(0, 0, 1, 1);
            data.reflectance.emplace_back(kAlbedo, 1);
        }
    }
    return data;
}

class DenoiserTest : public PassTest {
  protected:
    Filtered filtered(const HalfData& data) {
        std::vector<vec4> means, albedos(data.first.size(), vec4(kAlbedo, 1));
        for (std::size_t i = 0; i < data.first.size(); ++i) means.push_back(data.mean(i));
        gpu::Texture mean = texture_of(means, data.size), albedo = texture_of(albedos, data.size),
                     guide = texture_of(data.guide, data.size), reflectance = texture_of(data.reflectance, data.size),
                     first = texture_of(data.first, data.size), second = texture_of(data.second, data.size);
        graph::Graph graph;
        DenoiserPixels pixels{graph.import_texture("mean", mean), graph.import_texture("guide", guide),
                              graph.import_texture("reflectance", reflectance),
                              graph.import_texture("diffuse albedo", albedo),
                              graph.import_texture("glossy albedo", albedo)};
        pixels.light[0] = {graph.import_texture("first", first), graph.import_texture("second", second)};
        const DenoisedPicture made = add_denoiser(graph, pixels);
        graph.output(made.picture), graph.output(made.weights);
        run(graph);
        return {texels_of(executor.texture(made.picture)), texels_of(executor.texture(made.weights))};
    }
    std::mt19937 random{7};
};

/// Returns the mean of the squared error.
double error_of(const std::vector<vec4>& picture, const std::function<float(std::size_t)>& truth) {
    double sum = 0;
    for (std::size_t i = 0; i < picture.size(); ++i) {
        const double error = picture[i].x - truth(i);
        sum += error * error;
    }
    return sum / static_cast<double>(picture.size());
}

std::vector<vec4> means_of(const HalfData& data) {
    std::vector<vec4> means;
    for (std::size_t i = 0; i < data.first.size(); ++i) means.push_back(data.mean(i));
    return means;
}

TEST_F(DenoiserTest, WhatHasNoNoiseStays) {
    std::uniform_real_distribution<float> anything(0, 10);
    for (const ivec2 size : {ivec2(1, 1), ivec2(1, 70), ivec2(33, 2), ivec2(40, 50)}) {
        const HalfData constant = halves(size, [](int, int, int) { return 0.3f; });
        EXPECT_EQ(filtered(constant).picture, means_of(constant));
        const HalfData black = halves(size, [](int, int, int) { return 0.0f; });
        EXPECT_EQ(filtered(black).picture, means_of(black));
        HalfData converged = halves(size, [&](int, int, int) { return anything(random); });
        converged.second = converged.first;
        const Filtered result = filtered(converged);
        EXPECT_EQ(result.picture, means_of(converged)) << "halves that agree show that the filter is wrong";
        for (const vec4& weight : result.weights) EXPECT_EQ(weight.x, 0);
    }
}

TEST_F(DenoiserTest, NoiseIsRemovedAndTheLightKept) {
    std::exponential_distribution<float> noise(1);
    const HalfData noisy = halves({80, 60}, [&](int, int, int) { return noise(random); });
    const Filtered result = filtered(noisy);
    const auto truth = [](std::size_t) { return kAlbedo.x; };
    EXPECT_LT(error_of(result.picture, truth), 0.03 * error_of(means_of(noisy), truth));
    double light = 0, before = 0, weight = 0;
    for (std::size_t i = 0; i < result.picture.size(); ++i) {
        light += double{result.picture[i].x}, before += double{noisy.mean(i).x};
        weight += double{result.weights[i].x};
        EXPECT_EQ(result.picture[i].w, 1) << "alpha";
    }
    EXPECT_NEAR(light / before, 1, 0.02);
    EXPECT_GT(weight / static_cast<double>(result.picture.size()), 0.9);
}

TEST_F(DenoiserTest, EdgesOfSurfacesAndOfLightStay) {
    constexpr int kEdge = 30;
    std::uniform_real_distribution<float> noise(0, 2);
    for (const bool of_surfaces : {true, false}) {
        // Features tell dim surfaces apart. Without a feature, light alone does, where noise cannot explain the edge.
        const float right = of_surfaces ? 1.5f : 6;
        HalfData noisy = halves({60, 40}, [&](int x, int, int) { return noise(random) * (x < kEdge ? 1.0f : right); });
        for (std::size_t i = 0; of_surfaces && i < noisy.guide.size(); ++i)
            if (i % 60 >= kEdge) noisy.guide[i] = vec4(1, 0, 0, 1);
        const std::vector<vec4> picture = filtered(noisy).picture;
        double mixed = 0;
        for (std::size_t i = 0; i < picture.size(); ++i) {
            if (i % 60 >= kEdge - 4 && i % 60 < kEdge) mixed += (picture[i].x - kAlbedo.x) / (4 * 40);
            if (i % 60 >= kEdge && i % 60 < kEdge + 4) mixed += (right * kAlbedo.x - picture[i].x) / (4 * 40);
        }
        EXPECT_LT(std::abs(mixed), 0.1 * (right - 1)) << of_surfaces;
    }
}

TEST_F(DenoiserTest, WhatIsNotLitStays) {
    std::exponential_distribution<float> noise(1);
    HalfData noisy = halves({64, 40}, [&](int, int, int) { return noise(random); });
    for (std::size_t i = 0; i < noisy.first.size(); ++i)
        if (i % 64 < 20) noisy.first[i] = noisy.second[i] = vec4(0);
    const Filtered result = filtered(noisy);
    for (std::size_t i = 0; i < noisy.first.size(); ++i) {
        if (i % 64 >= 20) continue;
        ASSERT_EQ(result.picture[i], noisy.mean(i)) << i;
        ASSERT_EQ(result.weights[i].x, 0) << i;
    }
}

TEST_F(DenoiserTest, FirefliesAreSpreadAndNotLost) {
    for (const float brightest : {1e4f, 1e30f}) {
        HalfData noisy = halves({96, 72}, [&](int x, int y, int half) {
            return x == 50 && y == 35 && half == 0 ? brightest : 1.0f + static_cast<float>((x ^ y) & 1);
        });
        const Filtered result = filtered(noisy);
        double light = 0, before = 0, most = 0;
        for (std::size_t i = 0; i < result.picture.size(); ++i) {
            ASSERT_TRUE(std::isfinite(result.picture[i].x)) << i;
            ASSERT_GE(result.picture[i].x, 0) << i;
            light += double{result.picture[i].x}, before += double{noisy.mean(i).x};
            most = std::max(most, double{result.picture[i].x});
        }
        EXPECT_NEAR(light / before, 1, 0.02) << brightest;
        EXPECT_LT(most, 0.3 * 0.5 * kAlbedo.x * brightest) << brightest;
    }
}

TEST_F(DenoiserTest, UnequalHalvesAreWeighedBySamples) {
    std::exponential_distribution<float> noise(1);
    constexpr float kShare = 2.0f / 3.0f;  // the first half has twice as many samples
    HalfData noisy = halves({80, 60}, [&](int, int, int half) {
        return half == 0 ? 0.5f * (noise(random) + noise(random)) : noise(random);
    });
    for (std::size_t i = 0; i < noisy.first.size(); ++i) noisy.first[i].w = noisy.second[i].w = kShare;
    const auto truth = [](std::size_t) { return kAlbedo.x; };
    EXPECT_LT(error_of(filtered(noisy).picture, truth), 0.03 * error_of(means_of(noisy), truth));
}

}  // namespace
}  // namespace halflight::test
