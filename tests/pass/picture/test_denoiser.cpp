// Tests the denoiser of final pictures on halves with synthetic noise: what must stay as it is, bit for bit, and what
// must become better.
#include "passes/picture/denoiser.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <list>
#include <random>

#include "shaders/shared/denoise.h"
#include "tests/pass/picture/pixels.h"
#include "tests/pass/picture/preview_scene.h"

namespace halflight::test {
namespace {

constexpr vec3 kAlbedo(0.5f);

/// A grey picture of direct diffuse light, row by row.
struct HalfData {
    ivec2 size{0};
    std::vector<vec4> first, second, guide, reflectance;
    std::vector<vec4> glossy_guide{};  // not empty: the light is glossy

    vec4 mean(std::size_t i) const { return vec4(kAlbedo * glm::mix(vec3(second[i]), vec3(first[i]), first[i].w), 1); }
};

/// A neighbouring frame, and the motion to it and back as of DenoiserNeighbour.
struct OtherFrame {
    HalfData data;
    std::vector<vec4> motion, back;
    std::vector<vec4> glossy_motion{}, glossy_back{};  // not empty: motion of glossy light
};

struct Filtered {
    std::vector<vec4> picture, weights;
};

/// Returns light whose values in both halves are light(x, y, half).
HalfData halves(const ivec2& size, const std::function<float(int, int, int)>& light) {
    HalfData data{size, {}, {}, {}, {}, {}};
    for (const auto& [x, y] : pixels_of(size)) {
        data.first.emplace_back(vec3(light(x, y, 0)), 0.5f);
        data.second.emplace_back(vec3(light(x, y, 1)), 0.5f);
        data.guide.emplace_back(0, 0, 1, 1);
        data.reflectance.emplace_back(kAlbedo, 1);
    }
    return data;
}

std::vector<vec4> means_of(const HalfData& data) {
    std::vector<vec4> means;
    for (std::size_t i = 0; i < data.first.size(); ++i) means.push_back(data.mean(i));
    return means;
}

class DenoiserTest : public PassTest {
  protected:
    Filtered filtered(const HalfData& data, const std::vector<OtherFrame>& others = {}) {
        const std::vector<vec4> means = means_of(data);
        const std::vector<vec4> albedos(data.first.size(), vec4(kAlbedo, 1));
        graph::Graph graph;
        std::list<gpu::Texture> textures;
        const auto import = [&](const std::vector<vec4>& texels) {
            return graph.import_texture("texels", textures.emplace_back(texture_of(texels, data.size)));
        };
        const auto denoised_pixels = [&](const HalfData& of) {
            DenoiserPixels pixels{import(means), import(of.guide), import(of.reflectance), import(albedos),
                                  import(albedos)};
            const bool glossy = !of.glossy_guide.empty();
            pixels.light[glossy ? 2 : 0] = {import(of.first), import(of.second)};
            if (glossy) pixels.glossy_guide = import(of.glossy_guide), pixels.glossy_reflectance = pixels.reflectance;
            return pixels;
        };
        const DenoiserPixels pixels = denoised_pixels(data);
        std::vector<DenoiserNeighbour> neighbours;
        for (const OtherFrame& other : others) {
            neighbours.push_back({denoised_pixels(other.data), import(other.motion), import(other.back)});
            if (other.glossy_motion.empty()) continue;
            neighbours.back().glossy_motion = import(other.glossy_motion);
            neighbours.back().glossy_motion_back = import(other.glossy_back);
        }
        const DenoisedPicture made = add_denoiser(graph, pixels, neighbours);
        graph.output(made.picture), graph.output(made.weights);
        run(graph);
        return {texels_of(executor.texture(made.picture)), texels_of(executor.texture(made.weights))};
    }
    /// Returns light of mean 1 in both halves, with the noise of an exponential distribution.
    HalfData noisy_frame(const ivec2& size) {
        return halves(size, [&](int, int, int) { return noise(random); });
    }
    std::mt19937 random{7};
    std::exponential_distribution<float> noise{1};
};

/// Returns the mean of the squared error of pictures whose light is 1.
double error_of(const std::vector<vec4>& picture) {
    double sum = 0;
    for (const vec4& texel : picture) sum += (texel.x - kAlbedo.x) * (texel.x - kAlbedo.x);
    return sum / static_cast<double>(picture.size());
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
    const HalfData noisy = noisy_frame({80, 60});
    const Filtered result = filtered(noisy);
    EXPECT_LT(error_of(result.picture), 0.03 * error_of(means_of(noisy)));
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
    std::uniform_real_distribution<float> uniform(0, 2);
    for (const bool of_surfaces : {true, false}) {
        // Features tell dim surfaces apart. Without a feature, light alone does, where noise cannot explain the edge.
        const float right = of_surfaces ? 1.5f : 6;
        HalfData noisy =
            halves({60, 40}, [&](int x, int, int) { return uniform(random) * (x < kEdge ? 1.0f : right); });
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

TEST_F(DenoiserTest, GlossyLightKeepsTheEdgesOfMirrorImages) {
    constexpr int kEdge = 30;
    std::uniform_real_distribution<float> uniform(0, 2);
    HalfData noisy = halves({60, 40}, [&](int x, int, int) { return uniform(random) * (x < kEdge ? 1.0f : 1.5f); });
    const auto mixed = [&] {
        const std::vector<vec4> picture = filtered(noisy).picture;
        double sum = 0;
        for (std::size_t i = 0; i < picture.size(); ++i)
            if (i % 60 >= kEdge - 4 && i % 60 < kEdge) sum += (picture[i].x - kAlbedo.x) / (4 * 40);
        return std::abs(sum);
    };
    noisy.glossy_guide = noisy.guide;
    const double without = mixed();
    for (std::size_t i = 0; i < noisy.glossy_guide.size(); ++i)
        if (i % 60 >= kEdge) noisy.glossy_guide[i] = vec4(1, 0, 0, 1);
    EXPECT_LT(mixed(), 0.5 * without) << "the mirror itself has no edge";
}

TEST_F(DenoiserTest, WhatIsNotLitStays) {
    HalfData noisy = noisy_frame({64, 40});
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
    for (const auto& [brightest, glossy] :
         {std::pair(1e4f, false), std::pair(1e30f, false), std::pair(1e2f, true), std::pair(1e4f, true)}) {
        HalfData noisy = halves({96, 72}, [&, firefly = brightest](int x, int y, int half) {
            return x == 50 && y == 35 && half == 0 ? firefly : 1.0f + static_cast<float>((x ^ y) & 1);
        });
        if (glossy) noisy.glossy_guide = noisy.guide;
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
        double near = 0;  // light that the firefly's neighbours have received
        for (int y = 33; y <= 37; ++y)
            for (int x = 48; x <= 52; ++x)
                near += x == 50 && y == 35 ? 0 : double{result.picture[std::size_t(y * 96 + x)].x} - 1.5 * kAlbedo.x;
        EXPECT_LT(near, 0.15 * 0.5 * kAlbedo.x * brightest) << brightest << (glossy ? ", glossy" : "");
        if (brightest < 1e30f) continue;
        const auto at = [&](int x) { return double{result.picture[std::size_t(35 * 96 + x)].x}; };
        for (int x = 64; x < 95; ++x)
            EXPECT_LT(std::abs(at(x - 1) - 2 * at(x) + at(x + 1)), 0.02 * at(59)) << "no edges, " << x;
    }
}

/// A bright reflection is no light of surfaces around it that reflect something dark.
TEST_F(DenoiserTest, FirefliesOfReflectionsLeaveTheDarkDark) {
    constexpr int kDark = 53;  // first column of what is dark
    HalfData noisy = halves({96, 72}, [&](int x, int y, int half) {
        if (x == 50 && y == 35 && half == 0) return 1e4f;
        return x < kDark ? 1.0f + static_cast<float>((x ^ y) & 1) : 1e-3f;
    });
    const auto brightest_of_the_dark = [&](const Filtered& result) {
        double light = 0, before = 0, most = 0;
        for (std::size_t i = 0; i < result.picture.size(); ++i) {
            light += double{result.picture[i].x}, before += double{noisy.mean(i).x};
            // Levels of light are averages over a few pixels.
            if (i % 96 > kDark + 2) most = std::max(most, double{result.picture[i].x});
        }
        EXPECT_NEAR(light / before, 1, 0.02);
        return most;
    };
    EXPECT_GT(brightest_of_the_dark(filtered(noisy)), 1) << "diffuse light reaches all surfaces";
    noisy.glossy_guide = noisy.guide;
    EXPECT_LT(brightest_of_the_dark(filtered(noisy)), 0.03);
}

TEST_F(DenoiserTest, UnequalHalvesAreWeighedBySamples) {
    constexpr float kShare = 2.0f / 3.0f;  // the first half has twice as many samples
    HalfData noisy = halves({80, 60}, [&](int, int, int half) {
        return half == 0 ? 0.5f * (noise(random) + noise(random)) : noise(random);
    });
    for (std::size_t i = 0; i < noisy.first.size(); ++i) noisy.first[i].w = noisy.second[i].w = kShare;
    EXPECT_LT(error_of(filtered(noisy).picture), 0.03 * error_of(means_of(noisy)));
}

/// Returns the motion of one object, from 1, by `way` pixels in all pixels.
std::vector<vec4> motion_of(const HalfData& data, const vec2& way, float object = 1) {
    return std::vector<vec4>(data.first.size(), vec4(way, 0, object));
}

TEST_F(DenoiserTest, NeighboursRemoveMoreNoise) {
    const HalfData noisy = noisy_frame({80, 60});
    const double alone = error_of(filtered(noisy).picture);
    std::vector<OtherFrame> others;
    for (const vec2 way : {vec2(0), vec2(3.4f, -2.2f)})
        others.push_back({noisy_frame({80, 60}), motion_of(noisy, way), motion_of(noisy, -way)});
    EXPECT_LT(error_of(filtered(noisy, others).picture), 0.65 * alone);
}

TEST_F(DenoiserTest, NeighboursThatShowOtherSurfacesAddNothing) {
    const HalfData noisy = noisy_frame({50, 40});
    const HalfData same = noisy_frame({50, 40});
    const std::vector<vec4> alone = filtered(noisy).picture, still = motion_of(noisy, vec2(0));
    HalfData farther = same, turned = same, unlit = same;
    for (vec4& guide : farther.guide) guide.w += 0.2f;
    for (vec4& guide : turned.guide) guide = vec4(0, 1, 0, guide.w);
    for (vec4& first : unlit.first) first = vec4(0);
    std::vector<vec4> nearer = still, away = still;
    for (vec4& motion : nearer) motion.z = -0.2f;
    for (vec4& motion : away) motion.z = 0.2f;
    const std::vector<vec4> nothing(still.size(), vec4(0));
    const struct {
        const char* what;
        OtherFrame other;
        bool taken = false;
    } cases[] = {{"the same surface", {same, still, still}, true},
                 {"a depth that motion explains", {farther, away, nearer}, true},
                 {"another depth", {farther, still, still}},
                 {"a depth that motion does not explain", {same, nearer, still}},
                 {"another normal", {turned, still, still}},
                 {"another object", {same, still, motion_of(noisy, vec2(0), 2)}},
                 {"no surface here", {same, nothing, still}},
                 {"no surface there", {same, still, nothing}},
                 {"another way back", {same, still, motion_of(noisy, vec2(3, 0))}},
                 {"a place outside", {same, motion_of(noisy, vec2(0, 60)), motion_of(noisy, vec2(0, -60))}},
                 {"no light", {unlit, still, still}}};
    for (const auto& c : cases) {
        const std::vector<vec4> picture = filtered(noisy, {c.other}).picture;
        float most = 0;
        for (std::size_t i = 0; i < picture.size(); ++i) most = std::max(most, glm::distance(picture[i], alone[i]));
        if (c.taken)
            EXPECT_GT(most, 0.01f) << c.what;
        else
            EXPECT_LT(most, 1e-5f) << c.what;
    }
}

/// Light that changes from frame to frame stays in its frame, and so do fireflies of a frame with other light.
TEST_F(DenoiserTest, NeighboursWithOtherLightAddLittle) {
    const auto frame = [&](float level, float firefly) {
        return halves({60, 50}, [&](int x, int y, int half) {
            return x == 30 && y == 25 && half == 0 ? std::max(firefly, level) : level * (0.9f + 0.2f * noise(random));
        });
    };
    const HalfData dim = frame(1, 0);
    const std::vector<vec4> still = motion_of(dim, vec2(0)), alone = filtered(dim).picture;
    for (const auto& [what, other] : {std::pair{"ten times brighter", frame(10, 0)},
                                      {"brighter by half", frame(1.5f, 0)},
                                      {"brighter, with a firefly", frame(10, 3e4f)}}) {
        const Filtered result = filtered(dim, {{other, still, still}});
        for (std::size_t i = 0; i < alone.size(); ++i)
            ASSERT_NEAR(result.picture[i].x, alone[i].x, 0.05f * alone[i].x) << what << " " << i;
    }
    const HalfData bright = frame(10, 3e4f);
    double light = 0, expected = 0;
    for (const vec4& texel : filtered(bright, {{dim, still, still}, {dim, still, still}}).picture)
        light += double{texel.x};
    for (const vec4& texel : filtered(bright).picture) expected += double{texel.x};
    // Around the firefly, noise explains that the neighbours are dim.
    EXPECT_NEAR(light / expected, 1, 0.1) << "the firefly's light stays";
}

/// The weights tell how much of the light is not the mean of the frame's own samples.
TEST_F(DenoiserTest, WeightsCountLightOfNeighbours) {
    const HalfData noisy = noisy_frame({60, 50});
    const std::vector<vec4> still = motion_of(noisy, vec2(0));
    const std::vector<vec4> alone = filtered(noisy).weights;
    const std::vector<vec4> weights = filtered(noisy, {{noisy_frame({60, 50}), still, still}}).weights;
    double sum = 0, sum_alone = 0;
    for (std::size_t i = 0; i < weights.size(); ++i) sum += double{weights[i].x}, sum_alone += double{alone[i].x};
    EXPECT_GT(sum, sum_alone);
    for (const vec4& w : weights) EXPECT_TRUE(w.x >= 0 && w.x <= 1) << w.x;
}

TEST_F(DenoiserTest, GlossyLightMovesWithMirrorImages) {
    const auto frame = [&] {
        HalfData data = noisy_frame({50, 40});
        data.glossy_guide = data.guide;
        return data;
    };
    const HalfData noisy = frame();
    const std::vector<vec4> still = motion_of(noisy, vec2(0)), gone = motion_of(noisy, vec2(0, 60));
    const double alone = error_of(filtered(noisy).picture);
    const OtherFrame image_stays{frame(), gone, gone, still, still}, image_leaves{frame(), still, still, gone, gone};
    EXPECT_LT(error_of(filtered(noisy, {image_stays}).picture), 0.9 * alone);
    EXPECT_NEAR(error_of(filtered(noisy, {image_leaves}).picture), alone, 1e-6 * alone);
}

TEST_F(DenoiserTest, MovingObjectsLeaveNoGhosts) {
    // A bright object in front of a dim wall moves by 12 pixels a frame. The noise hides the difference of their light.
    constexpr int kWidth = 12;
    std::uniform_real_distribution<float> uniform(0, 2);
    const auto is_object = [](int x, int left) { return x >= left && x < left + kWidth; };
    const auto frame = [&](int left) {
        HalfData data =
            halves({80, 40}, [&](int x, int, int) { return uniform(random) * (is_object(x, left) ? 1.5f : 1.0f); });
        for (std::size_t i = 0; i < data.guide.size(); ++i)
            if (is_object(static_cast<int>(i % 80), left))
                data.guide[i].w = 0.95f;  // the object is hardly nearer than what is behind it
        return data;
    };
    const auto motion = [&](int left, float way) {
        std::vector<vec4> all;
        for (int i = 0; i < 80 * 40; ++i)
            all.push_back(is_object(i % 80, left) ? vec4(way, 0, 0, 2) : vec4(0, 0, 0, 1));
        return all;
    };
    constexpr int kLeft = 34;
    const HalfData noisy = frame(kLeft);
    std::vector<OtherFrame> others;
    for (const int step : {-kWidth, kWidth})
        others.push_back({frame(kLeft + step), motion(kLeft, static_cast<float>(step)),
                          motion(kLeft + step, static_cast<float>(-step))});
    const std::vector<vec4> picture = filtered(noisy, others).picture, alone = filtered(noisy).picture;
    for (const int left : {kLeft - kWidth, kLeft, kLeft + kWidth}) {
        double sum = 0, sum_alone = 0;
        for (const auto& [x, y] : pixels_of({left + 3, 0}, {left + kWidth - 3, 40})) {
            sum += picture[std::size_t(y * 80 + x)].x / (40 * (kWidth - 6));
            sum_alone += alone[std::size_t(y * 80 + x)].x / (40 * (kWidth - 6));
        }
        EXPECT_NEAR(sum, kAlbedo.x * (left == kLeft ? 1.5 : 1.0), 0.03) << left << ", alone " << sum_alone;
    }
}

}  // namespace
}  // namespace halflight::test
