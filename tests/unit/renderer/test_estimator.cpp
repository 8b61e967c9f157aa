// Tests the text form of estimator techniques: parsing, printing, differences.
#include "engine/settings/estimator.h"

#include <gtest/gtest.h>

#include <span>
#include <string>
#include <vector>

#include "tests/support/error_message.h"

namespace halflight {
namespace {

constexpr const char* kKnown =
    "auto,lights=auto|power|tree|uniform|all,sun=apart|among,reuse=auto|off|4|8|16,camera=auto|1|2|4|8|16,"
    "shadow=auto|1|2|4|8,sampler=sobol|blue-noise|independent";

TEST(Estimator, TextRoundTrips) {
    EXPECT_EQ(text(Estimator()), "lights=auto,sun=apart,reuse=off,camera=1,shadow=1,sampler=sobol");
    EXPECT_EQ(known_estimators(), kKnown);
    for (const LightChoice lights : kLightChoices) {
        for (const SunChoice sun : kSunChoices) {
            for (const CameraRays camera : kCameraRays) {
                for (const ShadowRays shadow : kShadowRays) {
                    for (const SamplePoints sampler : kSamplePoints) {
                        const Estimator estimator{lights, sun, Reuse::sixteen, camera, shadow, sampler};
                        EXPECT_EQ(estimator_named(text(estimator)), estimator);
                    }
                }
            }
        }
    }
    EXPECT_EQ(estimator_named("reuse=16"), Estimator{.reuse = Reuse::sixteen});
    constexpr Estimator kOpen{
        .reuse = Reuse::automatic, .camera = CameraRays::automatic, .shadow = ShadowRays::automatic};
    EXPECT_EQ(estimator_named("auto"), kOpen);
    EXPECT_EQ(estimator_named(text(kOpen)), kOpen);
    Estimator partly = kOpen;
    partly.camera = CameraRays::four, partly.lights = LightChoice::tree;
    EXPECT_EQ(estimator_named("auto,lights=tree,camera=4"), partly);
    EXPECT_TRUE(leaves_open(partly));
    EXPECT_FALSE(leaves_open({}));
}

TEST(Estimator, DifferencesFromTheDefaultAndFromOthersAreListed) {
    const std::vector<Estimator> all{{}, {.lights = LightChoice::tree}, {.reuse = Reuse::sixteen}};
    EXPECT_EQ(difference(all[0], all), "lights=auto,reuse=off");
    EXPECT_EQ(difference(all[1], all), "lights=tree,reuse=off");
    EXPECT_EQ(difference(all[2], std::span(all).subspan(2)), "reuse=16");
    EXPECT_EQ(difference({}, {}), "");
}

TEST(Estimator, UnknownTechniquesAreNamed) {
    const auto message = [](const char* list) { return error_message([&] { estimator_named(list); }); };
    EXPECT_EQ(message("light=tree"), std::string("light=tree: 'light=tree' is no technique; there are: ") + kKnown);
    EXPECT_EQ(message("lights=bush"),
              "lights=bush: there is no lights=bush; there are: auto, power, tree, uniform, all");
    EXPECT_EQ(message("reuse=16,sun"), "reuse=16,sun: 'sun' has no value; there are: apart, among");
    EXPECT_EQ(message("sun=among,auto"), "sun=among,auto: 'auto' stands first or not at all");
    EXPECT_EQ(message("sun="), "sun=: there is no sun=; there are: apart, among");
    EXPECT_EQ(message("lights=tree,lights=power"), "lights=tree,lights=power: 'lights' is given twice");
    for (const char* list : {"", "lights", "lights=tree,", ",lights=tree", "tree", "=", "lights=tree ", "Lights=tree"})
        EXPECT_NE(message(list), "") << list;
}

}  // namespace
}  // namespace halflight
