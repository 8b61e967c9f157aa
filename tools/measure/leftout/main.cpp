// halflight-leftout: measures the savings from leaving out work that a scene does not need. Each scene is rendered as
// it is and with everything kept, or with single items kept, in turns. Reports time per sample, time to start, memory,
// and whether the pictures are the same bit for bit.
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "engine/core/error.h"
#include "engine/core/statistics.h"
#include "engine/gpu/driver_needs.h"
#include "engine/io/files.h"
#include "engine/io/gltf/gltf.h"
#include "tools/common/tool_main.h"
#include "tools/measure/leftout/measure.h"

namespace halflight::leftout {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kEverything = "everything";

struct Options {
    std::vector<std::string> scenes;
    Settings settings;
    bool each = false;               // measures each item by itself, too
    std::vector<std::string> items;  // names of the items for `each`; empty: all
    std::string json;
};

/// Returns the median of kept - lean.
double added_median(const std::vector<double>& lean, const std::vector<double>& kept) {
    std::vector<double> differences(lean.size());
    std::ranges::transform(kept, lean, differences.begin(), std::minus<>());
    return median(differences);
}

const char* verdict(const Comparison& c) {
    return c.same_bits ? "same" : "DIFFERENT";
}

void print_scene_head() {
    fmt::print("{:<20} {:>4} {:>19}  {:>19} {:>17} {:>5}  {}\n", "", "left", "ms of CPU a sample", "times as much",
               "MB on the device", "", "pictures");
    fmt::print("{:<20} {:>4} {:>9} {:>9}  {:>19} {:>8} {:>8} {:>5}\n", "scene", "out", "kept", "lean",
               "median [quartiles]", "kept", "lean", "ratio");
}

void print_scene(const std::string& name, const Comparison& c) {
    const bench::Quartiles ratio = c.time_ratio();
    const double lean = static_cast<double>(c.lean.bytes), kept = static_cast<double>(c.kept.bytes);
    fmt::print("{:<20} {:>4} {:>9.1f} {:>9.1f}  {:>4.2f} [{:.2f}, {:.2f}] {:>8.1f} {:>8.1f} {:>5.2f}  {}\n", name,
               c.lean.left_out.size(), 1e3 * median(c.kept.sample_seconds), 1e3 * median(c.lean.sample_seconds),
               ratio.median, ratio.lower, ratio.upper, 1e-6 * kept, 1e-6 * lean, kept / lean, verdict(c));
}

void print_item_head() {
    fmt::print("{:<30} {:>8} {:>20} {:>15} {:>17}  {}\n", "", "ms of a", "times as much",
               "ms to start:", "kB on the device:", "");
    fmt::print("{:<30} {:>8} {:>20} {:>7} {:>7} {:>8} {:>8}  {:<9} {}\n", "left out", "sample", "median [quartiles]",
               "prepare", "compile", "listed", "saved", "pictures", "brought along");
}

void print_item(const std::string& name, std::size_t listed_bytes, const Comparison& c) {
    const bench::Quartiles ratio = c.time_ratio();
    std::string others;
    if (name != kEverything)
        for (const std::string& other : c.added())
            if (other != name) others += (others.empty() ? "" : ", ") + other;
    fmt::print("{:<30} {:>8.2f} {:>4.3f} [{:.3f}, {:.3f}] {:>7.0f} {:>7.0f} {:>8.0f} {:>8.0f}  {:<9} {}\n", name,
               1e3 * added_median(c.lean.sample_seconds, c.kept.sample_seconds), ratio.median, ratio.lower, ratio.upper,
               1e3 * added_median(c.lean.prepare_seconds, c.kept.prepare_seconds),
               1e3 * added_median(c.lean.compile_seconds, c.kept.compile_seconds),
               1e-3 * static_cast<double>(listed_bytes),
               1e-3 * (static_cast<double>(c.kept.bytes) - static_cast<double>(c.lean.bytes)), verdict(c), others);
}

/// Measures scenes, prints each row at once, and gathers all figures.
class Report {
  public:
    Report(gpu::Context& context, const Options& options) : context_(context), options_(options) {}

