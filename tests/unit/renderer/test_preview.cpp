// Tests the text form of preview modes, and the hand-over to unbiased samples.
#include "engine/settings/preview.h"

#include <gtest/gtest.h>

#include "renderer/hand_over.h"
#include "tests/support/error_message.h"

namespace halflight {
namespace {

TEST(Preview, TextRoundTrips) {
    for (const bool cache : {false, true}) {
        for (const bool temporal : {false, true}) {
            for (const bool filter : {false, true}) {
                const Preview preview{.cache = cache, .temporal = temporal, .filter = filter};
                EXPECT_EQ(preview_named(text(preview)), preview);
                EXPECT_EQ(preview.any(), cache || temporal || filter);
                EXPECT_EQ(preview.of_picture(), temporal || filter);
            }
        }
    }
    EXPECT_EQ(text(Preview()), "none");
    EXPECT_EQ(text({.cache = true, .temporal = true, .filter = true}), "cache,temporal,filter");
    EXPECT_EQ(preview_named("filter,cache"), preview_named("cache,filter"));
    EXPECT_EQ(known_previews(), "cache, temporal, filter");
}

TEST(Preview, UnknownModesAreNamed) {
    const auto message = [](const char* list) { return error_message([&] { preview_named(list); }); };
    EXPECT_EQ(message("blur"), "blur: 'blur' is no preview mode; there are: cache, temporal, filter");
    EXPECT_EQ(message("filter,filter"), "filter,filter: 'filter' is given twice");
    EXPECT_EQ(message("none,cache"), "none,cache: 'none' stands alone");
    EXPECT_EQ(message("cache,none"), "cache,none: 'none' stands alone");
    for (const char* list : {"", "filter,", ",filter", "Filter", "filter "}) EXPECT_NE(message(list), "") << list;
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
