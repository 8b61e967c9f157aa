// Tests fingerprints as texts of keys and values.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "engine/core/key_text.h"

namespace halflight {
namespace {

const std::string kSources = "sources=0123456789abcdef";

TEST(KeyText, LongAndUnusualValuesAreHashed) {
    KeyText keys;
    keys.add("sources", "0123456789abcdef").add("samples", "16").add("variant", "red;samples=4");
    EXPECT_EQ(keys.text().substr(0, 43), kSources + ";samples=16;variant");
    EXPECT_EQ(value_of(keys.text(), "samples"), "16");
    const std::string variant = value_of(keys.text(), "variant");
    EXPECT_EQ(variant.size(), 16u);
    EXPECT_NE(value_of(KeyText().add("variant", "red;samples=5").text(), "variant"), variant);
    EXPECT_EQ(value_of(KeyText().add("aov", std::string(100, 'a')).text(), "aov").size(), 16u);
    EXPECT_EQ(value_of(keys.text(), "seed"), "");
}

TEST(KeyText, DifferencesAreNamedKeyByKey) {
    const std::string expected = kSources + ";samples=16;scene=aaaaaaaaaaaaaaaa;frame=4";
    EXPECT_EQ(differences("sources=fedcba9876543210;seed=3;scene=bbbbbbbbbbbbbbbb;frame=4", expected),
              "sources is fedcba9876543210, not 0123456789abcdef; samples is as usual, not 16; scene differs; "
              "seed is 3, not as usual");
    EXPECT_EQ(differences("0123456789abcdef", expected), "it has no fingerprint of this program");
    EXPECT_EQ(differences("", expected), "it has no fingerprint of this program");
}

TEST(KeyText, OtherSourcesAreAcceptedAlone) {
    const std::string own = "3333333333333333", expected = "sources=3333333333333333;samples=16";
    const std::string found = "sources=fedcba9876543210;samples=16", third = "sources=1111111111111111;samples=16";
    const std::vector<std::string> none, accepted{"1111111111111111", "fedcba9876543210"};
    EXPECT_TRUE(same_keys(expected, expected, own, none));
    EXPECT_FALSE(same_keys(found, expected, own, none));
    EXPECT_TRUE(same_keys(found, expected, own, accepted));
    EXPECT_TRUE(same_keys(expected, found, own, accepted)) << "a frame of this program beside one of other sources";
    EXPECT_TRUE(same_keys(found, third, own, accepted));
    EXPECT_FALSE(same_keys(expected, kSources + ";samples=16", own, accepted));
    EXPECT_FALSE(same_keys(found + ";seed=1", expected, own, accepted));
    EXPECT_FALSE(same_keys("sources=2222222222222222;samples=16", expected, own, accepted));
    EXPECT_FALSE(same_keys("", expected, own, accepted));
}

}  // namespace
}  // namespace halflight
