// halflight-leftout: what it saves to leave out what a scene does not need. Each scene is rendered as it is and with
// all of it kept, in turns within one process: time per sample, memory, and whether the pictures are the same, bit for
// bit.
#include <fmt/format.h>

#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "engine/core/error.h"
#include "engine/core/image_tools.h"
#include "engine/core/statistics.h"
#include "engine/io/files.h"
#include "engine/io/gltf.h"
#include "passes/render.h"
#include "tools/bench/measure.h"
#include "tools/tool_main.h"

namespace halflight {
namespace {

using Json = nlohmann::ordered_json;

struct Options {
    std::vector<std::string> scenes;
    int width = 256, height = 256;  // pixels
    int samples = 4;                // of a picture
    int turns = 9;
    std::string json;
};

/// One of the two: a renderer, and what its pictures took.
struct Side {
    Renderer renderer;
    std::vector<double> seconds;  // per sample, of all threads, by turn
    RenderResult last;

    void render() { last = renderer.render(); }
    void measure(int samples) {
        seconds.push_back(bench::time_of([&] { render(); }).cpu / samples);
    }
};

bool same_bits(const RenderResult& a, const RenderResult& b) {
    bool same = same_bits(a.beauty, b.beauty) && a.aovs.size() == b.aovs.size();
    for (std::size_t i = 0; same && i < a.aovs.size(); ++i) same = same_bits(a.aovs[i].image, b.aovs[i].image);
    return same;
}

Json measure(gpu::Context& context, const std::string& file, const Options& options) {
    const Scene scene = load_gltf(file);
    RenderSettings settings;
    settings.width = options.width, settings.height = options.height;
    settings.camera = scene.cameras.empty() ? framing_camera(scene) : scene.cameras.front();
    settings.samples = options.samples;
    settings.culling = rays::Culling::off;  // its trials would be timed, too
    const ColorConfig colors = ColorConfig::load();
    Side lean{Renderer(context, scene, colors, settings), {}, {}};
    settings.kept = Kept::everything();
    Side kept{Renderer(context, scene, colors, settings), {}, {}};

    lean.render();  // compiles
    kept.render();
    for (int turn = 0; turn < options.turns; ++turn) {
        Side& first = turn % 2 == 0 ? lean : kept;
        first.measure(options.samples);
        (&first == &lean ? kept : lean).measure(options.samples);
    }
    const bench::Quartiles ratio = bench::speedup(lean.seconds, kept.seconds);
    Json left_out = Json::array();
    for (const LeftOut& l : lean.last.stats.left_out)
        left_out.push_back({{"what", l.what}, {"fact", l.fact}, {"bytes", l.bytes}});
    return {{"scene", std::filesystem::path(file).filename().string()},
            {"seconds_per_sample", {{"lean", lean.seconds}, {"kept", kept.seconds}}},
            {"time_ratio", {{"lower", ratio.lower}, {"median", ratio.median}, {"upper", ratio.upper}}},
            {"bytes", {{"lean", lean.last.stats.gpu_bytes}, {"kept", kept.last.stats.gpu_bytes}}},
            {"same_bits", same_bits(lean.last, kept.last)},
            {"left_out", left_out}};
}

void print(const Json& row) {
    const auto milliseconds = [&](const char* side) {
        return 1e3 * median(row["seconds_per_sample"][side].get<std::vector<double>>());
    };
    const auto megabytes = [&](const char* side) { return 1e-6 * row["bytes"][side].get<double>(); };
    const Json& ratio = row["time_ratio"];
    fmt::print("{:<20} {:>4} {:>9.1f} {:>9.1f}  {:>4.2f} [{:.2f}, {:.2f}] {:>8.1f} {:>8.1f} {:>5.2f}  {}\n",
               row["scene"].get<std::string>(), row["left_out"].size(), milliseconds("kept"), milliseconds("lean"),
               ratio["median"].get<double>(), ratio["lower"].get<double>(), ratio["upper"].get<double>(),
               megabytes("kept"), megabytes("lean"), megabytes("kept") / megabytes("lean"),
               row["same_bits"].get<bool>() ? "same" : "DIFFERENT");
    std::fflush(stdout);
}

int run(const Options& options) {
    gpu::Context context = gpu::Context::create({});
    fmt::print("{} x {} pixels, {} samples, {} turns, no culling, on {}\n", options.width, options.height,
               options.samples, options.turns, context.renderer());
    fmt::print("{:<20} {:>4} {:>19}  {:>19} {:>17} {:>5}  {}\n", "", "left", "ms of CPU a sample", "times as much",
               "MB on the device", "", "pictures");
    fmt::print("{:<20} {:>4} {:>9} {:>9}  {:>19} {:>8} {:>8} {:>5}\n", "scene", "out", "kept", "lean",
               "median [quartiles]", "kept", "lean", "ratio");
    Json rows = Json::array();
    bool same = true;
    for (const std::string& scene : options.scenes) {
        rows.push_back(measure(context, scene, options));
        print(rows.back());
        same = same && rows.back()["same_bits"].get<bool>();
    }
    if (!options.json.empty()) write_file(options.json, rows.dump(2) + "\n");
    if (!same) throw Error("halflight-leftout", "what was left out would have changed a picture");
    return 0;
}

}  // namespace
}  // namespace halflight

int main(int argc, char** argv) {
    halflight::Options options;
    CLI::App app("What it saves to leave out what a scene does not need, against --keep-all, in turns",
                 "halflight-leftout");
    app.add_option("SCENE", options.scenes, "glTF 2.0 scenes, each seen by its first camera")->required();
    app.add_option("--width", options.width, "pixels")->check(CLI::Range(1, 8192))->capture_default_str();
    app.add_option("--height", options.height, "pixels")->check(CLI::Range(1, 8192))->capture_default_str();
    app.add_option("--samples", options.samples, "of a picture")->check(CLI::Range(1, 1 << 16))->capture_default_str();
    app.add_option("--turns", options.turns, "pictures of each")->check(CLI::Range(1, 1 << 16))->capture_default_str();
    app.add_option("--json", options.json, "write all figures to this file");
    return halflight::tool_main(app, argc, argv, [&] { return halflight::run(options); });
}
