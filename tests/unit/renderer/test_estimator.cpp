// Tests the text forms of estimator techniques and preview modes, the decisions of a pilot, and the hand-over from
// cached samples.
#include <gtest/gtest.h>

#include <span>
#include <string>
#include <vector>

#include "engine/settings/estimator.h"
#include "engine/settings/preview.h"
#include "renderer/hand_over.h"
#include "renderer/pilot.h"
#include "tests/unit/renderer/refusal.h"

namespace halflight {
namespace {

TEST(Estimator, TextRoundTrips) {
    EXPECT_EQ(text(Estimator()), "lights=auto,sun=apart,reuse=off,camera=1,shadow=1,sampler=sobol");
    const auto expect_round_trip = [](const Estimator& e) { EXPECT_EQ(estimator_named(text(e)), e) << text(e); };
    for (const LightChoice lights : kLightChoices) expect_round_trip({.lights = lights});
    for (const SunChoice sun : kSunChoices) expect_round_trip({.sun = sun, .reuse = Reuse::sixteen});
    for (const CameraRays camera : kCameraRays) expect_round_trip({.camera = camera});
    for (const ShadowRays shadow : kShadowRays) expect_round_trip({.shadow = shadow});
    for (const SamplePoints sampler : kSamplePoints) expect_round_trip({.sampler = sampler});
    EXPECT_EQ(estimator_named("reuse=16"), Estimator{.reuse = Reuse::sixteen});
    constexpr Estimator kOpen{
        .reuse = Reuse::automatic, .camera = CameraRays::automatic, .shadow = ShadowRays::automatic};
    EXPECT_EQ(estimator_named("auto"), kOpen);
    expect_round_trip(kOpen);
    Estimator partly = kOpen;
    partly.camera = CameraRays::four, partly.lights = LightChoice::tree;
    EXPECT_EQ(estimator_named("auto,lights=tree,camera=4"), partly);
    EXPECT_TRUE(leaves_open(partly));
    EXPECT_FALSE(leaves_open({}));
}

TEST(Estimator, DifferencesFromTheDefaultAndFromOthersAreListed) {
    const std::vector<Estimator> all{{}, {.lights = LightChoice::tree}, {.reuse = Reuse::sixteen}};
    EXPECT_EQ(difference(all[0], all), "lights=auto,reuse=off");
    EXPECT_EQ(difference(all[1], all), "lights=tree,reuse=off");
    EXPECT_EQ(difference(all[2], std::span(all).subspan(2)), "reuse=16");
    EXPECT_EQ(difference({}, {}), "");
}

TEST(Estimator, UnknownTechniquesAreNamed) {
    for (const char* list :
         {"light=tree", "lights=bush", "reuse=16,sun", "sun=among,auto", "sun=", "lights=tree,lights=power", "",
          "lights", "lights=tree,", ",lights=tree", "tree", "=", "lights=tree ", "Lights=tree"})
        expect_refusal([&] { estimator_named(list); }, std::string(list) + ": ");
}

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

TEST(Preview, TextRoundTrips) {
    for (int bits = 0; bits < 8; ++bits) {
        const Preview preview{.cache = (bits & 1) != 0, .temporal = (bits & 2) != 0, .filter = (bits & 4) != 0};
        EXPECT_EQ(preview_named(text(preview)), preview);
        EXPECT_EQ(preview.any(), bits != 0);
        EXPECT_EQ(preview.of_picture(), preview.temporal || preview.filter);
    }
    EXPECT_EQ(text(Preview()), "none");
    EXPECT_EQ(text({.cache = true, .temporal = true, .filter = true}), "cache,temporal,filter");
    EXPECT_EQ(preview_named("filter,cache"), preview_named("cache,filter"));
}

TEST(Preview, UnknownModesAreNamed) {
    for (const char* list :
         {"blur", "filter,filter", "none,cache", "cache,none", "", "filter,", ",filter", "Filter", "filter "})
        expect_refusal([&] { preview_named(list); }, std::string(list) + ": ");
}

/// Returns the error of the mean if all samples are independent and a cached sample is worth `worth` others.
double error_after(int samples, double worth) {
    const double weight = cached_weight(samples);
    const int cached = std::min(samples, kCachedSamples), others = samples - cached;
    return weight * weight / (cached * worth) + (others > 0 ? (1 - weight) * (1 - weight) / others : 0);
}

TEST(HandOver, CachedSamplesOfEachPictureFormTwoHalves) {
    for (std::uint32_t picture = 0; picture < 20; ++picture) {
        int first = 0;
        for (std::uint32_t i = 0; i < kCachedSamples; ++i)
            first += cached_view({}, {}, picture * kCachedSamples, i, SamplePoints::sobol).first_half ? 1 : 0;
        EXPECT_EQ(first, kCachedSamples / 2) << picture;
        EXPECT_TRUE(cached_view({}, {}, picture * kCachedSamples, 0, SamplePoints::sobol).first_half);
    }
}

TEST(HandOver, FadesWithoutIncreasingTheError) {
    for (int samples = 1; samples <= kCachedSamples; ++samples) EXPECT_EQ(cached_weight(samples), 1);
    for (int samples = kCachedSamples; samples < kHandedOver; ++samples)
        EXPECT_LT(cached_weight(samples + 1), cached_weight(samples));
    for (const int samples : {kHandedOver, kHandedOver + 1, 1 << 20}) EXPECT_EQ(cached_weight(samples), 0);
    for (const double worth : {1.0, 2.0, 3.5, 5.0}) {
        double least = error_after(1, worth);
        for (int samples = 2; samples < 64; ++samples) {
            const double error = error_after(samples, worth);
            EXPECT_LT(error, 1.02 * least) << samples << " samples, each worth " << worth;
            least = std::min(least, error);
        }
    }
}

}  // namespace
}  // namespace halflight
