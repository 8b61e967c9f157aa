// halflight-bench: figures for every kind of ray, and what it says when it cannot.
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "tests/cli/process.h"

namespace halflight::test {
namespace {

const std::string kCornell = HALFLIGHT_SOURCE_DIR "/scenes/cornell.glb";

TEST(Bench, WritesATableAndJson) {
    const TemporaryFolder folder;
    const std::string file = folder / "figures.json";
    const Outcome outcome = run_program({"--scene", kCornell, "--size", "64x48", "--repeats", "2", "--json", file});
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    const nlohmann::json report = nlohmann::json::parse(read_text(file));
    EXPECT_EQ(report["schema"], 1);
    ASSERT_EQ(report["scenes"].size(), 1u);
    const nlohmann::json& kinds = report["scenes"][0]["kinds"];
    ASSERT_EQ(kinds.size(), 6u);
    for (const nlohmann::json& kind : kinds) {
        EXPECT_NE(outcome.out.find(kind["kind"].get<std::string>()), std::string::npos);
        EXPECT_GT(kind["live_rays"], 1000);
        EXPECT_LE(kind["rays_that_differ"], 5);
        EXPECT_EQ(kind["plain"]["seconds"].size(), 2u);
        EXPECT_GT(kind["plain"]["mrays_per_second"], 0);
        EXPECT_GT(kind["embree"]["mrays_per_second"], 0);
    }
}

TEST(Bench, TakesOnlyTheKindsAskedFor) {
    const Outcome outcome = run_program({"--scene", kCornell, "--size", "32x32", "--repeats", "1", "--kinds", "ao,hard",
                                         "--nodes", "float", "--robust"});
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_NE(outcome.out.find("(float)"), std::string::npos);
    EXPECT_EQ(outcome.out.find("glossy"), std::string::npos);
}

TEST(Bench, FailsWithOneLine) {
    for (const std::vector<std::string>& arguments : {std::vector<std::string>{"--scene", "missing.glb"},
                                                      {"--scene", kCornell, "--size", "wide"},
                                                      {"--scene", kCornell, "--camera", "nobody"}}) {
        const Outcome outcome = run_program(arguments);
        EXPECT_EQ(outcome.status, 1);
        EXPECT_EQ(outcome.err.find("halflight-bench: "), 0u) << outcome.err;
        EXPECT_EQ(outcome.err.find('\n'), outcome.err.size() - 1) << outcome.err;
    }
}

}  // namespace
}  // namespace halflight::test
