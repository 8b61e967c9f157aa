// Tests the shutter times of samples, and Cryptomatte: ids, manifests and ranks, against the examples of its
// specification.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "renderer/cryptomatte.h"
#include "renderer/frame_constants.h"
#include "renderer/listed_samples.h"

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

/// Returns the shutter times of a picture's first samples.
std::vector<double> times_of(int samples, int times, std::uint32_t seed, std::uint32_t frame,
                             SamplePoints points = SamplePoints::sobol) {
    FrameSettings settings;
    settings.seed = seed, settings.frame = frame, settings.shutter_times = times;
    std::vector<double> all;
    for (int k = 0; k < samples; ++k)
        all.push_back(sample_view(settings, Band{}, static_cast<std::uint32_t>(k), points).at);
    return all;
}

TEST(ShutterTimes, AreOneInEachStratum) {
    for (const int samples : {1, 4, 64, 256}) {
        std::vector<int> of_stratum(std::size_t(samples), 0);
        for (const double at : times_of(samples, 0, 1, 2)) {
            ASSERT_TRUE(at >= 0 && at < 1) << at;
            ++of_stratum[std::size_t(at * samples)];
        }
        EXPECT_EQ(std::ranges::count(of_stratum, 1), samples);
    }
}

TEST(ShutterTimes, AreSharedByEquallyManySamples) {
    for (const auto& [samples, times] : {std::pair(64, 8), {16, 4}, {64, 3}}) {
        std::map<double, int> counts;
        for (const double at : times_of(samples, times, 1, 2)) ++counts[at];
        ASSERT_EQ(counts.size(), std::size_t(times));
        int stratum = 0;
        for (const auto& [at, count] : counts) {
            EXPECT_EQ(std::floor(at * times), stratum++);
            EXPECT_NEAR(count, double(samples) / times, times == 3 ? 2 : 0);
        }
    }
}

// Averaged over n pictures, the time of a sample is 1/2 with a standard error of 1 / sqrt(12 n).
TEST(ShutterTimes, AreUniformOverFramesAndSeeds) {
    constexpr int kPictures = 4000, kSamples = 3;
    for (const int times : {0, 2})
        for (const SamplePoints points : {SamplePoints::sobol, SamplePoints::independent}) {
            double sums[kSamples] = {}, squares = 0;
            for (std::uint32_t i = 0; i < kPictures; ++i) {
                const auto all = times_of(kSamples, times, i % 2, i / 2, points);
                for (int k = 0; k < kSamples; ++k) sums[k] += all[std::size_t(k)];
                squares += (all[0] - 0.5) * (all[0] - 0.5);
            }
            for (const double sum : sums) EXPECT_NEAR(sum / kPictures, 0.5, 4 / std::sqrt(12.0 * kPictures)) << times;
            EXPECT_NEAR(squares / kPictures, 1 / 12.0, 4 / std::sqrt(180.0 * kPictures)) << times;
        }
}

TEST(ShutterTimes, OrderSamplesThatShareThem) {
    FrameSettings settings;
    const auto view = [&](int number) {
        return sample_view(settings, Band{}, static_cast<std::uint32_t>(number), SamplePoints::sobol);
    };
    EXPECT_TRUE(order_of_samples(settings, 0, 16, view).empty());
    settings.shutter_times = 0;
    EXPECT_TRUE(order_of_samples(settings, 0, 16, view).empty());
    settings.shutter_times = 4;
    std::vector<int> order = order_of_samples(settings, 16, 32, view);
    int changes = 0;
    for (std::size_t i = 1; i < order.size(); ++i) changes += view(order[i]).at != view(order[i - 1]).at;
    EXPECT_EQ(changes, 3) << "each pose is taken once";
    std::ranges::sort(order);
    for (int i = 0; i < 16; ++i) EXPECT_EQ(order[std::size_t(i)], 16 + i);
}

// Blocks take different numbers of samples. A run has samples of one time.
TEST(ShutterTimes, ListedSamplesOfARunShareOne) {
    FrameSettings settings;
    settings.shutter_times = 4;
    const auto view = [&](std::uint32_t number) { return sample_view(settings, Band{}, number, SamplePoints::sobol); };
    const std::vector<std::uint32_t> from{2, 0, 5, 3}, to{9, 0, 40, 4};
    ListedSamples listed(from, to, view);
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> taken;
    double last = -1;
    while (!listed.done()) {
        const double at = listed.at();
        EXPECT_GE(at, last);
        last = at;
        for (const shared::SampledBlock& entry : listed.next_run()) {
            if (entry.block == shared::kNoBlock) continue;
            const std::uint32_t number = entry.sample_and_half & ~shared::kInFirstHalf;
            EXPECT_EQ(view(number).at, at);
            ++taken[{entry.block, number}];
        }
    }
    EXPECT_EQ(listed.taken(), to);
    EXPECT_EQ(taken.size(), 7u + 35 + 1);
    for (const auto& [entry, times] : taken) {
        EXPECT_EQ(times, 1);
        EXPECT_TRUE(entry.second >= from[entry.first] && entry.second < to[entry.first]);
    }
}

}  // namespace
}  // namespace halflight
