// Tests the contents of `--stats`.
#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "tests/cli/output_test.h"

namespace halflight::test {
namespace {

using Statistics = Output;

TEST_F(Statistics, DescribeTheRun) {
    render({file("a.exr"), "--samples", "2", "--stats", file("stats.json"), "--dump-graph", file("graph.dot")});
    const auto stats = nlohmann::json::parse(read_text(file("stats.json")));
    EXPECT_EQ(stats.at("samples"), 2);
    EXPECT_EQ(stats.at("paths"), 32 * 32 * 2);
    EXPECT_EQ(stats.at("counts").at("triangles_with_instances"), 4);
    EXPECT_EQ(stats.at("settings").at("width"), 32);
    EXPECT_EQ(stats.at("outputs"), Strings{file("a.exr")});
    EXPECT_GT(stats.at("gpu_bytes"), 0);
    EXPECT_GT(stats.at("peak_memory_bytes"), 0);
    EXPECT_FALSE(stats.at("device").at("renderer").get<std::string>().empty());
    EXPECT_EQ(stats.at("device").at("errors"), 0);
    EXPECT_EQ(stats.at("bad_values").size(), 5u);
    for (const auto& [component, bad] : stats.at("bad_values").items())
        for (const char* kind : {"nan", "infinite", "negative"}) EXPECT_EQ(bad.at(kind), 0) << component << " " << kind;
    const auto& seconds = stats.at("seconds");
    double sum = 0;
    for (const char* step : {"load", "context", "prepare", "compile", "render", "finish", "write"})
        sum += seconds.at(step).get<double>();
    EXPECT_NEAR(sum, seconds.at("total").get<double>(), 0.05 * sum + 0.01) << seconds;
    std::set<std::string> passes;
    double in_passes = 0;
    for (const auto& pass : stats.at("passes")) {
        in_passes += pass.at("seconds").get<double>();
        EXPECT_GE(pass.at("runs"), 2) << pass;
        passes.insert(pass.at("name"));
    }
    EXPECT_FALSE(passes.empty());
    EXPECT_GT(in_passes, 0);
    EXPECT_LE(in_passes, seconds.at("total").get<double>());
    const std::string dot = read_text(file("graph.dot"));
    EXPECT_TRUE(dot.starts_with("digraph")) << dot.substr(0, 80);
    EXPECT_NE(dot.find("gbuffer"), std::string::npos);
    // The short form has a row for each group of passes, and the shares of the groups make up the whole.
    render({file("a.exr"), "--samples", "2", "--dump-graph", file("graph.txt")});
    const std::string table = read_text(file("graph.txt"));
    EXPECT_TRUE(table.starts_with("group")) << table;
    EXPECT_NE(table.find("\ngbuffer "), std::string::npos) << table;
    EXPECT_LE(std::ranges::count(table, '\n'), 16) << table;
    EXPECT_EQ(table.find(':'), std::string::npos) << "it has groups, no single passes: " << table;
    EXPECT_TRUE(table.ends_with("  100 %\n")) << table;
}

TEST_F(Statistics, DescribeTheTracing) {
    const auto run = [&](const std::string& culling) {
        render({file("a.exr"), "--samples", "8", "--culling", culling, "--stats", file("stats.json")});
        return nlohmann::json::parse(read_text(file("stats.json")));
    };
    const std::map<std::string, Strings> methods = {
        {"off", {"plain"}}, {"compute", {"tiles"}}, {"raster", {"raster"}}, {"auto", {"plain", "native", "tiles"}}};
    std::map<std::string, std::uint64_t> rays;
    for (const auto& [culling, names] : methods) {
        SCOPED_TRACE(culling);
        const auto stats = run(culling);
        std::set<std::string> batches;
        for (const auto& batch : stats.at("ray_batches")) {
            batches.insert(batch.at("batch"));
            EXPECT_FALSE(batch.at("reason").get<std::string>().empty());
            std::uint64_t runs = 0, alive = 0;
            for (const auto& [method, measured] : batch.at("methods").items()) {
                EXPECT_EQ(std::ranges::count(names, method), 1) << method;
                EXPECT_GT(measured.at("seconds"), 0);
                EXPECT_LE(measured.at("fastest_run_seconds"), measured.at("seconds"));
                runs += measured.at("runs").get<std::uint64_t>();
                alive += measured.at("rays").get<std::uint64_t>();
            }
            EXPECT_EQ(runs, 8u) << batch;
            EXPECT_LE(alive, 8u * 32 * 32);
            // The picture is the same, and so are the rays.
            EXPECT_EQ(rays.emplace(batch.at("batch"), alive).first->second, alive) << batch;
            ASSERT_EQ(batch.contains("tile_lists"), batch.at("methods").contains("tiles"));
            EXPECT_TRUE(culling != "raster" || batch.at("state_bytes") > 0);
            if (!batch.contains("tile_lists")) continue;
            const auto& lists = batch.at("tile_lists");
            EXPECT_LE(lists.at("made"), lists.at("wanted"));
            EXPECT_EQ(lists.at("kept").get<int>(), lists.at("wanted").get<int>() - lists.at("made").get<int>());
            EXPECT_LE(lists.at("mean_leaves"), lists.at("mean_entries"));
            EXPECT_LE(lists.at("mean_entries"), lists.at("most_entries"));
            EXPECT_LE(lists.at("most_entries"), 32);
            EXPECT_LE(lists.at("share_of_rays_beyond_leaves"), 1);
            EXPECT_LE(lists.at("share_of_rays_ended_by_remembered_leaves"), 1);
            double in_steps = 0;
            for (const char* step : {"cull", "search", "rest"}) in_steps += lists.at("seconds").at(step).get<double>();
            EXPECT_GT(in_steps, 0) << batch;
        }
        EXPECT_TRUE(batches.contains("shadow") && batches.contains("diffuse"));
        EXPECT_EQ(stats.at("raster_culling").empty(), culling != "raster");
        for (const auto& kind : stats.at("raster_culling")) {
            EXPECT_EQ(kind.at("runs").get<int>() % 8, 0);
            EXPECT_GT(kind.at("draws"), 0) << kind;
            EXPECT_LE(kind.at("multi_queries"), kind.at("queries_issued"));
        }
    }
    EXPECT_GT(rays.at("shadow"), 0u);
    scene = std::string(HALFLIGHT_SOURCE_DIR) + "/scenes/cornell.glb";  // a scene with occluders in the light
    const nlohmann::json compute = run("compute");
    int shadow_batches = 0;
    for (const auto& batch : compute.at("ray_batches")) {
        if (batch.at("batch") != "shadow") continue;
        ++shadow_batches;
        EXPECT_GT(batch.at("tile_lists").at("kept"), 0) << "a still camera";
        EXPECT_GE(batch.at("tile_lists").at("mean_entries"), 1);
        EXPECT_GT(batch.at("tile_lists").at("share_of_rays_ended_by_remembered_leaves"), 0);
        EXPECT_GT(batch.at("state_bytes"), 0);
    }
    EXPECT_EQ(shadow_batches, 1);
}

}  // namespace
}  // namespace halflight::test
