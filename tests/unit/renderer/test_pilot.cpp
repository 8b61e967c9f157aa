// Tests the decisions of a pilot.
#include <gtest/gtest.h>

#include "renderer/pilot.h"

namespace halflight::test {
namespace {

constexpr Estimator kRequested{
    .reuse = Reuse::automatic, .camera = CameraRays::automatic, .shadow = ShadowRays::automatic};

TEST(Pilot, WithoutGainNothingIsChosen) {
    EXPECT_EQ(settled(kRequested, {{1, 1, 1}, {1, 1, 1}}), Estimator());
    EXPECT_EQ(settled(kRequested, {{0, 0, 0}, {0, 0, 0}}), Estimator());
    EXPECT_EQ(settled(kRequested, {{1, 1, 1}, {2, 3, 4}}), Estimator()) << "few pictures may overestimate the noise";
}

TEST(Pilot, TheLargestErrorGetsMoreSamples) {
    const Estimator edges = settled(kRequested, {{10, 0.01, 0.2}, {1, 0.003, 0.02}});
    EXPECT_GE(edges.camera, CameraRays::eight);
    EXPECT_EQ(edges.shadow, ShadowRays::one);
    const Estimator penumbra = settled(kRequested, {{0, 10, 0.2}, {0, 2.5, 0.02}});
    EXPECT_EQ(penumbra.camera, CameraRays::one);
    EXPECT_EQ(penumbra.shadow, ShadowRays::eight);
    EXPECT_EQ(penumbra.reuse, Reuse::off);
    const Estimator opening = settled(kRequested, {{0, 0.1, 10}, {0, 0.03, 1}});
    EXPECT_EQ(opening.camera, CameraRays::one);
    EXPECT_EQ(opening.reuse, Reuse::sixteen);
}

/// Groups of 16 have a little less than half the error. Smaller groups have slightly more error and cost less.
TEST(Pilot, PrefersSmallerGroupsWithEqualGain) {
    const Estimator some = settled(kRequested, {{0, 0, 1}, {0, 0, 0.45}});
    EXPECT_GE(some.reuse, Reuse::four);
    EXPECT_LT(some.reuse, Reuse::sixteen);
    const Estimator many = settled(kRequested, {{0, 0, 1}, {0, 0, 0.07}});
    EXPECT_EQ(many.reuse, Reuse::sixteen);
}

/// Well distributed samples converge faster than 1/n, so errors extrapolated by 1/n reach zero.
TEST(Pilot, ErrorsAreNeverNegative) {
    for (const double left : {0.0, 0.05, 0.14, 0.2}) {
        const Estimator found = settled(kRequested, {{0, 1, 0.05}, {0, left, 0.01}});
        EXPECT_EQ(found.shadow, ShadowRays::eight) << left;
        EXPECT_EQ(found.reuse, Reuse::off) << left;
    }
}

TEST(Pilot, LeavesOtherSettingsAlone) {
    Estimator requested = kRequested;
    requested.lights = LightChoice::tree, requested.sun = SunChoice::among,
    requested.sampler = SamplePoints::blue_noise;
    requested.reuse = Reuse::four;
    const Estimator found = settled(requested, {{10, 0.01, 0.2}, {1, 0.003, 0.02}});
    EXPECT_EQ(found.reuse, Reuse::four);
    EXPECT_GT(found.camera, CameraRays::one);
    requested.camera = found.camera, requested.shadow = found.shadow;
    EXPECT_EQ(found, requested);
    EXPECT_FALSE(leaves_open(found));
    EXPECT_EQ(settled(found, {{1, 1, 1}, {0.1, 0.1, 0.1}}), found) << "nothing was left open";
}

}  // namespace
}  // namespace halflight::test