    void add(const std::string& file) {
        const Scene scene = load_gltf(file);
        const std::string name = std::filesystem::path(file).filename().string();
        const Comparison all = measure(scene, Kept::everything());
        Json row{{"scene", name}};
        row.update(to_json(all));
        options_.each ? print_all(name, all) : print_scene(name, all);
        std::fflush(stdout);
        row["left_out"] = Json::array();
        std::string not_kept;
        for (const LeftOut& part : all.lean.left_out) {
            row["left_out"].push_back({{"what", part.what}, {"fact", part.fact}, {"bytes", part.bytes}});
            if (!wanted(part.what)) continue;
            const Comparison one = measure(scene, Kept({part.what}));
            if (one.added().empty()) {
                not_kept += (not_kept.empty() ? "" : ", ") + part.what;
                continue;
            }
            print_item(part.what, part.bytes, one);
            std::fflush(stdout);
            Json figures{{"added", one.added()}};
            figures.update(to_json(one));
            row["left_out"].back()["kept_alone"] = std::move(figures);
        }
        if (!not_kept.empty()) fmt::print("cannot be kept here: {}\n", not_kept);
        rows.push_back(std::move(row));
    }

    Json rows = Json::array();
    bool same = true;  // all pictures are the same bit for bit

  private:
    Comparison measure(const Scene& scene, const Kept& kept) {
        Comparison comparison = compare(context_, scene, colors_, kept, options_.settings);
        same = same && comparison.same_bits;
        return comparison;
    }
    bool wanted(const std::string& item) const {
        return options_.each && (options_.items.empty() || std::ranges::count(options_.items, item) > 0);
    }
    void print_all(const std::string& scene, const Comparison& all) const {
        std::size_t listed = 0;
        for (const LeftOut& part : all.lean.left_out) listed += part.bytes;
        fmt::print("\n{}: {:.2f} ms of CPU a sample\n", scene, 1e3 * median(all.lean.sample_seconds));
        print_item_head();
        print_item(kEverything, listed, all);
    }

    gpu::Context& context_;
    const Options& options_;
    const ColorConfig colors_ = ColorConfig::load();
};

int run(const Options& options) {
    gpu::prepare_process();
    // Compilation is timed, so it must not depend on earlier runs.
    setenv("MESA_SHADER_CACHE_DISABLE", "true", 0);
    setenv("__GL_SHADER_DISK_CACHE", "0", 0);
    gpu::Context context = gpu::Context::create({});
    const Settings& s = options.settings;
    fmt::print("{} x {} pixels, {} samples, {} turns, no culling, on {}\n", s.width, s.height, s.samples, s.turns,
               context.renderer());
    if (!options.each) print_scene_head();
    Report report(context, options);
    for (const std::string& scene : options.scenes) report.add(scene);
    if (!options.json.empty()) write_file(options.json, report.rows.dump(2) + "\n");
    if (!report.same) throw Error("halflight-leftout", "the parts left out would have changed a picture");
    return 0;
}

}  // namespace
}  // namespace halflight::leftout

int main(int argc, char** argv) {
    halflight::leftout::Options options;
    halflight::leftout::Settings& settings = options.settings;
    CLI::App app("Measures what leaving out unneeded parts of a scene saves, in turns with --keep-all.",
                 "halflight-leftout");
    app.add_option("SCENE", options.scenes, "glTF 2.0 scenes, each seen by its first camera")->required();
    CLI::Option* each = app.add_flag("--items", options.each, "measure each item that is left out by itself, too");
    app.add_option("--item", options.items, "with --items: measure only this item; may be repeated")
        ->allow_extra_args(false)
        ->check(CLI::IsMember(halflight::keepable_names()).description("NAME"))
        ->needs(each);
    app.add_option("--width", settings.width, "width of the picture in pixels")
        ->check(CLI::Range(1, 8192))
        ->capture_default_str();
    app.add_option("--height", settings.height, "height of the picture in pixels")
        ->check(CLI::Range(1, 8192))
        ->capture_default_str();
    app.add_option("--samples", settings.samples, "samples per picture")
        ->check(CLI::Range(1, 1 << 16))
        ->capture_default_str();
    app.add_option("--turns", settings.turns, "pictures of each variant")
        ->check(CLI::Range(1, 1 << 16))
        ->capture_default_str();
    app.add_option("--starts", settings.starts, "number of times that each variant is prepared and compiled anew")
        ->check(CLI::Range(1, 1 << 16))
        ->capture_default_str();
    app.add_option("--json", options.json, "write all figures to this file");
    return halflight::tool_main(app, argc, argv, [&] { return halflight::leftout::run(options); });
}
