// Tests temporal reuse on synthetic pictures of planes: where the history is found, and where it must be rejected.
#include "passes/preview/temporal.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <limits>

#include "shaders/shared/preview_constants.h"
#include "tests/pass/picture/pixels.h"
#include "tests/pass/picture/preview_scene.h"

namespace halflight::test {
namespace {

constexpr ivec2 kSize(48, 32);
constexpr float kEarlierSamples = 8;

/// Returns radiance as a linear function of position, so that interpolation between texels is exact.
vec3 pattern(const vec3& p) {
    return vec3(20) + vec3(1, 0.5f, -1) * p.x + vec3(0.5f, -1, 1) * p.y;
}
/// Adds noise large enough that the history is never clipped.
vec3 with_noise(int x, int y, const vec3& p) {
    return pattern(p) + ((x + y) % 2 == 0 ? 10.0f : -10.0f);
}
Plane wall(int, int) {
    return {};
}

class TemporalTest : public PassTest {
  protected:
    TexelData accumulate(const TexelData& now, const TexelData& earlier, const shared::Frame& earlier_frame,
                         float share = 1, const std::vector<vec4>* before = nullptr, const vec3& shift = vec3(0)) {
        graph::Graph graph;
        TexelTextures new_texels(now), old_texels(earlier), result(now.size);
        std::optional<gpu::Texture> places;
        EarlierPicture picture;
        picture.texels = old_texels.import(graph);
        picture.to_clip = earlier_frame.previous_view_projection;
        picture.origin_shift = shift;
        picture.pixel = 2 * glm::length(vec3(earlier_frame.camera_up)) / static_cast<float>(earlier_frame.size.y);
        picture.share = share;
        if (before) picture.before = graph.import_texture("before", places.emplace(texture_of(*before, now.size)));
        refused.clear();
        const PreviewTexels out = add_temporal(graph, new_texels.import(graph), picture, result.import(graph), refused);
        for (const graph::TextureHandle handle : {out.first, out.second, out.guide, out.place}) graph.output(handle);
        run(graph);
        return result.read();
    }

    /// Returns the wall with the pattern's light as `frame` sees it.
    static TexelData patterned(const shared::Frame& frame, float samples = kEarlierSamples) {
        return seen_planes(
            frame, wall, [](int, int, const vec3& p) { return pattern(p); }, samples);
    }
    /// Returns light that is the mean of `now` and of the earlier pattern at `place`.
    static vec3 mixed(const vec4& now, const vec3& place, float earlier_samples = kEarlierSamples) {
        return (vec3(now) + earlier_samples * pattern(place)) / (1 + earlier_samples);
    }

