// Lists of techniques as they are asked for and told.
#include "passes/estimator.h"

#include <gtest/gtest.h>

#include "tests/support/error_message.h"

namespace halflight {
namespace {

TEST(Estimator, IsWhatItsTextSays) {
    EXPECT_EQ(text({}), "lights=auto,reuse=off");
    for (const LightChoice choice : kLightChoices) {
        const Estimator estimator{.lights = choice};
        EXPECT_EQ(estimator_named(text(estimator)), estimator);
    }
    for (const Reuse choice : kReuses) {
        const Estimator estimator{.lights = LightChoice::tree, .reuse = choice};
        EXPECT_EQ(estimator_named(text(estimator)), estimator);
    }
    EXPECT_EQ(estimator_named("reuse=on").lights, LightChoice::automatic);
    EXPECT_EQ(known_estimators(), "lights=auto|power|tree|uniform,reuse=off|on");
}

TEST(Estimator, UnknownTechniquesAreRefusedByName) {
    const auto message = [](const char* list) { return error_message([&] { estimator_named(list); }); };
    EXPECT_EQ(message("light=tree"),
              "light=tree: 'light=tree' is no technique; there are: lights=auto|power|tree|uniform,reuse=off|on");
    EXPECT_EQ(message("lights=bush"), "lights=bush: there is no lights=bush; there are: auto, power, tree, uniform");
    EXPECT_EQ(message("lights=tree,lights=power"), "lights=tree,lights=power: 'lights' is given twice");
    for (const char* list : {"", "lights", "lights=tree,", ",lights=tree", "tree", "=", "lights=tree ", "Lights=tree"})
        EXPECT_NE(message(list), "") << list;
}

}  // namespace
}  // namespace halflight
