#include <gtest/gtest.h>

#include <thread>

#include "engine/core/interruption.h"

namespace halflight {
namespace {

struct Ended {};

TEST(Interruption, InnermostCheckOfTheThreadIsAsked) {
    interruption_point();  // nobody asks for an end
    int outer = 0, inner = 0;
    const Interruptible a([&] { ++outer; });
    {
        const Interruptible b([&] {
            ++inner;
            throw Ended();
        });
        EXPECT_THROW(interruption_point(), Ended);
        std::thread(interruption_point).join();  // an exception there would end the program
    }
    interruption_point();
    EXPECT_EQ(outer, 1);
    EXPECT_EQ(inner, 1);
}

}  // namespace
}  // namespace halflight
