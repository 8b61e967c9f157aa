#include "engine/core/metrics.h"

#include <gtest/gtest.h>

#include <vector>

namespace halflight {
namespace {

Image image_of(int width, int channels, std::vector<float> values) {
    Image image(width, static_cast<int>(values.size()) / (width * channels), channels);
    image.pixels = std::move(values);
    return image;
}

TEST(RelativeMse, IsRelativeToTheReference) {
    using Values = std::vector<double>;
    EXPECT_EQ(relative_mse(Values{1, 2}, Values{1, 2}), 0);
    EXPECT_EQ(relative_mse(Values{}, Values{}), 0);
    EXPECT_NEAR(relative_mse(Values{110, 0}, Values{100, 0}), 0.5 * 0.01, 1e-7);
    EXPECT_NEAR(relative_mse(Values{0, 0.1}, Values{0, 0}), 0.5, 1e-12);
    EXPECT_NEAR(relative_mse(Values{0.1, 9, 0, 0.1}, Values{0, 0, 0, 0}, 0.25), 2.0 / 3, 1e-12);  // omits the value 9
}

TEST(ErrorMaps, AreMeansOverChannels) {
    const Image a = image_of(2, 3, {1, 2, 3, 4, 5, 6}), b = image_of(2, 3, {1, 2, 0, 4, 7, 7});
    const Image squares = squared_error_map(a, b), relative = relative_squared_error_map(a, b);
    ASSERT_EQ(squares.channels, 1);
    EXPECT_FLOAT_EQ(squares.pixels[0], 3);
    EXPECT_FLOAT_EQ(squares.pixels[1], 5.0f / 3);
    EXPECT_NEAR(relative.pixels[0], 9 / 0.01 / 3, 1e-3);
    EXPECT_NEAR(relative.pixels[1], (4 / 49.01 + 1 / 49.01) / 3, 1e-7);
    EXPECT_NEAR(mean_of(squares), 7.0 / 3, 1e-7);
}

TEST(WorstShare, DistinguishesFirefliesFromNoise) {
    std::vector<float> even(10000, 1.0f);
    EXPECT_NEAR(worst_share(even), 0.001, 1e-9);
    for (std::size_t i = 0; i < 10; ++i) even[i * 997] = 1000;
    EXPECT_NEAR(worst_share(even), 10000.0 / (10000 + 9990), 1e-6);
    EXPECT_EQ(worst_share(std::vector<float>(5, 0.0f)), 0);
    EXPECT_EQ(worst_share(std::vector<float>{1, 3}), 0.75);  // one pixel counts at least
    EXPECT_EQ(worst_share({}), 0);
}

}  // namespace
}  // namespace halflight
