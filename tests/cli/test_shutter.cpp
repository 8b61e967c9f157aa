// Tests motion blur: known profiles, and no blur of static scenes.
#include <fmt/format.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <map>
#include <numeric>
#include <tuple>

#include "renderer/cryptomatte.h"
#include "tests/cli/animated_scenes.h"
#include "tests/cli/command_test.h"

namespace halflight::test {
namespace {

const std::string kCornell = HALFLIGHT_SOURCE_DIR "/scenes/cornell.glb";
constexpr int kSide = 32;               // pixels
constexpr double kPixel = 4.0 / kSide;  // world units per pixel

class Shutter : public CommandTest {
  protected:
    Outcome run(const std::string& scene, const Strings& more) {
        return run_program(words("render", scene, "--width 32 --height 32 --fps 1", more));
    }
    ExrFile picture(const std::string& scene, const Strings& more) {
        const Outcome outcome = run(scene, words(file("picture.exr"), more));
        EXPECT_EQ(outcome.status, 0) << outcome.err;
        return read_exr(file("picture.exr"));
    }
    /// Returns the values of a channel in the middle row.
    static std::vector<double> row(const ExrFile& file, const std::string& channel) {
        const std::vector<float>& values = file.find(channel)->values;
        return {values.begin() + kSide * kSide / 2, values.begin() + kSide * (kSide / 2 + 1)};
    }

