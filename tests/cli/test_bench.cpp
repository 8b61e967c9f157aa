// Tests halflight-bench and `halflight bench`: figures for every kind of ray and every method, and errors.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "tests/support/process.h"

namespace halflight::test {
namespace {

using Json = nlohmann::json;

const std::string kCornell = HALFLIGHT_SOURCE_DIR "/scenes/cornell.glb";
const std::vector<std::string> kKinds{"primary", "hard",       "soft",    "glossy", "diffuse",
                                      "ao",      "connection", "bounce2", "mixed"};
const std::vector<std::string> kMethods{"naive",  "plain",  "compute", "kept",   "auto",
                                        "raster", "embree", "packets", "ceiling"};

Outcome run_bench(std::vector<std::string> arguments) {
    if (HALFLIGHT_IS_COMMAND) arguments.insert(arguments.begin(), "bench");
    return run_program(arguments);
}

void expect_quartiles(const Json& q) {
    EXPECT_GT(q["lower"], 0);
    EXPECT_LE(q["lower"], q["median"]);
    EXPECT_LE(q["median"], q["upper"]);
}

TEST(Bench, WritesTablesAndJson) {
    const TemporaryFolder folder;
    const std::string file = folder / "figures.json";
    const Outcome outcome = run_bench({"--scene", kCornell, "--size", "64x48", "--turns", "2", "--json", file});
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    const Json report = Json::parse(read_text(file));
    EXPECT_EQ(report["schema"], 3);
    EXPECT_EQ(report["turns"], 2);
    ASSERT_EQ(report["scenes"].size(), 1u);
    EXPECT_EQ(report["scenes"][0]["rays_that_disagree"], 0);
    EXPECT_TRUE(report["scenes"][0]["left_out"].empty());
    const Json& kinds = report["scenes"][0]["kinds"];
    ASSERT_EQ(kinds.size(), kKinds.size());
    for (std::size_t k = 0; k < kKinds.size(); ++k) {
        SCOPED_TRACE(kKinds[k]);
        EXPECT_EQ(kinds[k]["kind"], kKinds[k]);
        EXPECT_NE(outcome.out.find("\n  " + kKinds[k]), std::string::npos);
        EXPECT_GT(kinds[k]["live_rays"], 1000);
        EXPECT_LE(kinds[k]["live_rays"], kinds[k]["rays"]);
        EXPECT_LE(kinds[k]["hits"], kinds[k]["live_rays"]);
        for (const std::string& name : kMethods) {
            SCOPED_TRACE(name);
            const Json& method = kinds[k]["methods"][name];
            EXPECT_EQ(method["seconds"].size(), 2u);
            EXPECT_EQ(method["cpu_seconds"].size(), 2u);
            expect_quartiles(method["mrays_per_second"]);
            for (const char* other : {"plain", "naive", "embree"}) expect_quartiles(method["times_as_fast_as"][other]);
            if (method["times_as_fast_as"].contains(name)) {
                EXPECT_EQ(method["times_as_fast_as"][name]["median"], 1.0);
            }
            EXPECT_LE(method["rays_that_differ"], method["exact"] == true ? 0 : 5);
        }
    }
    const Json& methods = kinds[0]["methods"];
    for (const char* exact : {"plain", "compute", "kept", "auto", "raster"}) EXPECT_EQ(methods[exact]["exact"], true);
    // The picture of 64 x 48 pixels has 8 x 6 tiles.
    EXPECT_EQ(methods["compute"]["figures"]["tiles"], 48);
    EXPECT_EQ(methods["compute"]["figures"]["made"], 48);
    EXPECT_EQ(methods["kept"]["figures"]["made"], 0);
    EXPECT_GT(methods["kept"]["figures"]["entries"], 0);
    EXPECT_TRUE(methods["raster"]["figures"].contains("queries"));
    EXPECT_NE(kinds[0]["methods"]["packets"]["note"].get<std::string>().find("rtcIntersect"), std::string::npos);
}

TEST(Bench, MeasuresOnlyRequestedCases) {
    const Outcome outcome = run_bench({"--scene", kCornell, "--size", "32x32", "--turns", "1", "--kinds", "ao,hard",
                                       "--methods", "plain", "--nodes", "float", "--robust", "--clock", "cpu"});
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_NE(outcome.out.find("(float)"), std::string::npos);
    EXPECT_NE(outcome.out.find("Mrays/s, CPU time"), std::string::npos);
    for (const char* other : {"glossy", "diffuse", "naive", "packets"})
        EXPECT_EQ(outcome.out.find(other), std::string::npos) << other;
}

TEST(Bench, WholeFrames) {
    const TemporaryFolder folder;
    const std::string file = folder / "frames.json";
    const Outcome outcome =
        run_bench({"--frames", "--scene", kCornell, "--size", "48x32", "--samples", "10", "--views", "3", "--reference",
                   "64", "--variants", "off,compute,fresh,auto,raster,naive", "--json", file});
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    const Json report = Json::parse(read_text(file));
    ASSERT_EQ(report["frames"].size(), 1u);
    const Json& frames = report["frames"][0];
    EXPECT_EQ(frames["pixels_that_differ"], 0);
    for (const auto& [part, count] : {std::pair{"still", 10u}, {"moving", 3u}}) {
        ASSERT_EQ(frames[part].size(), 6u);
        EXPECT_EQ(frames[part][0]["variant"], "naive");
        for (const Json& series : frames[part]) {
            SCOPED_TRACE(series["variant"]);
            EXPECT_EQ(series["seconds"].size(), count);
            for (const char* batch : {"shadow", "diffuse", "continuation", "later shadow"}) {
                ASSERT_EQ(series["ray_batches"][batch]["seconds"].size(), count) << batch;
                EXPECT_GT(series["ray_batches"][batch]["seconds"].back(), 0) << batch;
                EXPECT_LT(series["ray_batches"][batch]["seconds"].back(), series["seconds"].back()) << batch;
            }
        }
    }
    // One variant keeps its tile lists, the other one does not.
    const auto lists_made = [&](std::size_t variant) -> int {
        const Json& chosen = frames["still"][variant]["chosen"];
        return std::ranges::find_if(chosen, [](const Json& b) { return b["batch"] == "shadow"; })->at("tiles_culled");
    };
    EXPECT_LT(lists_made(2), lists_made(3));

    const Json& errors = frames["errors"];
    ASSERT_EQ(errors.size(), 5u);  // 1, 2, 4, 8, 10 samples
    EXPECT_EQ(errors[4]["samples"], 10);
    EXPECT_LT(errors[4]["relative_mse"], 0.5 * errors[0]["relative_mse"].get<double>());
    EXPECT_LT(errors[4]["trimmed_mse"], errors[4]["relative_mse"]);
    EXPECT_LT(errors[0]["seconds"]["off"], errors[4]["seconds"]["off"]);
}

TEST(Bench, ChecksFilesBeforeMeasuring) {
    for (const std::vector<std::string>& wrong :
         {std::vector<std::string>{"--scene", kCornell, "missing.glb"},
          std::vector<std::string>{"--scene", kCornell, "--json", "/nowhere/figures.json"}}) {
        const Outcome outcome = run_bench(wrong);
        EXPECT_EQ(outcome.status, 1);
        EXPECT_EQ(outcome.out, "");
        EXPECT_NE(outcome.err.find(wrong.back()), std::string::npos) << outcome.err;
    }
}

TEST(Bench, ExplainsInvalidOptions) {
    const std::pair<std::vector<std::string>, std::string> cases[] = {
        {{"--clock", "sun"}, "--clock: expects one of wall, cpu, not 'sun'"},
        {{"--nodes", "x"}, "--nodes: expects one of auto, grid, float, not 'x'"},
        {{"--frames", "--variants", "off,none"},
         "--variants: expects one of naive, off, compute, fresh, auto, raster, not 'none'"},
        {{"--turns", "many"}, "--turns: expects a whole number from 1 to 10000, not 'many'"}};
    for (auto [arguments, message] : cases) {
        arguments.insert(arguments.begin(), {"--scene", kCornell});
        const Outcome outcome = run_bench(arguments);
        EXPECT_EQ(outcome.status, 2);
        EXPECT_NE(outcome.err.find(": " + message + "\n"), std::string::npos) << outcome.err;
    }
}

TEST(Bench, FailsWithOneLine) {
    struct Case {
        int status;  // 2: an invalid command line
        std::vector<std::string> arguments;
    };
    for (const Case& wrong :
         {Case{1, {"--scene", "missing.glb"}}, Case{2, {"--scene", kCornell, "--size", "wide"}},
          Case{2, {"--scene", kCornell, "--size", "4294967297x9"}}, Case{2, {"--scene", kCornell, "--turns", "0"}},
          Case{1, {"--frames", "--scene", kCornell, "--size", "9000x9000"}},
          Case{1, {"--scene", kCornell, "--camera", "nobody"}}}) {
        const Outcome outcome = run_bench(wrong.arguments);
        EXPECT_EQ(outcome.status, wrong.status) << outcome.err;
        EXPECT_EQ(outcome.err.find("halflight"), 0u) << outcome.err;
        EXPECT_EQ(outcome.err.find('\n'), outcome.err.size() - 1) << outcome.err;
    }
}

}  // namespace
}  // namespace halflight::test
