#include "engine/core/suggestion.h"

#include <gtest/gtest.h>

namespace halflight::test {
namespace {

TEST(Suggestion, NamesTheLikeliestWord) {
    const std::vector<std::string> names = {"depth", "albedo", "direct_diffuse", "direct_glossy", "ids"};
    EXPECT_EQ(did_you_mean("depht", names), "; did you mean 'depth'?");     // swapped
    EXPECT_EQ(did_you_mean("deph", names), "; did you mean 'depth'?");      // missing
    EXPECT_EQ(did_you_mean("albeddo", names), "; did you mean 'albedo'?");  // too many
    EXPECT_EQ(did_you_mean("Direct_glosy", names), "; did you mean 'direct_glossy'?");
    EXPECT_EQ(did_you_mean("id", names), "") << "a third of two letters is none";
    EXPECT_EQ(did_you_mean("smell", names), "");
    EXPECT_EQ(did_you_mean("", names), "");
    EXPECT_EQ(did_you_mean(std::string(1000, 'a'), {std::string(1001, 'a')}), "") << "so long a word is no name";
    EXPECT_EQ(did_you_mean("depth", {}), "");
}

}  // namespace
}  // namespace halflight::test
