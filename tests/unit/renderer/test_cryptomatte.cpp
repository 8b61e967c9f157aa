// Tests ids, manifests and ranks of Cryptomatte against the examples of the specification.
#include "renderer/cryptomatte.h"

#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cmath>
#include <nlohmann/json.hpp>

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
    EXPECT_EQ(
        find_aov("cryptoobject")->channel_names(),
        (std::vector<std::string>{"CryptoObject00.R", "CryptoObject00.G", "CryptoObject00.B", "CryptoObject00.A",
                                  "CryptoObject01.R", "CryptoObject01.G", "CryptoObject01.B", "CryptoObject01.A",
                                  "CryptoObject02.R", "CryptoObject02.G", "CryptoObject02.B", "CryptoObject02.A"}));
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

}  // namespace
}  // namespace halflight
