// Tests programs that measure: halflight-bench and `halflight bench` rays of every kind and method, halflight-leftout
// and `halflight info --needs --time` left-out parts, with and without each.
#include <csignal>
#include <regex>
#include <set>

#include "tests/cli/command_test.h"

namespace halflight::test {
namespace {

using Json = nlohmann::json;

const std::string kCornell = HALFLIGHT_SOURCE_DIR "/scenes/cornell.glb";

using Bench = CommandTest;

void expect_quartiles(const Json& q) {
    EXPECT_GT(q["lower"], 0);
    EXPECT_LE(q["lower"], q["median"]);
    EXPECT_LE(q["median"], q["upper"]);
}

TEST_F(Bench, WritesTablesAndJson) {
    const Strings all_kinds = words("primary hard soft glossy diffuse ao connection bounce2 mixed");
    const Strings all_methods = words("naive plain compute kept auto raster embree packets ceiling");
    const Outcome outcome =
        done(words("bench --size 64x48 --turns 2 --scene", kCornell, "--json", file("figures.json")));
    const Json report = json_file(file("figures.json"));
    EXPECT_EQ(report["schema"], 3);
    EXPECT_EQ(report["turns"], 2);
    ASSERT_EQ(report["scenes"].size(), 1u);
    EXPECT_EQ(report["scenes"][0]["rays_that_disagree"], 0);
    EXPECT_TRUE(report["scenes"][0]["left_out"].empty());
    const Json& kinds = report["scenes"][0]["kinds"];
    ASSERT_EQ(kinds.size(), all_kinds.size());
    for (std::size_t k = 0; k < all_kinds.size(); ++k) {
        SCOPED_TRACE(all_kinds[k]);
        EXPECT_EQ(kinds[k]["kind"], all_kinds[k]);
        expect_has(outcome.out, "\n  " + all_kinds[k]);
        EXPECT_GT(kinds[k]["live_rays"], 1000);
        EXPECT_LE(kinds[k]["live_rays"], kinds[k]["rays"]);
        EXPECT_LE(kinds[k]["hits"], kinds[k]["live_rays"]);
        for (const std::string& name : all_methods) {
            SCOPED_TRACE(name);
            const Json& method = kinds[k]["methods"][name];
            for (const char* clock : {"seconds", "cpu_seconds"}) EXPECT_EQ(method[clock].size(), 2u);
            expect_quartiles(method["mrays_per_second"]);
            const Json& ratios = method["times_as_fast_as"];
            for (const char* other : {"plain", "naive", "embree"}) expect_quartiles(ratios[other]);
            EXPECT_TRUE(!ratios.contains(name) || ratios[name]["median"] == 1.0);
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
}

/// The benchmark is a program of its own, too.
TEST_F(Bench, MeasuresOnlyRequestedCases) {
    const Outcome outcome =
        run(words(std::string(HALFLIGHT_BENCH), "--scene", kCornell, "--size 32x32 --turns 1 --kinds ao,hard",
                  "--methods plain --nodes float --robust --clock cpu"));
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    expect_has(outcome.out, "(float)");
    expect_has(outcome.out, "CPU time");
    for (const char* other : {"glossy", "diffuse", "naive", "packets"}) EXPECT_FALSE(has(outcome.out, other)) << other;
    const Outcome wrong = run(words(std::string(HALFLIGHT_BENCH), "--scene", kCornell, "--turns 0"));
    EXPECT_EQ(wrong.status, 2);
    EXPECT_EQ(std::ranges::count(wrong.err, '\n'), 1) << wrong.err;
}

TEST_F(Bench, WholeFrames) {
    done(words("bench --frames --scene", kCornell, "--size 48x32 --samples 10 --views 3 --reference 64",
               "--variants off,compute,fresh,auto,raster,naive --json", file("frames.json")));
    const Json report = json_file(file("frames.json"));
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

TEST_F(Bench, RefusesBeforeMeasuring) {
    const Strings scene = words("bench --scene", kCornell);
    refused(1, words("bench --scene missing.glb"), "missing.glb: ");
    refused(1, words(scene, "missing.glb"), "missing.glb: ");
    refused(1, words(scene, "--json /nowhere/figures.json"), "/nowhere/figures.json: ");
    for (const char* options : {"--camera nobody", "--frames --size 9000x9000"}) {
        const Outcome outcome = run_program(words(scene, options));
        EXPECT_EQ(outcome.status, 1) << options;
        EXPECT_EQ(std::ranges::count(outcome.err, '\n'), 1) << outcome.err;
    }
}

class LeftOutTool : public CommandTest {
  protected:
    const std::string scene = copy_room(folder.path);
};

TEST_F(LeftOutTool, ComparesAllAndItems) {
    const Outcome outcome =
        run(words(std::string(HALFLIGHT_LEFTOUT), scene, "--width 32 --height 32 --samples 2 --turns 3",
                  "--starts 2 --items --json", file("figures.json"), "--item", std::string("coat textures"), "--item",
                  std::string("tile lists")));
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    const Json row = json_file(file("figures.json")).at(0);
    Json alone;
    for (const Json& part : row.at("left_out"))
        if (part.contains("kept_alone")) {
            EXPECT_EQ(part.at("what"), "coat textures") << "tile lists cannot be kept";
            alone = part.at("kept_alone");
        }
    EXPECT_EQ(alone.at("added").get<std::set<std::string>>().count("clearcoat"), 1u);
    for (const Json& figures : {row, alone}) {
        EXPECT_GT(figures.at("bytes").at("kept"), figures.at("bytes").at("lean"));
        EXPECT_EQ(figures.at("seconds_per_sample").at("kept").size(), 3u);
        EXPECT_EQ(figures.at("compile_seconds").at("lean").size(), 2u);
        EXPECT_LE(figures.at("time_ratio").at("lower"), figures.at("time_ratio").at("upper"));
        EXPECT_EQ(figures.at("same_bits"), true);
    }
    expect_has(outcome.out, "\ncoat textures ");
}

TEST_F(LeftOutTool, RefusesUnknownNames) {
    for (const char* options : {"--items --item smell", "--item clearcoat"}) {  // items need --items
        const Outcome outcome = run(words(std::string(HALFLIGHT_LEFTOUT), scene, options));
        EXPECT_EQ(outcome.status, 2);
        EXPECT_EQ(std::ranges::count(outcome.err, '\n'), 1) << outcome.err;
    }
}

/// `halflight info` measures row by row. The run ends after the first one that has figures.
TEST_F(LeftOutTool, InfoMeasuresUntilItIsInterrupted) {
    const std::string rows = file("rows");
    const std::string interrupt = "\"$@\" >'" + rows + "' & p=$!; until grep -q ' \\[[0-9.]*, [0-9.]*\\]' '" + rows +
                                  "' || ! kill -0 $p; do sleep 0.1; done; kill -TERM $p; wait $p";
    const Outcome outcome = run_program({"info", "--needs", "--time", scene},
                                        {.wrapper = {"bash", "-c", interrupt, "bash"}, .most_seconds = 120});
    EXPECT_EQ(outcome.status, 128 + SIGTERM) << outcome.err;
    expect_has(outcome.err, "room.gltf: interrupted");
    const std::string text = read_text(rows);
    const std::regex row(R"(\n  [a-z ]+ +\d+  (\d+\.\d+) \[(\d+\.\d+), (\d+\.\d+)\]  )");
    std::smatch found;
    ASSERT_TRUE(std::regex_search(text, found, row)) << text;
    EXPECT_GT(std::stod(found[2]), 0);
    EXPECT_LE(std::stod(found[2]), std::stod(found[3]));
}

}  // namespace
}  // namespace halflight::test
