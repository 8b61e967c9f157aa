// Tests keyframe interpolation against its definition.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>

#include "engine/core/math.h"
#include "engine/scene/keyframes.h"
#include "tests/unit/renderer/refusal.h"

namespace halflight {
namespace {

Keyframes scalars(Interpolation interpolation, std::vector<float> times, std::vector<float> values) {
    return {interpolation, 1, false, std::move(times), std::move(values)};
}

double at(const Keyframes& keys, double seconds) {
    double value = std::nan("");
    sample(keys, seconds, {&value, 1});
    return value;
}

dvec4 turn_at(const Keyframes& keys, double seconds) {
    std::array<double, 4> q{};
    sample(keys, seconds, q);
    return {q[0], q[1], q[2], q[3]};
}

/// Returns the quaternion of a rotation about Z.
dvec4 turn(double degrees) {
    return {0, 0, std::sin(glm::radians(degrees) / 2), std::cos(glm::radians(degrees) / 2)};
}

Keyframes turns(Interpolation interpolation, const std::vector<dvec4>& values) {
    Keyframes keys{interpolation, 4, true, {}, {}};
    const std::size_t per_key = interpolation == Interpolation::cubic_spline ? 3 : 1;
    for (std::size_t k = 0; k < values.size() / per_key; ++k) keys.times.push_back(static_cast<float>(k));
    for (const dvec4& q : values)
        for (int i = 0; i < 4; ++i) keys.values.push_back(static_cast<float>(q[i]));
    return keys;
}

constexpr double kBeyondAll = 1e30;

TEST(Keyframes, AreHeldOrInterpolated) {
    const Keyframes step = scalars(Interpolation::step, {1, 2, 4}, {10, 20, 40});
    const Keyframes linear = scalars(Interpolation::linear, {1, 2, 4}, {10, 20, -20});
    for (const auto& [seconds, value] :
         {std::pair(-kBeyondAll, 10.0), {0, 10}, {1, 10}, {1.999, 10}, {2, 20}, {3, 20}, {4, 40}, {kBeyondAll, 40}})
        EXPECT_EQ(at(step, seconds), value) << seconds;
    for (const auto& [seconds, value] :
         {std::pair(-kBeyondAll, 10.0), {1, 10}, {1.25, 12.5}, {2, 20}, {3, 0}, {kBeyondAll, -20}})
        EXPECT_DOUBLE_EQ(at(linear, seconds), value) << seconds;
}

TEST(Keyframes, ConstantChannelsStayExact) {
    for (const double seconds : {0.0, 0.1, 1.0 / 3, 0.7, 1.0})
        EXPECT_EQ(at(scalars(Interpolation::linear, {0, 1}, {0.1f, 0.1f}), seconds), double{0.1f}) << seconds;
    for (const Interpolation i : {Interpolation::step, Interpolation::linear})
        for (const double seconds : {-kBeyondAll, 0.0, 5.0, kBeyondAll})
            EXPECT_EQ(at(scalars(i, {5}, {7}), seconds), 7) << seconds;
    EXPECT_EQ(at(scalars(Interpolation::cubic_spline, {5}, {1, 7, 2}), 5), 7) << "not its tangents";
}

TEST(Keyframes, TheLastOfSeveralKeysAtOneTimeCounts) {
    for (const Interpolation i : {Interpolation::step, Interpolation::linear}) {
        const Keyframes keys = scalars(i, {0, 1, 1, 1, 2}, {0, 10, 20, 30, 40});
        EXPECT_EQ(at(keys, 1), 30);
        EXPECT_NEAR(at(keys, std::nextafter(1.0f, 0.0f)), i == Interpolation::step ? 0 : 10, 1e-6) << "a jump";
        EXPECT_NEAR(at(keys, std::nextafter(1.0, 2.0)), 30, 1e-12);
    }
    EXPECT_EQ(at(scalars(Interpolation::linear, {3, 3}, {1, 2}), 3), 2);
    EXPECT_EQ(at(scalars(Interpolation::linear, {3, 3}, {1, 2}), 2), 1) << "before all";
}

/// Files store times as floats, which may be later than those of the frames.
TEST(Keyframes, KeysOfFramesHoldAtTheirFrames) {
    for (const int rate : {10, 24, 25, 30, 60}) {
        Keyframes keys{Interpolation::step, 1, false, {}, {}};
        for (int frame = 0; frame < 100; ++frame) {
            keys.times.push_back(static_cast<float>(double(frame) / rate));
            keys.values.push_back(static_cast<float>(frame));
        }
        for (int frame = 0; frame < 100; ++frame)
            EXPECT_EQ(at(keys, double(frame) / rate), frame) << rate << " per second";
    }
    // The jump of a linear animation is two keys at one time.
    const auto third = static_cast<float>(1 / 30.0);
    EXPECT_EQ(at(scalars(Interpolation::linear, {0, third, third, 1}, {0, 1, 5, 6}), 1 / 30.0), 5);
}

/// A Hermite spline is the cubic polynomial with the given values and derivatives.
TEST(Keyframes, CubicSplinesReproduceCubics) {
    const auto f = [](double t) { return t * t * t - 2 * t * t + 3 * t - 5; };
    const auto slope = [](double t) { return 3 * t * t - 4 * t + 3; };
    Keyframes keys{Interpolation::cubic_spline, 1, false, {-1, 0.5f, 4}, {}};
    for (const float t : keys.times)
        for (const double v : {slope(t), f(t), slope(t)}) keys.values.push_back(static_cast<float>(v));
    for (double t = -1; t <= 4; t += 0.0625) EXPECT_NEAR(at(keys, t), f(t), 1e-12 * (1 + std::abs(f(t)))) << t;
    EXPECT_EQ(at(keys, 9), f(4));
}

/// The weights of the four numbers follow glTF 2.0, appendix C.5, at t = 1/4 of a span of 2 s.
TEST(Keyframes, InAndOutTangentsAreNotSwapped) {
    const std::vector<std::vector<float>> unit = {
        {0, 1, 0, 0, 0, 0}, {0, 0, 1, 0, 0, 0}, {0, 0, 0, 1, 0, 0}, {0, 0, 0, 0, 1, 0}, {1, 0, 0, 0, 0, 1}};
    const double expected[] = {27.0 / 32, 2 * 9.0 / 64, 2 * -3.0 / 64, 5.0 / 32, 0};
    for (std::size_t i = 0; i < unit.size(); ++i)
        EXPECT_DOUBLE_EQ(at(scalars(Interpolation::cubic_spline, {1, 3}, unit[i]), 1.5), expected[i]) << i;
}

TEST(Keyframes, RotationsHaveConstantSpeedAndTakeTheShorterArc) {
    const Keyframes quarter = turns(Interpolation::linear, {turn(0), turn(90)});
    const Keyframes negated = turns(Interpolation::linear, {turn(0), -turn(90)});
    for (const double t : {0.0, 0.1, 0.3, 0.5, 0.99}) {
        EXPECT_LT(glm::distance(turn_at(quarter, t), turn(90 * t)), 1e-7) << t;
        EXPECT_LT(glm::distance(turn_at(negated, t), turn(90 * t)), 1e-7) << "the same rotation, " << t;
        EXPECT_NEAR(glm::length(turn_at(quarter, t)), 1, 1e-15);
    }
    const Keyframes far = turns(Interpolation::linear, {turn(10), turn(350)});
    EXPECT_LT(glm::distance(turn_at(far, 0.5), turn(0)), 1e-7) << "20 degrees, not 340";
    const Keyframes tiny = turns(Interpolation::linear, {turn(30), turn(30.0001)});
    EXPECT_LT(glm::distance(turn_at(tiny, 0.5), turn(30.00005)), 1e-7);
}

TEST(Keyframes, RotationsAreNormalized) {
    const Keyframes long_ones = turns(Interpolation::linear, {7.0 * turn(0), 0.01 * turn(90)});
    EXPECT_LT(glm::distance(turn_at(long_ones, 0.5), turn(45)), 1e-6);
    EXPECT_NEAR(glm::length(turn_at(long_ones, 0)), 1, 1e-15);
    const dvec4 none(0);
    const Keyframes spline = turns(Interpolation::cubic_spline, {none, turn(0), none, none, turn(90), none});
    EXPECT_LT(glm::distance(turn_at(spline, 0.5), turn(45)), 1e-6);
    EXPECT_NEAR(glm::length(turn_at(spline, 0.25)), 1, 1e-15);
    const Keyframes through_zero = turns(Interpolation::cubic_spline, {none, turn(20), none, none, -turn(20), none});
    EXPECT_LT(glm::distance(turn_at(through_zero, 0.5), turn(20)), 1e-7) << "where there is none, the key before";
    EXPECT_EQ(turn_at(turns(Interpolation::linear, {none}), 0), dvec4(0, 0, 0, 1));
}

TEST(Keyframes, LargeValuesStayFinite) {
    constexpr float kLargest = std::numeric_limits<float>::max();
    EXPECT_TRUE(std::isfinite(at(scalars(Interpolation::linear, {0, 1}, {kLargest, -kLargest}), 0.5)));
    const std::vector<float> all(6, kLargest);
    EXPECT_TRUE(std::isfinite(at(scalars(Interpolation::cubic_spline, {-kLargest, kLargest}, all), 1)));
}

TEST(Keyframes, InvalidChannelsAreRefused) {
    const Interpolation linear = Interpolation::linear;
    const float nan = std::nanf(""), infinite = std::numeric_limits<float>::infinity();
    const std::pair<Keyframes, const char*> refusals[] = {
        {scalars(linear, {}, {}), "has no keys"},
        {scalars(linear, {0, 2, 1}, {1, 2, 3}), "key 2 at 1 s"},
        {scalars(linear, {0, nan}, {1, 2}), "time of key 1"},
        {scalars(linear, {-infinite}, {1}), "time of key 0"},
        {scalars(linear, {0, 1}, {1, infinite}), "key 1 is not finite"},
        {scalars(Interpolation::cubic_spline, {0, 1}, {1, 2, 3, 4, nan, 6}), "key 1 is not finite"},
        {scalars(linear, {0, 1}, {1, 2, 3}), "3 numbers for 2 keys"},
        {{linear, 3, true, {0}, {1, 2, 3}}, "a rotation has 4 numbers"}};
    for (const auto& [keys, element] : refusals)
        expect_refusal([&] { check_keyframes(keys, "keys"); }, element, "keys: ");
    EXPECT_NO_THROW(check_keyframes(scalars(linear, {1, 1}, {1, 2}), "keys"));
}

}  // namespace
}  // namespace halflight
