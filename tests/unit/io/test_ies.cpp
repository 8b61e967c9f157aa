// Tests the reader of light profiles: editions, symmetries, factors, odd and damaged files.
#include "engine/io/ies.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "engine/core/error.h"
#include "tests/support/error_message.h"
#include "tests/support/ies_files.h"

namespace halflight::test {
namespace {

/// Returns the intensity of the entry at two angles, degrees; -1 if the profile has no such entry.
double candela_at(const LightProfile& profile, double v, double h) {
    const auto find = [](const std::vector<float>& angles, double degrees) {
        for (std::size_t i = 0; i < angles.size(); ++i)
            if (std::abs(glm::degrees(double{angles[i]}) - degrees) < 1e-4) return i;
        return angles.size();
    };
    const std::size_t row = find(profile.vertical, v), column = find(profile.horizontal, h);
    if (row == profile.vertical.size() || column == profile.horizontal.size()) return -1;
    return double{profile.candela} * double{profile.shares[column * profile.vertical.size() + row]};
}

TEST(IesFiles, HaveTheIntensitiesOfTheirTables) {
    for (const IesFile& file : {downlight(), street_lamp(), washer()}) {
        const LightProfile profile = read_ies("a.ies", file.text());
        const double factor = file.multiplier * file.ballast * (file.first_line == "IESNA91" ? file.lamp : 1);
        for (const double v : file.vertical)
            for (const double h : file.horizontal)
                EXPECT_NEAR(candela_at(profile, v, h), factor * file.candela(v, h), 1e-5 * double{profile.candela})
                    << file.first_line << ' ' << v << ' ' << h;
        EXPECT_EQ(profile.horizontal.back(), file.horizontal.size() == 1 ? 0 : float(2 * kPi));
    }
}

TEST(IesFiles, AreCompletedByTheirSymmetry) {
    IesFile file{.vertical = {0, 90, 180}, .candela = [](double v, double h) { return 1 + v + 2 * h; }};
    const auto read = [&](std::vector<double> angles) {
        file.horizontal = std::move(angles);
        return read_ies("a.ies", file.text());
    };
    struct Pair {
        double given, other;
    };
    const auto expect_alike = [&](const LightProfile& profile, const std::vector<Pair>& pairs) {
        for (const auto& [given, other] : pairs) {
            EXPECT_NEAR(candela_at(profile, 90, given), file.candela(90, given), 1e-3) << given;
            EXPECT_NEAR(candela_at(profile, 90, other), file.candela(90, given), 1e-3) << given << ' ' << other;
        }
    };
    expect_alike(read({0, 30, 90}), {{0, 180}, {0, 360}, {30, 150}, {30, 210}, {30, 330}, {90, 270}});
    expect_alike(read({0, 30, 120, 180}), {{0, 360}, {30, 330}, {120, 240}});
    expect_alike(read({90, 100, 180, 250, 270}), {{100, 80}, {180, 0}, {180, 360}, {250, 290}, {270, 270}});
    expect_alike(read({0, 90, 180, 270}), {{0, 360}, {270, 270}});  // the last angle is left out
    EXPECT_EQ(read({0}).shares.size(), 3u);
}

TEST(IesFiles, OfEarlyEditionsHaveABallastLampFactor) {
    IesFile file = downlight();
    file.lamp = 0.5;
    for (const auto& [line, factor] : {std::pair("", 0.5),
                                       {"IESNA91", 0.5},
                                       {"IESNA:LM-63-1986", 0.5},
                                       {"IESNA:LM-63-1995", 1.0},
                                       {"IESNA:LM-63-2002", 1.0},
                                       {"IES:LM-63-2019", 1.0}}) {
        file.first_line = line;
        EXPECT_NEAR(read_ies("a.ies", file.text()).candela, factor * file.candela(0, 0), 1e-3) << line;
    }
}

TEST(IesFiles, MayHaveTiltFactors) {
    IesFile file = downlight();
    const LightProfile plain = read_ies("a.ies", file.text());
    for (const char* tilt : {"INCLUDE\n1\n3\n0 45 90\n1 0.9, 0.8", "tilt.dat", " NONE"}) {
        file.tilt = tilt;
        EXPECT_EQ(read_ies("a.ies", file.text()), plain) << tilt;
    }
    file.tilt = "INCLUDE\n1\n3\n0 45 45\n1 0.9 0.8";
    EXPECT_NE(error_message([&] { read_ies("a.ies", file.text()); }).find("a.ies: TILT angle 3 is 45"),
              std::string::npos);
}

TEST(IesFiles, HaveExactMeans) {
    IesFile even{.vertical = {0, 37, 180}, .horizontal = {0, 10, 90}, .candela = [](double, double) { return 5.0; }};
    EXPECT_NEAR(mean_share(read_ies("a.ies", even.text())), 1, 1e-6);
    EXPECT_NEAR(lit_cone(read_ies("a.ies", even.text())).angle, kPi, 1e-6);
    even.vertical = {0, 90};
    LightProfile half = read_ies("a.ies", even.text());
    EXPECT_NEAR(mean_share(half), 0.5, 1e-6);
    EXPECT_NEAR(lit_cone(half).share, 1, 1e-6);
    even.vertical = {90, 180};
    half = read_ies("a.ies", even.text());
    EXPECT_TRUE(lit_cone(half).reversed);
    EXPECT_NEAR(lit_cone(half).angle, kPi / 2, 1e-6);
    const LightProfile all = read_ies("a.ies", washer().text());
    double sum = 0;  // midpoint rule
    constexpr int kSteps = 720;
    for (int i = 0; i < kSteps; ++i) {
        const double v = kPi * (i + 0.5) / kSteps;
        const std::size_t row = std::min<std::size_t>(std::size_t(v / kPi * 24), 23);
        const double w = v / kPi * 24 - double(row);
        for (std::size_t h = 0; h + 1 < all.horizontal.size(); ++h) {
            double value = 0;
            for (const std::size_t at : {h, h + 1})
                value += (1 - w) * double{all.shares[at * 25 + row]} + w * double{all.shares[at * 25 + row + 1]};
            sum += value / 2 * (double{all.horizontal[h + 1]} - double{all.horizontal[h]}) / (2 * kPi) * std::sin(v) *
                   (kPi / kSteps) / 2;
        }
    }
    EXPECT_NEAR(mean_share(all), sum, 1e-5);
}

/// Returns a text with its first `from` replaced.
std::string changed(std::string text, const std::string& from, const std::string& to) {
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return text.replace(at, from.size(), to);
}

/// Returns the angles V and H of types A and B, degrees, of a direction of type C, radians.
std::pair<double, double> angles_of(int type, double v, double h) {
    const dvec3 d(std::sin(v) * std::cos(h), std::sin(v) * std::sin(h), std::cos(v));  // X, Y, direction of the lamp
    return type == 3 ? std::pair(glm::degrees(std::asin(d.x)), glm::degrees(std::atan2(-d.y, d.z)))
                     : std::pair(glm::degrees(std::atan2(d.x, d.z)), -glm::degrees(std::asin(d.y)));
}

/// Returns the mean over all directions of a file of type A or B, whose angles begin at `least`, in steps of 0.25
/// degrees.
double mean_of(const IesFile& file, double least) {
    double sum = 0;
    for (double v = least + 0.125; v < 90; v += 0.25)
        for (double h = least + 0.125; h < 90; h += 0.25)
            sum += file.candela(v, h) * std::cos(glm::radians(file.type == 3 ? v : h));
    return sum * glm::radians(0.25) * glm::radians(0.25) / (4 * kPi);
}

TEST(IesFiles, OfTypesAAndBHaveAnAxisAcrossTheirDirection) {
    for (const int type : {2, 3}) {
        // A beam whose centre is 20 degrees from the direction towards X, and 30 clockwise from it.
        const auto candela = [](double v, double h) {
            return 1000 * std::exp(-((v - 20) * (v - 20) + (h - 30) * (h - 30)) / 200);
        };
        IesFile file{
            .vertical = degrees(-90, 90, 2), .horizontal = degrees(-90, 90, 2), .candela = candela, .type = type};
        const LightProfile profile = read_ies("a.ies", file.text());
        double worst = 0;
        for (std::size_t i = 0; i < profile.horizontal.size(); ++i)
            for (std::size_t j = 0; j < profile.vertical.size(); ++j) {
                const auto [v, h] = angles_of(type, profile.vertical[j], profile.horizontal[i]);
                const double found = double{profile.candela} * double{profile.shares[i * profile.vertical.size() + j]};
                worst = std::max(worst, std::abs(found - candela(v, h)));
            }
        EXPECT_LT(worst, 10) << "2 h^2 / 8 times the second derivative, for steps h of 2 degrees";
        EXPECT_NEAR(mean_share(profile) * double{profile.candela} / mean_of(file, -90), 1, 0.01) << type;
        EXPECT_NEAR(profile.candela, 1000, 10);
        EXPECT_EQ(profile.vertical.back(), float(kPi / 2)) << "is dark behind";

        file.vertical = file.horizontal = degrees(0, 90, 5);  // a quarter
        file.candela = [](double v, double h) { return 1000 * std::exp(-(v * v / 300 + h * h / 900)); };
        const LightProfile quarter = read_ies("a.ies", file.text());
        EXPECT_NEAR(mean_share(quarter) * double{quarter.candela} / (4 * mean_of(file, 0)), 1, 0.01) << type;
        for (const double h : {0, 180}) EXPECT_NEAR(candela_at(quarter, 30, h), file.candela(30, 0), 1) << type;
        for (const double h : {90, 270}) EXPECT_NEAR(candela_at(quarter, 30, h), file.candela(0, 30), 1) << type;
    }
}

TEST(IesFiles, OfTypesAAndBMayBeNarrowOrGoAround) {
    // A searchlight of half a degree beside its axis: no fixed step of half a degree would meet it.
    IesFile file{.vertical = {1.1, 1.3, 1.5},
                 .horizontal = {0.1, 0.3, 0.6},
                 .candela = [](double, double) { return 1e6; },
                 .type = 2};
    const LightProfile narrow = read_ies("a.ies", file.text());
    const double area = glm::radians(0.4) * glm::radians(0.5);
    EXPECT_NEAR(mean_share(narrow) * double{narrow.candela} / (1e6 * area / (4 * kPi)), 1, 0.1);
    EXPECT_EQ(narrow.candela, 1e6f);

    file = {.vertical = {-90, 0, 90},
            .horizontal = {-180, 0, 90, 180},
            .candela = [](double, double h) { return std::abs(h); },
            .type = 3};
    const LightProfile around = read_ies("a.ies", file.text());
    EXPECT_NEAR(candela_at(around, 180, 0), 180, 1e-3) << "behind";
    EXPECT_NEAR(candela_at(around, 90, 270), 90, 1e-3) << "to -Y";
    EXPECT_NEAR(candela_at(around, 90, 90), 90, 1e-3);

    file.horizontal = file.vertical = degrees(-90, 90, 0.4);
    EXPECT_LE(read_ies("a.ies", file.text()).shares.size(), kMostIesValues);
}

TEST(IesFiles, ThatAreDamagedAreNamedWithTheElement) {
    IesFile file{.vertical = {0, 45, 90}, .horizontal = {0, 90}, .candela = [](double v, double h) { return v + h; }};
    const std::string good = file.text();
    EXPECT_EQ(error_message([&] { read_ies("a.ies", good); }), "");
    IesFile lone = file;
    lone.type = 2, lone.horizontal = {0};
    std::string many_lines;
    for (int i = 0; i < 1 << 18; ++i) many_lines += "a\n";
    const std::pair<std::string, const char*> kCases[] = {
        {"", "has no line TILT="},
        {"IESNA:LM-63-2002\n[TEST]\n", "has no line TILT="},
        {changed(good, "1 -1 1 3 2 1", "1 -1"), "number of vertical angles"},
        {lone.text(), "has one horizontal angle"},
        {changed(good, "1 2 0 0 0\n1 1 18.5\n0 45 90\n", "2 2 0 0 0\n1 1 18.5\n0 45 190\n"),
         "vertical angle 3 is 190, not from -180"},
        {changed(good, "1 2 0 0 0\n1 1 18.5\n0 45 90\n", "3 2 0 0 0\n1 1 18.5\n0 45 91\n"),
         "vertical angle 3 is 91, not from -90"},
        {changed(good, " 3 2 1 2 ", " 3 2 4 2 "), "photometric type is 4"},
        {changed(good, " 3 2 1 2 ", " 3 2 1 7 "), "type of units is 7"},
        {changed(good, " 3 2 1 2 ", " 1 2 1 2 "), "number of vertical angles is 1"},
        {changed(good, " 3 2 1 2 ", " 3 0 1 2 "), "number of horizontal angles is 0"},
        {changed(good, " 3 2 1 2 ", " 3 1e9 1 2 "), "number of horizontal angles is 1000000000"},
        {changed(good, " 3 2 1 2 ", " 262144 262144 1 2 "), "has 262144 x 262144 candela values"},
        {changed(good, " 3 2 1 2 ", " 3 3 1 2 "), "horizontal angle 3 is 0, not greater than 90"},
        {changed(good, " 3 2 1 2 ", " 2 2 1 2 "), "horizontal angle 2 is 0, not greater than 90"},
        {changed(good, "0 45 90\n", "0 45 45\n"), "vertical angle 3 is 45, not greater than 45"},
        {changed(good, "0 45 90\n", "0 45 190\n"), "vertical angle 3 is 190"},
        {changed(good, "0 45 90\n0 90\n", "0 45 90\n0 100\n"), "horizontal angles end at 100"},
        {changed(good, "0 45 90\n0 90\n", "0 45 90\n10 90\n"), "horizontal angles begin at 10"},
        {changed(good, "0 45 90\n0 90\n", "0 45 90\n0 nan\n"), "horizontal angle 2 of 2 is 'nan', not a number"},
        {changed(good, "90 135 180", "90 -135 180"), "candela value 5 of 6 is -135"},
        {changed(good, "90 135 180", "90 1e400 180"), "candela value 5 of 6 is '1e400', not a number"},
        {changed(good, "90 135 180", "90 x 180"), "candela value 5 of 6 is 'x', not a number"},
        {changed(good, "90 135 180", "90 135"), "ends before candela value 6 of 6"},
        {good + " 7\n", "has more numbers than its 3 x 2 candela values"},
        {changed(good, "1 -1 1 3", "1 -1 0 3"), "candela multiplier is 0, not positive"},
        {changed(good, "1 1 18.5", "0 1 18.5"), "ballast factor is 0, not positive"},
        {std::string(kMostIesBytes + 1, ' '), "more than"},
        {many_lines + std::string(many_lines.size(), ' '), "has no line TILT="},  // in linear time
    };
    for (const auto& [text, part] : kCases) {
        const std::string message = error_message([&] { read_ies("a.ies", text); });
        EXPECT_TRUE(message.starts_with("a.ies: ") && message.find(part) != std::string::npos &&
                    message.find('\n') == std::string::npos)
            << part << ": " << message;
    }
    // Any cut, and any changed byte, gives a profile or one line.
    std::mt19937 random(1);
    for (std::size_t i = 0; i < 2000; ++i) {
        std::string text = i < good.size() ? good.substr(0, i) : good;
        if (i >= good.size()) text[random() % text.size()] = static_cast<char>(random());
        const std::string message = error_message([&] { read_ies("a.ies", text); });
        EXPECT_TRUE(message.empty() || (message.starts_with("a.ies: ") && message.find('\n') == std::string::npos))
            << message;
    }
}

}  // namespace
}  // namespace halflight::test
