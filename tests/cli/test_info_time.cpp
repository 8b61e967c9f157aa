// Tests `halflight info --needs --time`: it prints the cost of each left-out part.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <set>
#include <string>

#include "tests/support/process.h"

namespace halflight::test {
namespace {

TEST(InfoTime, IsMeasuredForEveryLeftOutPart) {
    const TemporaryFolder folder;
    const Outcome json = run_program({"info", "--needs", "--time", "--json", copy_room(folder.path)});
    ASSERT_EQ(json.status, 0) << json.err;
    int measured = 0;
    std::set<std::string> others;
    const auto facts = nlohmann::json::parse(json.out);
    for (const auto& part : facts.at("left_out")) {
        SCOPED_TRACE(part);
        const auto& time = part.at("time");
        if (time.is_null()) {
            others.insert(part.at("what"));
            continue;
        }
        ++measured;
        EXPECT_GT(time.at("time_ratio").at("lower"), 0);
        EXPECT_LE(time.at("time_ratio").at("lower"), time.at("time_ratio").at("upper"));
        EXPECT_EQ(time.at("same_bits"), true);
        if (part.at("what") == "sums of squares") {
            EXPECT_GT(time.at("bytes").at("kept"), time.at("bytes").at("lean"));
        }
    }
    EXPECT_GE(measured, 20);
    EXPECT_EQ(others, (std::set<std::string>{"environment map", "every light", "light tree", "sun apart",
                                             "double precision for slivers", "path reuse",
                                             "camera rays for light alone", "radiance cache", "temporal accumulation",
                                             "filter of noise", "adaptive sampling", "denoiser", "mip levels", "lens",
                                             "projections and eyes", "light groups", "shadow catchers"}));
}

}  // namespace
}  // namespace halflight::test
