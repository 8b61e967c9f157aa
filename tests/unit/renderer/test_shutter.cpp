// Tests shutter times and the mean of pictures of several times, and Cryptomatte: ids, manifests and ranks, against
// the examples of its specification.
#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cmath>
#include <nlohmann/json.hpp>

#include "renderer/cryptomatte.h"
#include "renderer/shutter.h"

namespace halflight {
namespace {

// The expected values are published ones of MurmurHash3, for every length modulo 4.
TEST(Cryptomatte, NamesAreHashed) {
    EXPECT_EQ(murmur3(""), 0u);
    EXPECT_EQ(murmur3("a"), 0x3c2569b2u);
    EXPECT_EQ(murmur3("hello"), 0x248bfa47u);
    EXPECT_EQ(murmur3("hello, world"), 0x149bbb7fu);
    EXPECT_EQ(murmur3("The quick brown fox jumps over the lazy dog"), 0x2e4ff723u);
}

TEST(Cryptomatte, IdsAreNormalFloats) {
    ASSERT_EQ(murmur3("object 259"), 0x0069b367u);  // a denormal float
    EXPECT_EQ(std::bit_cast<std::uint32_t>(cryptomatte_id("object 259")), 0x00e9b367u);
    ASSERT_EQ(murmur3("object 858"), 0xff868043u);  // a NaN
    EXPECT_EQ(std::bit_cast<std::uint32_t>(cryptomatte_id("object 858")), 0xff068043u);
    EXPECT_EQ(std::bit_cast<std::uint32_t>(cryptomatte_id("hello")), 0x248bfa47u);
    for (int i = 0; i < 20000; ++i) ASSERT_TRUE(std::isnormal(cryptomatte_id("object " + std::to_string(i)))) << i;
}

TEST(Cryptomatte, HeadersDescribeTheHash) {
    const std::vector<std::string> names{"gold \"ball\"", "\xff", "hello", "hello"};
    const auto attributes = cryptomatte_attributes("CryptoObject", names);
    ASSERT_EQ(attributes.size(), 4u);
    // The key contains the first seven digits of the hash of the layer's name, 3ae39a58.
    EXPECT_EQ(attributes.at("cryptomatte/3ae39a5/name"), "CryptoObject");
    EXPECT_EQ(attributes.at("cryptomatte/3ae39a5/hash"), "MurmurHash3_32");
    EXPECT_EQ(attributes.at("cryptomatte/3ae39a5/conversion"), "uint32_to_float32");
    const nlohmann::json manifest = nlohmann::json::parse(attributes.at("cryptomatte/3ae39a5/manifest"));
    EXPECT_EQ(manifest.size(), 3u);
    EXPECT_EQ(manifest.at("hello"), "248bfa47");
    EXPECT_TRUE(manifest.contains("gold \"ball\""));
    const std::vector<std::string> channels = find_aov("cryptoobject")->channel_names();
    ASSERT_EQ(channels.size(), 12u);
    for (std::size_t i = 0; i < 12; ++i)
        EXPECT_EQ(channels[i], std::string("CryptoObject0") + "012"[i / 4] + "." + "RGBA"[i % 4]);
}

TEST(Cryptomatte, LargestCoverageComesFirst) {
    std::array<float, 2 * kCryptomatteRanks> ranks{};
    IdCoverage coverage(2);
    for (int id = 1; id <= 8; ++id)
        for (int sample = 0; sample < id; ++sample) coverage.add(1, static_cast<float>(id));
    coverage.add(1, 3.0f);  // equal coverage as id 4, and smaller bits
    coverage.rank(1, 64, ranks);
    for (std::size_t i = 0; i < kCryptomatteRanks; ++i) {
        const float ids[] = {8, 7, 6, 5, 3, 4}, samples[] = {8, 7, 6, 5, 4, 4};
        EXPECT_EQ(ranks[2 * i], ids[i]) << i;
        EXPECT_EQ(ranks[2 * i + 1], samples[i] / 64) << i;
    }
    coverage.rank(0, 64, ranks);
    for (const float v : ranks) EXPECT_EQ(v, 0);
    coverage.clear();
    coverage.rank(1, 64, ranks);
    for (const float v : ranks) EXPECT_EQ(v, 0);
}

TEST(ShutterTimes, AreOneInEachStratum) {
    for (const auto& [samples, times] : {std::pair(16, 4), {7, 3}, {5, 5}, {64, 1}}) {
        const std::vector<ShutterTime> all = shutter_times(samples, times, 1, 2);
        ASSERT_EQ(all.size(), static_cast<std::size_t>(times));
        int next = 0;
        for (const ShutterTime& t : all) {
            EXPECT_EQ(t.first_sample, next) << "of " << samples;
            EXPECT_GE(t.samples, samples / times);
            next += t.samples;
            EXPECT_GE(t.at * samples, t.first_sample) << "before its stratum";
            EXPECT_LT(t.at * samples, next) << "after its stratum";
        }
        EXPECT_EQ(next, samples);
    }
}

// Averaged over n frames, the time of each stratum is its middle, with a standard error of 1 / sqrt(12 n) of a stratum.
TEST(ShutterTimes, AreUniformOverFramesAndSeeds) {
    constexpr int kFrames = 4000, kTimes = 3;
    double sums[kTimes] = {}, product = 0;
    for (std::uint32_t i = 0; i < kFrames; ++i) {
        const auto all = shutter_times(kTimes, kTimes, i % 2, i / 2);
        for (int k = 0; k < kTimes; ++k) sums[k] += all[static_cast<std::size_t>(k)].at * kTimes - k;
        product += (all[0].at * kTimes - 0.5) * (all[1].at * kTimes - 1.5);
    }
    for (const double sum : sums) EXPECT_NEAR(sum / kFrames, 0.5, 4 / std::sqrt(12.0 * kFrames));
    EXPECT_LT(product / kFrames, 0.03) << "1/12: all strata have the same place in them";
    EXPECT_NE(shutter_times(8, 8, 3, 4)[5].at, shutter_times(8, 8, 3, 5)[5].at);
    EXPECT_NE(shutter_times(8, 8, 3, 4)[5].at, shutter_times(8, 8, 4, 4)[5].at);
}

const std::vector<std::string> kAovs = {"albedo", "variance", "samples", "ids", "cryptoobject"};

Image filled(int channels, std::initializer_list<float> values) {
    Image image;
    image.width = image.height = 1, image.channels = channels;
    image.pixels = values;
    image.pixels.resize(static_cast<std::size_t>(channels));
    return image;
}

/// Returns a picture of one pixel with `value` in all layers and object `name` in all samples.
RenderResult picture(float value, int samples, const std::string& name) {
    RenderResult r;
    r.beauty = filled(4, {value, value, value, 1});
    r.aovs = {{{}, filled(3, {value, 0, 0})},
              {{}, filled(3, {value, 0, 0})},
              {{}, filled(1, {static_cast<float>(samples)})},
              {{}, filled(3, {value, 0, 0}), ExrType::uint32},
              {{}, filled(12, {cryptomatte_id(name), 1})}};
    r.attributes = cryptomatte_attributes("CryptoObject", std::vector<std::string>{name});
    r.stats.samples = samples;
    r.stats.passes = {{"aov", 1, 2.0}};
    r.stats.bad_values = {{"shadow", 1, 0, 0}};
    return r;
}

TEST(ShutterMean, WeightsPicturesByTheirSamples) {
    ShutterMean mean(kAovs, 4);
    mean.add(picture(8, 1, "a"));
    mean.add(picture(4, 3, "b"));
    ASSERT_TRUE(mean.wants_still());
    const RenderResult r = mean.take(picture(7, 1, "c"));
    EXPECT_EQ(r.beauty.pixels, (std::vector<float>{5, 5, 5, 1}));
    EXPECT_EQ(r.aovs[0].image.pixels[0], 5) << "albedo";
    EXPECT_EQ(r.aovs[1].image.pixels[0], 8 / 16.0f + 4 * 9 / 16.0f) << "variance";
    EXPECT_EQ(r.aovs[2].image.pixels[0], 4) << "samples";
    EXPECT_EQ(r.aovs[3].image.pixels[0], 7) << "ids";
    const std::vector<float>& ranks = r.aovs[4].image.pixels;
    EXPECT_EQ(std::bit_cast<std::uint32_t>(ranks[0]), std::bit_cast<std::uint32_t>(cryptomatte_id("b")));
    EXPECT_EQ(ranks[1], 0.75f);
    EXPECT_EQ(std::bit_cast<std::uint32_t>(ranks[2]), std::bit_cast<std::uint32_t>(cryptomatte_id("a")));
    EXPECT_EQ(ranks[3], 0.25f);
    EXPECT_EQ(r.stats.samples, 4);
    EXPECT_EQ(r.stats.passes.at(0).runs, 2u);
    EXPECT_EQ(r.stats.bad_values.at(0).nans, 2u);
    for (const auto& [key, text] : r.attributes)
        if (key.ends_with("/manifest")) {
            EXPECT_EQ(nlohmann::json::parse(text).size(), 2u) << text;
        }
}

TEST(ShutterMean, NeedsAStillPictureOnlyForDataLayers) {
    EXPECT_FALSE(ShutterMean({"albedo", "variance", "cryptomaterial"}, 4).wants_still());
    EXPECT_TRUE(ShutterMean({"depth"}, 4).wants_still());
}

}  // namespace
}  // namespace halflight
