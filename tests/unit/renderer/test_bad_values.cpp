// Tests counters of bad values with more samples than 32 bits can count.
#include "passes/picture/bad_values.h"

#include <gtest/gtest.h>

namespace halflight {
namespace {

TEST(BadValues, SumsDoNotWrap) {
    BadValueSums sums;
    std::array<std::uint32_t, kBadValueCounts> counts{};
    counts[1 * shared::kBadKinds + shared::kBadNan] = 0xffffffffu;
    counts[1 * shared::kBadKinds + shared::kBadNegative] = 1;
    counts[3 * shared::kBadKinds + shared::kBadInfinite] = 0x80000000u;
    for (int sample = 0; sample < 4; ++sample) sums.add(counts);
    const std::vector<BadValues> bad = sums.by_component();
    ASSERT_EQ(bad.size(), shared::kCountedPasses);
    EXPECT_EQ(bad[1].component, "shadow");
    EXPECT_EQ(bad[1].nans, 4 * 0xffffffffull);
    EXPECT_EQ(bad[1].negatives, 4u);
    EXPECT_EQ(bad[3].infinities, 0x200000000ull);
    EXPECT_EQ(bad[0].total() + bad[2].total(), 0u);
    EXPECT_EQ(bad[1].total(), 4 * 0x100000000ull);
    sums.reset();
    for (const BadValues& n : sums.by_component()) EXPECT_EQ(n.total(), 0u);
}

}  // namespace
}  // namespace halflight
