#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "engine/core/stopwatch.h"

namespace halflight {
namespace {

TEST(Stopwatch, LapsAddUpToTheWhole) {
    Stopwatch watch;
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    const double first = watch.lap();
    EXPECT_GE(first, 0.02);
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    const double second = watch.lap();
    EXPECT_GE(second, 0.02);
    EXPECT_GE(watch.seconds(), first + second);
}

TEST(CpuStopwatch, CountsAllThreadsAndNoSleep) {
    const CpuStopwatch asleep;
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    const Seconds slept = asleep.seconds();
    EXPECT_GE(slept.wall, 0.1);
    EXPECT_LT(slept.cpu, 0.05);

    const CpuStopwatch busy;
    std::thread([] {
        const double start = cpu_seconds();
        while (cpu_seconds() - start < 0.05) continue;
    }).join();
    EXPECT_GE(busy.seconds().cpu, 0.05);
}

}  // namespace
}  // namespace halflight
