#include <gtest/gtest.h>

#include <string>
#include <thread>
#include <vector>

#include "engine/core/steps.h"

namespace halflight {
namespace {

struct Ended {};

TEST(Steps, InnermostWatchOfTheThreadCountsThem) {
    begin_step("nobody watches");
    std::vector<std::string> outer, inner;
    const auto into = [](std::vector<std::string>& list) {
        return [&list](const char* what, int number) { list.push_back(what + std::to_string(number)); };
    };
    const StepWatch a(into(outer));
    begin_step("a");
    {
        const StepWatch b(into(inner));
        begin_step("b");
        begin_step("c");
    }
    std::thread([] { begin_step("another thread"); }).join();
    begin_step("a");
    EXPECT_EQ(outer, (std::vector<std::string>{"a1", "a2"}));
    EXPECT_EQ(inner, (std::vector<std::string>{"b1", "c2"}));
}

TEST(Steps, TheInnermostWatchHearsOfEnds) {
    int ends = 0;
    const StepWatch a([](const char*, int) {}, [&] { ++ends; });
    begin_step("a");
    end_step();
    EXPECT_EQ(ends, 1);
    const StepWatch b([](const char*, int) {});
    end_step();
    EXPECT_EQ(ends, 1);
}

TEST(Steps, AWatchMayEndTheWork) {
    const StepWatch watch([](const char*, int) { throw Ended(); });
    EXPECT_THROW(begin_step("a"), Ended);
}

}  // namespace
}  // namespace halflight
