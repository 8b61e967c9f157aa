// Tests the arithmetic that C++ and shaders share.
#include <gtest/gtest.h>

#include <bit>

namespace halflight {
namespace {

// (1 + 2^-12)^2 rounds to 1 + 2^-11. A fused operation keeps the 2^-24 that the rounding drops.
TEST(Arithmetic, ProductsAreRoundedBeforeTheyAreAdded) {
    volatile float factor = 1 + 0x1p-12f, term = -(1 + 0x1p-11f);
    const float a = factor, b = term;
    EXPECT_EQ(a * a + b, 0.0f);
    volatile double wide_factor = 1 + 0x1p-27, wide_term = -(1 + 0x1p-26);
    const double c = wide_factor, d = wide_term;
    EXPECT_EQ(c * c + d, 0.0);
}

TEST(Arithmetic, TheFirstByteIsTheLowest) {
    EXPECT_TRUE(std::endian::native == std::endian::little);
}

}  // namespace
}  // namespace halflight
