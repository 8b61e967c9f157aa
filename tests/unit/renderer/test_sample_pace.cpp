// Tests predictions of when samples end.
#include <gtest/gtest.h>

#include "renderer/sample_pace.h"

namespace halflight {
namespace {

TEST(SamplePace, ExpectsTheMeanOfTheSamples) {
    SamplePace pace;
    pace.add(2, 0);
    EXPECT_TRUE(pace.another_fits(4));
    EXPECT_FALSE(pace.another_fits(3.9));
    pace.add(3, 0);
    EXPECT_TRUE(pace.another_fits(4.5));
    EXPECT_FALSE(pace.another_fits(4.4));
    EXPECT_EQ(pace.overhead(), 0);
}

TEST(SamplePace, LeavesOutTheCompilationOfShaders) {
    SamplePace pace;
    pace.add(3, 1);
    EXPECT_EQ(pace.overhead(), 3);
    EXPECT_TRUE(pace.another_fits(4)) << "nothing is known about samples that compile nothing";
    EXPECT_FALSE(pace.another_fits(2.9));
    pace.add(3.5, 1);
    EXPECT_EQ(pace.overhead(), 2.5);
    EXPECT_TRUE(pace.another_fits(4));
    EXPECT_FALSE(pace.another_fits(3.9));
}

TEST(SamplePace, OneShaderDoesNotExcuseALongSample) {
    SamplePace pace;
    pace.add(60, 1);
    EXPECT_LT(pace.overhead(), 10);
    EXPECT_FALSE(pace.another_fits(65));
    EXPECT_TRUE(pace.another_fits(115));
}

TEST(SamplePace, SlowSamplesAfterAQuickStartHaveNoOverhead) {
    SamplePace pace;
    pace.add(1, 1);
    pace.add(4, 1);
    EXPECT_EQ(pace.overhead(), 0);
}

}  // namespace
}  // namespace halflight
