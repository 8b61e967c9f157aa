#include <gtest/gtest.h>

#include "engine/core/error.h"
#include "engine/core/statistics.h"

namespace halflight {
namespace {

TEST(RunningMoments, KeepsVarianceBesideALargeMean) {
    RunningMoments m;
    for (int i = 0; i < 1000; ++i) m.add(1e9 + (i % 2));
    EXPECT_DOUBLE_EQ(m.mean(), 1e9 + 0.5);
    EXPECT_NEAR(m.variance(), 0.25 * 1000 / 999, 1e-9);
}

TEST(Quantile, Interpolates) {
    EXPECT_DOUBLE_EQ(median({3, 1, 2}), 2);
    EXPECT_DOUBLE_EQ(quantile({0, 10}, 0.25), 2.5);
}

TEST(Error, IsOneLine) {
    EXPECT_STREQ(Error("a.gltf", "bad\nthing {}", 3).what(), "a.gltf: bad thing 3");
}

}  // namespace
}  // namespace halflight