    gpu::Buffer refused{"refused", shared::kRefusedKinds * sizeof(std::uint32_t)};
    const shared::Frame still = constants_of(camera_at({0, 0, 0}), kSize);
    const TexelData still_now = seen_planes(still, wall, with_noise, 1), still_earlier = patterned(still);
};

TEST_F(TemporalTest, LightIsReprojected) {
    // The motion includes a rotation, and is not a whole number of pixels.
    Camera moved = camera_at({0.83, -0.31, 0.6});
    moved.camera_to_world = moved.camera_to_world * glm::rotate(dmat4(1), 0.05, dvec3(0.2, 1, 0.5));
    const shared::Frame frame = constants_of(moved, kSize);
    const TexelData now = seen_planes(frame, wall, with_noise, 1);
    const TexelData result = accumulate(now, still_earlier, still);
    int found = 0, lost = 0;
    for (const auto& [x, y] : pixels_of(kSize)) {
        const vec3 place(now.place_at(x, y));
        const vec4 clip = still.previous_view_projection * vec4(place, 1);
        const vec2 there = (vec2(clip) / clip.w * 0.5f + 0.5f) * vec2(kSize);
        const vec3 light(result.light_at(x, y)), own(now.light_at(x, y));
        if (there.x > 0.51f && there.y > 0.51f && there.x < kSize.x - 0.51f && there.y < kSize.y - 0.51f) {
            ++found;
            ASSERT_LT(glm::length(light - mixed(now.light_at(x, y), place)), 1e-3f) << x << ", " << y;
            ASSERT_FLOAT_EQ(result.light_at(x, y).w, 1 + kEarlierSamples);
        } else if (there.x < -0.51f || there.y < -0.51f || there.x > kSize.x + 0.51f || there.y > kSize.y + 0.51f) {
            ++lost;
            ASSERT_EQ(light, own) << "was outside the view";
            ASSERT_EQ(result.light_at(x, y).w, 1);
        }
        ASSERT_EQ(vec3(result.place_at(x, y)), place);
    }
    EXPECT_GT(found, 800);
    EXPECT_GT(lost, 100);
}

TEST_F(TemporalTest, OriginsMayDiffer) {
    const vec3 shift(3, -2, 1);
    TexelData earlier = still_earlier;
    for (vec4& place : earlier.place) place += vec4(shift, 0);
    shared::Frame frame = still;
    frame.previous_view_projection = still.previous_view_projection * glm::translate(mat4(1), -shift);
    const TexelData expected = accumulate(still_now, still_earlier, still),
                    result = accumulate(still_now, earlier, frame, 1, nullptr, shift);
    for (const auto& [x, y] : pixels_of(kSize)) {
        ASSERT_LT(glm::length(result.light_at(x, y) - expected.light_at(x, y)), 1e-3f) << x << ", " << y;
        ASSERT_FLOAT_EQ(result.light_at(x, y).w, 1 + kEarlierSamples);
    }
}

TEST_F(TemporalTest, DisoccludedSurfacesHaveNoHistory) {
    // A board was in front of the wall in the left half of the earlier picture.
    const auto board = [](int x, int) { return x < 24 ? Plane{{0, 0, 1}, -3} : Plane{}; };
    const TexelData earlier = seen_planes(
        still, board, [](int x, int, const vec3& p) { return x < 24 ? vec3(1000) : pattern(p); }, kEarlierSamples);
    const TexelData result = accumulate(still_now, earlier, still);
    for (const auto& [x, y] : pixels_of(kSize)) {
        const vec4 light = result.light_at(x, y);
        if (x < 24)
            ASSERT_EQ(light, still_now.light_at(x, y)) << x << ", " << y;
        else
            ASSERT_NE(light, still_now.light_at(x, y)) << x << ", " << y;
    }
    // A surface at the same position with another normal has other light.
    TexelData turned = earlier;
    for (vec4& guide : turned.guide) guide = vec4(1, 0, 0, guide.w);
    EXPECT_EQ(accumulate(still_now, turned, still).first, still_now.first);
}

TEST_F(TemporalTest, ACutDiscardsTheHistory) {
    const shared::Frame elsewhere = constants_of(camera_at({0, 0, 40}), kSize);
    const auto far_wall = [](int, int) { return Plane{{0, 0, 1}, 35}; };
    const TexelData earlier = seen_planes(
        elsewhere, far_wall, [](int, int, const vec3&) { return vec3(1000); }, kEarlierSamples);
    const TexelData result = accumulate(still_now, earlier, elsewhere);
    EXPECT_EQ(result.first, still_now.first);
    // The history is also rejected if the earlier camera looked the other way.
    Camera back = camera_at({0, 0, 0});
    back.camera_to_world[0] *= -1.0, back.camera_to_world[2] *= -1.0;
    EXPECT_EQ(accumulate(still_now, still_now, constants_of(back, kSize)).first, still_now.first);
}

TEST_F(TemporalTest, NonFiniteValuesAreRejectedAndCounted) {
    TexelData earlier = still_earlier;
    const shared::Frame moved = constants_of(camera_at({0.05, 0.03, 0}), kSize);
    const TexelData now = seen_planes(moved, wall, with_noise, 1);
    const TexelData expected = accumulate(now, earlier, still);
    EXPECT_EQ(refused.read<std::uint32_t>(), (std::vector<std::uint32_t>{0, 0}));
    constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
    earlier.light_at(10, 10) = vec4(kNan);
    earlier.light_at(20, 10).y = kInfinity;
    earlier.light_at(30, 10).w = -kInfinity;
    earlier.place[10 + 20 * 48].w = kNan;
    earlier.guide[20 + 20 * 48] = vec4(kNan);
    const TexelData result = accumulate(now, earlier, still);
    // Each bad texel is one of the four texels that four pixels interpolate.
    EXPECT_EQ(refused.read<std::uint32_t>(), (std::vector<std::uint32_t>{12, 8}));
    int changed = 0;
    for (std::size_t i = 0; i < result.first.size(); ++i) {
        for (int c = 0; c < 4; ++c) {
            ASSERT_TRUE(std::isfinite(result.first[i][c])) << i;
            ASSERT_TRUE(std::isfinite(result.second[i][c])) << i;
        }
        changed += result.first[i] != expected.first[i] ? 1 : 0;
    }
    EXPECT_LE(changed, 20);
}

TEST_F(TemporalTest, HalvesStayApart) {
    TexelData earlier = patterned(still, 6);
    for (std::size_t i = 0; i < earlier.first.size(); ++i) earlier.second[i] = vec4(vec3(earlier.first[i]) + 1.0f, 2);
    const TexelData result = accumulate(still_now, earlier, still);
    for (std::size_t i = 0; i < result.first.size(); ++i) {
        const vec4 first = (still_now.first[i] + 6.0f * earlier.first[i]) / 7.0f;
        ASSERT_LT(glm::length(vec3(result.first[i] - first)), 1e-3f) << i;
        ASSERT_LT(glm::length(vec3(result.second[i] - earlier.second[i])), 1e-3f) << i;
        ASSERT_FLOAT_EQ(result.first[i].w, 7);
        ASSERT_FLOAT_EQ(result.second[i].w, 2);
    }
}

TEST_F(TemporalTest, OutdatedLightIsClipped) {
    const TexelData earlier = seen_planes(
        still, wall, [](int, int, const vec3&) { return vec3(1); }, kEarlierSamples);
    const TexelData now = seen_planes(
        still, wall, [](int, int, const vec3&) { return vec3(0.25f); }, 1);
    for (const vec4& light : accumulate(now, earlier, still).first) ASSERT_NEAR(light.x, 0.25f, 1e-5f);
}

TEST_F(TemporalTest, FadesOutWithMoreSamples) {
    const TexelData earlier = patterned(still, 1000);
    float before = shared::kMostHistory + 1;
    for (const float samples : {1.0f, 4.0f, 16.0f, 31.0f}) {
        const float kept =
            accumulate(seen_planes(still, wall, with_noise, samples), earlier, still).light_at(9, 9).w - samples;
        EXPECT_GT(kept, 0);
        EXPECT_LT(kept, before);
        before = kept;
    }
    const TexelData now = seen_planes(still, wall, with_noise, shared::kTemporalEnds);
    const TexelData result = accumulate(now, earlier, still);
    EXPECT_EQ(result.first, now.first);
}

TEST_F(TemporalTest, LargerPixelsHaveLessWeight) {
    const shared::Frame coarse = constants_of(camera_at({0, 0, 0}), kSize / 4);
    const TexelData earlier = patterned(coarse);
    const TexelData result = accumulate(still_now, earlier, coarse, 0.25f);
    const vec3 expected = mixed(still_now.light_at(20, 15), vec3(still_now.place_at(20, 15)), 2);
    EXPECT_LT(glm::length(vec3(result.light_at(20, 15)) - expected), 1e-3f);
    EXPECT_FLOAT_EQ(result.light_at(20, 15).w, 3);
}

TEST_F(TemporalTest, MovingSurfacesKeepTheirLight) {
    const vec3 way(0.37f, -0.21f, 0);  // motion of the wall since the earlier picture
    std::vector<vec4> before;
    for (const vec4& place : still_now.place) before.emplace_back(vec3(place) - way, 0);
    const TexelData result = accumulate(still_now, still_earlier, still, 1, &before);
    for (const auto& [x, y] : pixels_of({6, 6}, {kSize.x - 6, kSize.y - 6})) {
        const vec3 then = vec3(still_now.place_at(x, y)) - way;
        ASSERT_LT(glm::length(vec3(result.light_at(x, y)) - mixed(still_now.light_at(x, y), then)), 1e-3f)
            << x << ", " << y;
    }
}

}  // namespace
}  // namespace halflight::test
