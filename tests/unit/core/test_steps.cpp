// Tests the watches that a thread sets on its work, and stopwatches.
#include <gtest/gtest.h>

#include <chrono>
#include <string>
#include <thread>
#include <vector>

#include "engine/core/interruption.h"
#include "engine/core/steps.h"
#include "engine/core/stopwatch.h"

namespace halflight {
namespace {

struct Ended {};

TEST(Interruption, InnermostCheckOfTheThreadIsAsked) {
    interruption_point();  // does nothing, because no Interruptible exists
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

TEST(Steps, TheInnermostWatchHearsOfEndsAndMayEndTheWork) {
    int ends = 0;
    const StepWatch a([](const char*, int) {}, [&] { ++ends; });
    begin_step("a");
    end_step();
    EXPECT_EQ(ends, 1);
    const StepWatch b([](const char*, int) { throw Ended(); });
    end_step();
    EXPECT_EQ(ends, 1);
    EXPECT_THROW(begin_step("a"), Ended);
}

TEST(Stopwatch, LapsAddUpToTheWhole) {
    Stopwatch watch;
    double sum = 0;
    for (int i = 0; i < 2; ++i) {
        std::this_thread::sleep_for(std::chrono::milliseconds(20));
        const double lap = watch.lap();
        EXPECT_GE(lap, 0.02);
        sum += lap;
    }
    EXPECT_GE(watch.seconds(), sum);
}

TEST(CpuStopwatch, CountsAllThreadsAndNoSleep) {
    const CpuStopwatch asleep;
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    const Seconds slept = asleep.seconds();
    EXPECT_GE(slept.wall, 0.05);
    EXPECT_LT(slept.cpu, 0.025);

    const CpuStopwatch busy;
    std::thread([] {
        const double start = cpu_seconds();
        while (cpu_seconds() - start < 0.05) continue;
    }).join();
    EXPECT_GE(busy.seconds().cpu, 0.05);
}

}  // namespace
}  // namespace halflight