    const std::string sliding = write_sliding_light(folder.path);
};

/// Returns the mean coverage of a pixel, over the shutter interval, by a square of side 1 that moves from -travel / 2
/// to travel / 2.
double covered(int pixel, double travel) {
    constexpr int kSteps = 256;
    double sum = 0;
    for (int i = 0; i < kSteps; ++i) {
        const double x = (pixel + (i + 0.5) / kSteps) * kPixel - 2;
        const double from = std::max(x - 0.5, -travel / 2), to = std::min(x + 0.5, travel / 2);
        sum += std::max(to - from, 0.0) / travel;
    }
    return sum / kSteps;
}

double rms_error(const std::vector<double>& profile, double travel) {
    double sum = 0;
    for (int x = 0; x < kSide; ++x) {
        const double error = profile[static_cast<std::size_t>(x)] - covered(x, travel);
        sum += error * error;
    }
    return std::sqrt(sum / kSide);
}

// Each of the 32 times is known to 1/32 of the path of 2 units, which is half a pixel. The width of a pixel adds to
// this, so four times are uncertain at each edge.
TEST_F(Shutter, MovingSquareHasTheProfileOfItsPath) {
    const std::map<const char*, const char*> movements = {{"the square", "--animation slide --camera still"},
                                                          {"the camera", "--animation pan --camera panning"}};
    for (const auto& [what, movement] : movements) {
        for (const double open : {1.0, 0.5}) {
            SCOPED_TRACE(fmt::format("{} moves, shutter {}", what, open));
            std::vector<double> mean(kSide, 0.0);
            constexpr int kSeeds = 4;
            for (int seed = 0; seed < kSeeds; ++seed) {
                const std::vector<double> one =
                    row(picture(sliding, words("--frame 1 --samples 32 --shutter-times 32", movement, "--shutter",
                                               std::to_string(open), "--seed", std::to_string(seed))),
                        "R");
                double light = 0;
                for (int x = 0; x < kSide; ++x) {
                    const double value = one[static_cast<std::size_t>(x)];
                    EXPECT_NEAR(value, covered(x, 2 * open), 8.0 / 32 / 2) << x;
                    light += value;
                    mean[static_cast<std::size_t>(x)] += value / kSeeds;
                }
                EXPECT_NEAR(light * kPixel, 1, 0.1) << "what leaves one pixel is in another";
            }
            EXPECT_LT(rms_error(mean, 2 * open), 0.02);
        }
    }
    const ExrFile sharp = picture(sliding, words("--frame 1 --animation slide --camera still"));
    EXPECT_GT(rms_error(row(sharp, "R"), 2), 0.2) << "without --shutter";
}

TEST_F(Shutter, CameraAndSquareMoveInOppositeDirections) {
    const ExrFile file = picture(
        sliding, words("--frame 1 --samples 32 --animation all --camera panning", "--shutter 0.5 --shutter-times 32"));
    EXPECT_LT(rms_error(row(file, "R"), 2), 0.05) << "twice as fast as each of them";
}

TEST_F(Shutter, MattesHaveTheCoverageOfTheirLight) {
    const ExrFile file =
        picture(sliding, words("--frame 1 --samples 32 --animation slide --camera still --shutter 1",
                               "--aov cryptoobject,depth --estimator camera=1"));  // one ray gives both
    const auto light = row(file, "R"), coverage = row(file, "CryptoObject00.G"), depth = row(file, "Z");
    const std::vector<float>& ids = file.find("CryptoObject00.R")->values;
    int partly = 0;
    for (std::size_t x = 0; x < kSide; ++x) {
        EXPECT_NEAR(coverage[x], light[x], 1e-6) << x;
        if (light[x] > 0) {
            EXPECT_EQ(std::bit_cast<std::uint32_t>(ids[kSide * kSide / 2 + x]),
                      std::bit_cast<std::uint32_t>(cryptomatte_id("slider")));
        }
        partly += light[x] > 0 && light[x] < 1 ? 1 : 0;
        const bool inside = x >= 12 && x < 20;  // coverage at the frame's own time
        EXPECT_NEAR(depth[x], inside ? 5 : 1e10, 1e-4) << x;
    }
    EXPECT_GT(partly, 16);
}

TEST_F(Shutter, StaticScenesDoNotChange) {
    const std::string scene = write_animated_scene(folder.path);
    const Strings settings =
        words("--frame 3 --animation none --samples 11 --aov",
              "emission,direct_diffuse,indirect_diffuse,samples,albedo,normal,position,ids,cryptoobject");
    for (const char* more : {"", "--shadow-catcher floor --transparent", "--denoise --denoise-frames 0"}) {
        const ExrFile sharp = picture(scene, words(settings, more));
        const ExrFile blurred = picture(scene, words(settings, more, "--shutter 0.5"));
        ASSERT_EQ(sharp.channels.size(), blurred.channels.size());
        for (std::size_t c = 0; c < sharp.channels.size(); ++c) {
            const ExrChannel &a = sharp.channels[c], &b = blurred.channels[c];
            ASSERT_EQ(a.name, b.name);
            EXPECT_EQ(std::memcmp(a.values.data(), b.values.data(), a.values.size() * sizeof(float)), 0)
                << a.name << more;
        }
        expect_has(blurred.attributes.extra.at("shutter"), "0.5 of a frame, a time for each sample");
        EXPECT_FALSE(sharp.attributes.extra.contains("shutter"));
    }
}

TEST_F(Shutter, FramesDoNotDependOnTheRun) {
    const std::string scene = write_animated_scene(folder.path);
    const auto make = [&](const std::string& into, const std::string& frames,
                          const char* shutter = "--shutter 0.7 --shutter-times 2") {
        return run(scene, words(folder / into / "f.#.exr", "--frames", frames, "--samples 4 --camera moving", shutter,
                                "--aov variance,motion --reproducible"));
    };
    ASSERT_EQ(make("whole", "1-3").status, 0);
    for (const char* frame : {"3", "2", "1"}) ASSERT_EQ(make("alone", frame).status, 0);
    for (int frame = 1; frame <= 3; ++frame) {
        const std::string name = fmt::format("f.{}.exr", frame);
        EXPECT_EQ(read_text(folder / "whole" / name), read_text(folder / "alone" / name)) << frame;
    }
    for (const char* other : {"--shutter 0.6 --shutter-times 2", "--shutter 0.7 --shutter-times 1"})
        EXPECT_EQ(make("whole", "1", other).status, 1) << other;
    EXPECT_EQ(make("whole", "1").status, 0);
}

TEST_F(Shutter, BlurredFramesAreDenoised) {
    // The camera turns about the Cornell box by 1.8 degrees a frame. No light is lost.
    const char* const kTurn = "--frames 1-1 --turntable 200 --shutter 0.5";
    const auto pixels = [&](const Strings& more) {
        const Outcome outcome = run(kCornell, words(file("turned.#.exr"), kTurn, "--overwrite", more));
        EXPECT_EQ(outcome.status, 0) << outcome.err;
        const ExrFile made = read_exr(file("turned.1.exr"));
        std::vector<double> all;
        for (const char* channel : {"R", "G", "B"})
            for (const float value : made.find(channel)->values) all.push_back(std::min(double{value}, 4.0));
        return all;
    };
    const std::vector<double> exact = pixels(words("--samples 512"));
    const auto mean = [](const std::vector<double>& values) {
        return std::accumulate(values.begin(), values.end(), 0.0) / double(values.size());
    };
    const auto error = [&](const std::vector<double>& values) {
        double sum = 0;
        for (std::size_t i = 0; i < exact.size(); ++i) sum += std::pow((values[i] - exact[i]) / (exact[i] + 0.1), 2);
        return sum;
    };
    const double noise = error(pixels(words("--samples 16")));
    for (const char* more : {"--denoise-frames 0", "--denoise-frames 1", "--denoise-frames 0 --shutter-times 5"}) {
        const std::vector<double> denoised = pixels(words("--samples 16 --denoise", more));
        EXPECT_LT(error(denoised), 0.5 * noise) << more;
        EXPECT_NEAR(mean(denoised) / mean(exact), 1, 0.03) << more;
    }
    // A crop has the bits of the whole, and its pixels alone.
    const std::vector<double> whole = pixels(words("--samples 8 --denoise --denoise-frames 0"));
    const std::vector<double> part = pixels(words("--samples 8 --denoise --crop 5,9,21,17"));
    ASSERT_EQ(part.size(), 3u * 16 * 8);
    for (std::size_t c = 0; c < 3; ++c)
        for (std::size_t p = 0; p < 16 * 8; ++p)
            ASSERT_EQ(part[c * 128 + p], whole[c * kSide * kSide + (9 + p / 16) * kSide + 5 + p % 16])
                << c << ", " << p;
}

// The square is seen directly, so that its samples have no other noise than their times.
TEST_F(Shutter, CombinesWithAllPlansOfSamples) {
    const char* const kMove = "--frames 1-1 --animation slide --camera still --shutter 1 --overwrite";
    const auto profile = [&](const Strings& more) {
        const Outcome outcome = run(sliding, words(file("plan.#.exr"), kMove, more));
        EXPECT_EQ(outcome.status, 0) << outcome.err;
        return row(read_exr(file("plan.1.exr")), "R");
    };
    for (const char* plan :
         {"--samples 64 --shutter-times 8", "--samples 1024 --error 5e-4 --error-metric mse",
          "--samples 128 --adaptive", "--samples 128 --adaptive --shutter-times 16",
          "--samples 1024 --adaptive --error 5e-4 --error-metric mse",
          "--samples 1024 --error 5e-3 --error-metric mse --shutter-times 8", "--samples 64 --checkpoint 1",
          "--samples 64 --sample-parts 3", "--samples 64 --preview filter", "--samples 64 --denoise --denoise-error 16",
          "--samples 64 --denoise --checkpoint 1", "--samples 64 --estimator sampler=blue-noise"})
        EXPECT_LT(rms_error(profile(words(plan)), 2), 0.05) << plan;
    // Crops of the middle row alone. An error target of a crop measures the crop.
    for (const char* plan : {"--samples 128 --adaptive", "--samples 1024 --error 5e-4 --error-metric mse"}) {
        const Outcome outcome = run(sliding, words(file("plan.#.exr"), kMove, plan, "--crop 0,12,32,20"));
        EXPECT_EQ(outcome.status, 0) << outcome.err;
        const std::vector<float>& values = read_exr(file("plan.1.exr")).find("R")->values;
        ASSERT_EQ(values.size(), 32u * 8);
        EXPECT_LT(rms_error({values.begin() + 128, values.begin() + 160}, 2), 0.04) << plan;
    }
    for (const char* mode : {"cache", "temporal"})
        EXPECT_EQ(run(sliding, words(file("plan.#.exr"), kMove, "--preview", mode)).status, 2) << mode;
    EXPECT_EQ(run(sliding, words(file("plan.#.exr"), kMove, "--time 0.2")).status, 0);
}

TEST_F(Shutter, OpeningHasPositionAndRamp) {
    const auto profile = [&](const char* more) {
        return row(picture(sliding, words("--frame 1 --animation slide --camera still --samples 128", more)), "R");
    };
    const std::vector<double> centre = profile("--shutter 0.5");
    const auto middle = [](const std::vector<double>& values) {
        double light = 0, moment = 0;
        for (int x = 0; x < kSide; ++x) {
            light += values[static_cast<std::size_t>(x)];
            moment += (x + 0.5) * values[static_cast<std::size_t>(x)];
        }
        return moment / light;
    };
    // The square moves by 8 pixels.
    EXPECT_NEAR(middle(centre), 16, 0.1);
    EXPECT_NEAR(middle(profile("--shutter 0.5 --shutter-position start")), 20, 0.1);
    EXPECT_NEAR(middle(profile("--shutter 0.5 --shutter-position end")), 12, 0.1);
    // A ramp of 1 gives the times the density of a triangle.
    const std::vector<double> ramp = profile("--shutter 1 --shutter-ramp 1");
    constexpr int kSteps = 4096;
    std::vector<double> expected(kSide, 0.0);
    for (int i = 0; i < kSteps; ++i) {
        const double t = (i + 0.5) / kSteps, weight = (t < 0.5 ? 4 * t : 4 - 4 * t) / kSteps;
        for (int x = 0; x < kSide; ++x) {
            const double from = x * kPixel - 2, at = 2 * t - 1;
            expected[static_cast<std::size_t>(x)] +=
                weight * std::max(0.0, std::min(from + kPixel, at + 0.5) - std::max(from, at - 0.5)) / kPixel;
        }
    }
    for (std::size_t x = 0; x < kSide; ++x) EXPECT_NEAR(ramp[x], expected[x], 0.02) << x;
    EXPECT_LT(rms_error(profile("--shutter 2"), 4), 0.02);
    EXPECT_EQ(
        run(sliding, words(file("p.exr"), "--frame 1 --animation slide --shutter 1 --shutter-position first")).status,
        2);
}

// The camera jumps at frame 1.
TEST_F(Shutter, CutsEndShots) {
    const auto pixels = [&](const char* more) {
        return picture(sliding, words("--samples 8 --shutter 2.5", more)).find("R")->values;
    };
    for (const char* frame : {"--frame 0", "--frame 1"}) {
        const std::vector<float> cut = pixels(fmt::format("{} --animation cut --camera cutting", frame).c_str());
        const bool before = frame == std::string("--frame 0");
        EXPECT_EQ(std::ranges::count(cut, 0.0f) == std::ptrdiff_t(cut.size()), !before) << frame;
        if (before) {
            EXPECT_EQ(cut, pixels("--frame 0 --animation none --camera still"));
        }
    }
}

// The box has no surface for half of the opening. Pictures need fewer parts then, and no lamp is sampled at frame 0.
TEST_F(Shutter, PartsOfTheSceneMayComeAndGo) {
    const std::string scene = write_blinking_scene(folder.path);
    const ExrFile there = picture(scene, words("--frame 0 --animation blink --samples 64 --aov cryptoobject"));
    const ExrFile gone = picture(scene, words("--frame 1 --animation blink --samples 64"));
    for (const char* plan : {"", "--adaptive", "--shutter-times 4"}) {
        // The shutter is open from 0.5 s to 1.5 s.
        const ExrFile both = picture(
            scene, words("--frame 1 --animation blink --samples 64 --shutter 1 --aov cryptoobject --estimator camera=1",
                         plan));
        double sums[3] = {};
        for (const char* channel : {"R", "G", "B"})
            for (std::size_t i = 0; i < kSide * kSide; ++i) {
                const double expected =
                    (double{there.find(channel)->values[i]} + double{gone.find(channel)->values[i]}) / 2;
                const double value = both.find(channel)->values[i];
                sums[0] += value, sums[1] += expected, sums[2] += std::abs(value - expected);
            }
        EXPECT_NEAR(sums[0] / sums[1], 1, 0.02) << plan;
        EXPECT_LT(sums[2] / sums[1], 0.25) << plan;
        const auto share = [](const ExrFile& file) {
            double sum = 0;
            const auto &ids = file.find("CryptoObject00.R")->values, &parts = file.find("CryptoObject00.G")->values;
            const auto &ids2 = file.find("CryptoObject00.B")->values, &parts2 = file.find("CryptoObject00.A")->values;
            const float id = cryptomatte_id("blinking");
            for (std::size_t i = 0; i < ids.size(); ++i)
                sum += (ids[i] == id ? double{parts[i]} : 0) + (ids2[i] == id ? double{parts2[i]} : 0);
            return sum;
        };
        EXPECT_NEAR(share(both) / share(there), 0.5, 0.02) << plan;
    }
}

// The only lamp is off at the frame's own time, at 0 s, and goes on while the shutter is open.
TEST_F(Shutter, LightOfTheOpeningAloneMerges) {
    const std::string dawn = write_fading_scene(folder.path, 0, 30);
    const Strings settings = words("--width 32 --height 32 --fps 1 --animation all --samples 4 --shutter 1 --env none");
    const auto made = [&](const char* command, const char* name, const char* more) {
        done(words(command, dawn, file(name), settings, more));
    };
    made("render", "whole.exr", "--sample-parts 2");
    made("render", "parts.exr", "--part 1/2");
    made("render", "parts.exr", "--part 2/2");
    made("merge", "parts.exr", "--sample-parts 2");
    EXPECT_TRUE(same_pixels(file("whole.exr"), file("parts.exr")));
    const std::vector<float> light = read_exr(file("whole.exr")).find("R")->values;
    EXPECT_GT(*std::ranges::max_element(light), 0);
}

TEST_F(Shutter, MotionIsOfSquareAndCamera) {
    for (const auto& [animation, camera, pixels] : {std::tuple("slide", "still", 8.0),
                                                    {"pan", "panning", 8.0},
                                                    {"all", "panning", 16.0},
                                                    {"none", "still", 0.0}}) {
        // At two frames per second the square moves by one unit, or 8 pixels, per frame. At 1 s it is in the middle.
        done(words("render", sliding, file("motion.exr"), "--width 32 --frame 2 --fps 2 --samples 1 --aov motion",
                   "--animation", animation, "--camera", camera));
        const ExrFile picture = read_exr(file("motion.exr"));
        const auto x = row(picture, "motion.X"), y = row(picture, "motion.Y");
        for (std::size_t i = 0; i < kSide; ++i) {
            if (camera != std::string("panning")) {
                EXPECT_NEAR(x[i], i >= 12 && i < 20 ? pixels : 0, 1e-3) << animation << " " << i;
            } else if (i >= 12 && i < 20) {
                EXPECT_NEAR(x[i], pixels, 1e-3) << animation << " " << i;
            }
            EXPECT_NEAR(y[i], 0, 1e-3) << animation << " " << i;
        }
    }
}

}  // namespace
}  // namespace halflight::test
