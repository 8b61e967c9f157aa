// Tests `halflight info`, help and version, and the contents of `--stats`.
#include <map>
#include <regex>
#include <set>

#include "tests/cli/output_test.h"

namespace halflight::test {
namespace {

using Json = nlohmann::json;

class Info : public Output {
  protected:
    static Json info(const Strings& more) { return Json::parse(done(words("info --json", more)).out); }
};

TEST_F(Info, DescribesTheScene) {
    const Outcome text = done({"info", scene});
    EXPECT_EQ(text.err, "");
    expect_has(text.out, "front");
    const Json facts = info({scene});
    EXPECT_EQ(facts.at("counts").at("triangles"), 4);
    EXPECT_EQ(facts.at("cameras").at(1).at("name"), "above");
    EXPECT_EQ(facts.at("lights").at("emissive_triangles"), 2);
    EXPECT_EQ(facts.at("repaired").at("normals_generated"), 12);
    EXPECT_NEAR(facts.at("bounds").at("size").at(0), 4, 1e-6);
}

TEST_F(Info, NamesThePassesThatRun) {
    std::filesystem::create_directory(file("dark"));
    for (const std::string& path : {scene, copy_room(file("dark"), false).string()}) {
        const auto named = info({path}).at("passes").get<Strings>();
        done(words("render", path, file("a.exr"), "--env 0,0,0 --width 8 --height 8 --samples 1 --stats",
                   file("s.json")));
        std::set<std::string> left_out;
        const Json stats = json_file(file("s.json"));
        for (const Json& part : stats.at("left_out")) left_out.insert(part.at("what"));
        for (const char* pass : {"gbuffer", "shadow", "diffuse", "glossy", "continuation", "path reuse"})
            EXPECT_NE(std::ranges::count(named, pass), left_out.count(pass)) << pass;
    }
}

TEST_F(Info, ListsWhatIsLeftOutWithTheBytes) {
    const auto left_out = [&](const Strings& more) {
        std::map<std::string, Json> parts;
        const Json facts = info(words("--needs", scene, more));
        for (const Json& part : facts.at("left_out")) parts[part.at("what")] = part;
        return parts;
    };
    const auto parts = left_out({});
    EXPECT_FALSE(parts.at("alpha tests").at("fact").get<std::string>().empty());
    EXPECT_GE(parts.at("sums of squares").at("bytes"), 1280 * 720 * 24);
    EXPECT_FALSE(parts.contains("area lights"));
    EXPECT_TRUE(parts.contains("environment"));
    const auto lit = left_out(words("--env 0.5,0.5,0.5"));
    EXPECT_FALSE(lit.empty());
    EXPECT_FALSE(lit.contains("environment"));
    const std::string text = done({"info", "--needs", scene}).out;
    EXPECT_TRUE(std::regex_search(text, std::regex("\n  alpha tests +0  "))) << text;
    EXPECT_TRUE(std::regex_search(text, std::regex(R"(\n  light tree \* +\d)"))) << text;
    EXPECT_FALSE(has(done({"info", scene}).out, "alpha tests"));
}

TEST_F(Info, EstimatesTheMemoryOfThePicture) {
    const auto memory = [&](const Strings& options) { return info(words(scene, options)).at("memory"); };
    const auto bytes = [&](const Strings& options) { return memory(options).at("render_bytes").get<std::size_t>(); };
    const Json usual = memory({});
    std::size_t sum = 0;
    for (const auto& [part, of_part] : usual.at("render_parts").items()) sum += of_part.get<std::size_t>();
    EXPECT_EQ(usual.at("render_bytes"), sum);
    EXPECT_EQ(usual.at("render_size").at(0), 1280);
    const Strings large = words("--width 1920 --height 1440");
    EXPECT_EQ(memory(large).at("render_size"), Json({1920, 1440}));
    const auto with = [&](const char* more) { return bytes(words(large, more)); };
    const std::size_t plain = bytes(large);
    EXPECT_GT(plain, usual.at("render_bytes").get<std::size_t>());
    for (const char* more :
         {"--aov depth", "--png", "--error 0.1", "--preview filter", "--aov all", "--estimator shadow=2"})
        EXPECT_GT(with(more), plain) << more;
    EXPECT_LT(with("--bounces 1"), plain);
    EXPECT_EQ(with("--shutter 0.5"), plain) << "samples have times, and the sums are the same";
    write_text(file("s.json"), R"({"halflight_settings": 1, "size": [1920, 1440]})");
    EXPECT_EQ(bytes({"--settings", file("s.json")}), plain);

    // The estimate is sufficient for the picture.
    const Strings small = words("--width 320 --height 180 --aov all");
    done(words("render", scene, file("a.exr"), "--samples 2 --stats", file("stats.json"), small));
#ifndef HALFLIGHT_SANITIZED
    EXPECT_GE(bytes(small), json_file(file("stats.json")).at("peak_memory_bytes").get<std::size_t>());
#endif
}

/// A smaller budget gives smaller bands, less memory and the same picture.
TEST_F(Info, PicturesFitIntoTheBudget) {
    constexpr std::size_t kBudget = std::size_t{280} << 20;
    const auto stats_of = [&](const std::string& picture, const char* more) {
        done(words("render", scene, file(picture), "--width 480 --height 360 --samples 1 --aov all --bounces 2 --quiet",
                   "--reproducible --stats", file("fits.json"), more));
        return json_file(file("fits.json"));
    };
    const Json usual = stats_of("usual.exr", ""), fitted = stats_of("fitted.exr", "--memory 280MiB");
    EXPECT_EQ(read_text(file("usual.exr")), read_text(file("fitted.exr")));
    const auto bands = [](const Json& stats) {
        return stats.at("memory").at("part_bytes").at("bands").get<std::size_t>();
    };
    EXPECT_LT(bands(fitted), bands(usual));
    EXPECT_EQ(fitted.at("memory").at("limit_bytes"), kBudget);
#ifndef HALFLIGHT_SANITIZED
    EXPECT_LE(fitted.at("peak_memory_bytes").get<std::size_t>(), kBudget);
#endif
    refused(1, words("render", scene, file("b.exr"), "--width 4000 --height 4000 --aov all --memory 280MiB"),
            scene + ": needs ");
}

TEST_F(Info, ListsDevices) {
    const Outcome text = done({"info", "--device"});
    EXPECT_EQ(std::ranges::count(text.out, '*'), 1) << text.out;
    const Json devices = info({"--device"}).at("devices");
    EXPECT_FALSE(devices.empty());
    bool mesa = true;
    for (const Json& device : devices) {
        EXPECT_FALSE(device.at("reason").get<std::string>().empty()) << device;
        const auto name = device.at("name").get<std::string>();
        mesa = mesa && (!name.starts_with("EGL device") || has(name, ", software"));
    }
    refused(1, {"info", "--device"}, "GPU: no device works", {.environment = {"__EGL_VENDOR_LIBRARY_FILENAMES=/none"}});
    if (!mesa) return;  // Mesa alone reads MESA_GL_VERSION_OVERRIDE
    const RunOptions old{.environment = {"MESA_GL_VERSION_OVERRIDE=3.3"}};
    const Outcome json = run_program({"info", "--device", "--json", scene}, old);
    EXPECT_EQ(json.status, 1);
    EXPECT_EQ(json.err, "halflight: GPU: no device works\n");
    EXPECT_GT(Json::parse(json.out).at("devices").size(), 0u);
    EXPECT_GT(Json::parse(json.out).at("counts").at("triangles"), 0);
}

TEST_F(Info, HelpAndVersion) {
    for (const char* arguments : {"--help", "render --help", "info -h"}) {
        const Outcome help = done(words(arguments));
        EXPECT_EQ(help.err, "");
        expect_has(help.out, "Usage: halflight");
    }
    const std::regex versions(R"(halflight \d+\.\d+\.\d+\nbuild: [0-9a-f]{16}, .+\ndriver: .*OpenGL 4.*\n)"
                              R"(libraries: Embree \d[\d.]+, OpenColorIO \d[\d.]+, OpenEXR .+\n)");
    const Outcome told = done({"--version"});
    EXPECT_TRUE(std::regex_match(told.out, versions)) << told.out;
}

using Statistics = Output;

TEST_F(Statistics, DescribeTheRun) {
    render(words(file("a.exr"), "--samples 2 --stats", file("stats.json"), "--dump-graph", file("graph.dot")));
    const Json stats = json_file(file("stats.json"));
    EXPECT_EQ(stats.at("samples"), 2);
    EXPECT_EQ(stats.at("paths"), 32 * 32 * 2);
    EXPECT_EQ(stats.at("counts").at("triangles_with_instances"), 4);
    EXPECT_EQ(stats.at("settings").at("width"), 32);
    EXPECT_EQ(stats.at("outputs"), Strings{file("a.exr")});
    for (const char* bytes : {"gpu_bytes", "peak_memory_bytes"}) EXPECT_GT(stats.at(bytes), 0) << bytes;
    EXPECT_FALSE(stats.at("device").at("renderer").get<std::string>().empty());
    EXPECT_EQ(stats.at("device").at("errors"), 0);
    EXPECT_EQ(stats.at("bad_values").size(), 5u);
    for (const auto& [component, bad] : stats.at("bad_values").items())
        for (const char* kind : {"nan", "infinite", "negative"}) EXPECT_EQ(bad.at(kind), 0) << component << " " << kind;
    const Json& seconds = stats.at("seconds");
    double sum = 0;
    for (const char* step : {"load", "context", "prepare", "compile", "render", "finish", "write"})
        sum += seconds.at(step).get<double>();
    EXPECT_NEAR(sum, seconds.at("total").get<double>(), 0.05 * sum + 0.01) << seconds;
    double in_passes = 0;
    for (const Json& pass : stats.at("passes")) {
        in_passes += pass.at("seconds").get<double>();
        EXPECT_GE(pass.at("runs"), 2) << pass;
    }
    EXPECT_GT(in_passes, 0);
    EXPECT_LE(in_passes, seconds.at("total").get<double>());
    const std::string dot = read_text(file("graph.dot"));
    EXPECT_TRUE(dot.starts_with("digraph")) << dot.substr(0, 80);
    expect_has(dot, "gbuffer");
    // The short form has a row for each group of passes.
    render(words(file("a.exr"), "--samples 2 --dump-graph", file("graph.txt")));
    const std::string table = read_text(file("graph.txt"));
    expect_has(table, "\ngbuffer ");
    EXPECT_FALSE(has(table, ":")) << "it has single passes: " << table;
    EXPECT_TRUE(table.ends_with("  100 %\n")) << table;
}

TEST_F(Statistics, DescribeTheTracing) {
    const auto run = [&](const std::string& culling) {
        render(
            words(file(culling + ".exr"), "--samples 8 --aov all --culling", culling, "--stats", file("stats.json")));
        return json_file(file("stats.json"));
    };
    const std::map<std::string, Strings> methods = {{"off", {"plain"}},
                                                    {"compute", {"tiles"}},
                                                    {"raster", {"raster"}},
                                                    {"native", {"native"}},
                                                    {"auto", {"plain", "native", "tiles"}}};
    std::map<std::string, std::uint64_t> rays;
    for (const auto& [culling, names] : methods) {
        SCOPED_TRACE(culling);
        const auto stats = run(culling);
        EXPECT_TRUE(same_pixels(file(culling + ".exr"), file("auto.exr"))) << "culling changes no picture";
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
            EXPECT_TRUE(culling != "native" || alive == 0 || batch.contains("native")) << batch;
            if (batch.contains("native")) {
                const auto& native = batch.at("native");
                EXPECT_GE(native.at("rays"), alive);  // dead rays are included
                EXPECT_GE(native.at("share_of_rays_together"), 0);
                EXPECT_LE(native.at("share_of_rays_together"), 1);
            }
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
    const Json compute = run("compute");
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
