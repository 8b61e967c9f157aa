// Lists of techniques as they are asked for and told.
#include "passes/estimator.h"

#include <gtest/gtest.h>

#include "tests/support/error_message.h"
#include "tests/support/scenes.h"

namespace halflight {
namespace {

TEST(Estimator, IsWhatItsTextSays) {
    EXPECT_EQ(text({}), "lights=auto,reuse=auto");
    for (const LightChoice choice : kLightChoices) {
        const Estimator estimator{.lights = choice};
        EXPECT_EQ(estimator_named(text(estimator)), estimator);
    }
    for (const Reuse choice : kReuses) {
        const Estimator estimator{.lights = LightChoice::tree, .reuse = choice};
        EXPECT_EQ(estimator_named(text(estimator)), estimator);
    }
    EXPECT_EQ(estimator_named("reuse=off").lights, LightChoice::automatic);
    EXPECT_EQ(known_estimators(), "lights=auto|power|tree|uniform,reuse=auto|on|off");
}

TEST(Estimator, PathsAreReusedUnlessMuchIsGlossy) {
    const auto room = [](float metal) {
        Scene scene;
        test::add_quad(scene, test::add_material(scene, test::diffuse_material(vec3(0.5f))), {0, 0, 0}, {1, 0, 0},
                       {0, 1 - metal, 0});
        test::add_quad(scene, test::add_material(scene, test::metal_material(vec3(0.5f), 0.2f)), {0, 0, 0}, {1, 0, 0},
                       {0, metal, 0});
        return scene;
    };
    EXPECT_EQ(choose_reuse(Reuse::automatic, room(0.005f)), Reuse::on);
    EXPECT_EQ(choose_reuse(Reuse::automatic, room(0.02f)), Reuse::off);
    EXPECT_EQ(choose_reuse(Reuse::on, room(0.02f)), Reuse::on);
    EXPECT_EQ(choose_reuse(Reuse::off, room(0.005f)), Reuse::off);
}

TEST(Estimator, UnknownTechniquesAreRefusedByName) {
    const auto message = [](const char* list) { return error_message([&] { estimator_named(list); }); };
    EXPECT_EQ(message("light=tree"),
              "light=tree: 'light=tree' is no technique; there are: lights=auto|power|tree|uniform,reuse=auto|on|off");
    EXPECT_EQ(message("lights=bush"), "lights=bush: there is no lights=bush; there are: auto, power, tree, uniform");
    EXPECT_EQ(message("lights=tree,lights=power"), "lights=tree,lights=power: 'lights' is given twice");
    for (const char* list : {"", "lights", "lights=tree,", ",lights=tree", "tree", "=", "lights=tree ", "Lights=tree"})
        EXPECT_NE(message(list), "") << list;
}

}  // namespace
}  // namespace halflight
