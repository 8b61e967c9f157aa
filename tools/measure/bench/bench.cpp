#include "tools/measure/bench/bench.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <optional>
#include <thread>

#include "engine/core/error.h"
#include "engine/gpu/driver_needs.h"
#include "engine/io/file_kind.h"
#include "engine/io/files.h"
#include "engine/paging/page_file.h"
#include "shaders/shared/tile_list.h"
#include "tools/measure/bench/capture.h"
#include "tools/measure/bench/frames_report.h"
#include "tools/measure/bench/report.h"
#include "tools/measure/bench/setup.h"

namespace halflight::bench {
namespace {

/// Makes the wanted methods, in the order of reports; names those that cannot take the scene in `left_out`.
std::vector<Method> make_methods(const std::vector<std::string>& wanted, const Bench& bench,
                                 std::vector<std::string>& left_out) {
    std::vector<Method> methods;
    for (const std::string& name : method_names()) {
        if (!wanted.empty() && std::ranges::find(wanted, name) == wanted.end()) continue;
        if (wanted.empty() && !bench.pages && name.starts_with("paged")) continue;
        try {
            methods.push_back(make_method(name, bench));
        } catch (const Error& error) {
            left_out.emplace_back(error.what());
        }
    }
    return methods;
}

SceneResult measure_scene(const BenchArguments& arguments, const std::string& file, gpu::Context& context,
                          const std::function<void()>& between) {
    SceneResult result;
    result.file = file;
    result.size = parse_size(arguments.size);
    Scene scene = load_lit(file, arguments.strict);
    // Other tracers would need callbacks for alpha tests, so surfaces are opaque for all tracers.
    for (Material& m : scene.materials) m.alpha_mode = AlphaMode::opaque;
    const NamedCamera camera = pick_camera(scene, arguments.camera);
    result.camera = camera.name;
    const TraceTables tables = build_trace_tables(scene, arguments.keep_instances ? 0 : kFlattenLimit);
    if (tables.instances.empty()) throw Error(file, "has no triangle");
    const EmbreeTracer embree(tables, arguments.robust);
    const rays::PackedScene packed = pack(tables, arguments.nodes);
    const rays::TraceScene trace(tables, packed, {});
    result.statistics = trace.statistics();
    result.embree_build_seconds = embree.build_seconds();
    gpu::ProgramCache programs;
    const std::vector<RaySet> sets = capture(context, programs, scene, tables, trace, camera.camera, result.size,
                                             arguments.kinds.empty() ? ray_kinds() : arguments.kinds);
    const rays::TileSettings tiles{static_cast<std::uint32_t>(arguments.tile),
                                   static_cast<std::uint32_t>(arguments.entries)};
    std::optional<paging::PageFile> pages;
    if (!arguments.pages.empty()) pages.emplace(arguments.pages);
    const Bench bench{context,
                      programs,
                      tables,
                      packed,
                      trace,
                      embree,
                      tiles,
                      pages ? &*pages : nullptr,
                      arguments.pool_bytes,
                      arguments.page_schedule};
    const std::vector<Method> methods = make_methods(arguments.methods, bench, result.left_out);
    for (const RaySet& set : sets) {
        if (set.live == 0) {
            result.left_out.push_back(set.kind + ": no rays");
        } else if (!methods.empty()) {
            result.kinds.push_back(measure(set, methods, arguments.turns, arguments.repeats, between));
        }
        context.check(set.kind);
    }
    return result;
}

FrameReport measure_scene_frames(const BenchArguments& arguments, const std::string& file, gpu::Context& context,
                                 const std::function<void()>& between) {
    const Scene scene = load_lit(file, arguments.strict);
    const NamedCamera camera = pick_camera(scene, arguments.camera);
    const TraceTables tables = build_trace_tables(scene, arguments.keep_instances ? 0 : kFlattenLimit);
    if (tables.instances.empty()) throw Error(file, "has no triangle");
    FrameReport report{file, camera.name, {}, {}};
    report.order = {arguments.variants, parse_size(arguments.size), arguments.bounces, arguments.samples,
                    arguments.views,    arguments.reference};
    report.result =
        measure_frames(context, scene, tables, pack(tables, arguments.nodes), camera.camera, report.order, between);
    return report;
}

/// Returns a validator that accepts the members of a list.
CLI::Validator one_of(const std::vector<std::string>& names) {
    return {[names](std::string& text) {
                if (std::ranges::find(names, text) != names.end()) return std::string();
                return fmt::format("expects one of {}, not '{}'", fmt::join(names, ", "), text);
            },
            fmt::format("{{{}}}", fmt::join(names, ","))};
}

CLI::Validator whole_number(int least, int greatest) {
    return {[=](std::string& text) {
                int value = 0;
                if (CLI::detail::lexical_cast(text, value) && value >= least && value <= greatest) return std::string();
                return fmt::format("expects a whole number from {} to {}, not '{}'", least, greatest, text);
            },
            fmt::format("{} to {}", least, greatest)};
}

/// Throws Error about files that cannot be read or written, before the long work begins.
void check_files(const BenchArguments& a) {
    for (const std::string& scene : a.scenes) check_readable(scene);
    if (a.json.empty()) return;
    check_takes_text(a.json);
    check_writable(a.json);
}

}  // namespace

void add_options(CLI::App& app, BenchArguments& a) {
    app.add_option("--scene", a.scenes, "glTF files")->type_name("FILE")->required();
    app.add_option("--camera", a.camera,
                   "camera by name or number (default: the first, or one that sees the whole scene)")
        ->type_name("NAME|N");
    app.add_option("--size", a.size, "size of the picture in pixels (default " + a.size + ")")
        ->type_name("WIDTHxHEIGHT")
        ->check(CLI::Validator(
            [](std::string& text) {
                try {
                    parse_size(text);
                    return std::string();
                } catch (const Error& error) {
                    return std::string(error.reason());
                }
            },
            ""));
    app.add_flag("--strict", a.strict,
                 "fails for scenes that break the rules of glTF, and for images that cannot be read");
    CLI::Option* frames = app.add_flag("--frames", a.frames, "measures whole frames instead of single ray batches");
    app.add_option("--kinds", a.kinds, "kinds of rays (default all)")
        ->delimiter(',')
        ->check(one_of(ray_kinds()))
        ->excludes(frames);
    app.add_option("--methods", a.methods, "tracers (default all)")
        ->delimiter(',')
        ->check(one_of(method_names()))
        ->excludes(frames);
    const CLI::Validator count = whole_number(1, 10000);
    app.add_option("--turns", a.turns,
                   fmt::format("rounds through all tracers, after a warm-up round (default {})", a.turns))
        ->type_name("N")
        ->check(count)
        ->excludes(frames);
    app.add_option("--repeats", a.repeats,
                   fmt::format("runs of a tracer in each turn, which are averaged (default {})", a.repeats))
        ->type_name("N")
        ->check(count)
        ->excludes(frames);
    app.add_option("--tile", a.tile, fmt::format("side of a tile in pixels, 8 or 16 (default {})", a.tile))
        ->type_name("N")
        ->check(one_of({"8", "16"}))
        ->excludes(frames);
    app.add_option(
           "--entries", a.entries,
           fmt::format("capacity of a tile's list, at most {} (default {})", shared::kMostTileEntries, a.entries))
        ->type_name("N")
        ->check(whole_number(1, shared::kMostTileEntries))
        ->excludes(frames);
    app.add_option("--pages", a.pages, "page file of the scene, for the methods paged and paged-*")
        ->type_name("FILE")
        ->excludes(frames);
    app.add_option_function<double>(
           "--page-pool", [&a](double mib) { a.pool_bytes = static_cast<std::size_t>(mib * 1048576); },
           "room for pages of the methods paged and paged-cold, in MiB (default: for all pages)")
        ->type_name("MIB")
        ->check(CLI::PositiveNumber)
        ->excludes(frames);
    app.add_option_function<std::string>(
           "--page-schedule",
           [&a](const std::string& text) {
               a.page_schedule = *std::ranges::find(paging::kPageSchedules, text,
                                                    [](auto schedule) { return std::string(name(schedule)); });
           },
           fmt::format("method that finds the pages that rays need (default {})", name(a.page_schedule)))
        ->type_name("")
        ->check(one_of({"demand", "set", "queries"}))
        ->excludes(frames);
    app.add_option("--variants", a.variants,
                   fmt::format("tracing methods of the frames (default {})", fmt::join(a.variants, ",")))
        ->delimiter(',')
        ->check(one_of(variant_names()))
        ->needs(frames);
    app.add_option("--bounces", a.bounces, fmt::format("reflections along a path (default {})", a.bounces))
        ->type_name("N")
        ->check(whole_number(0, 10000))
        ->needs(frames);
    app.add_option("--samples", a.samples, fmt::format("samples of the still frame (default {})", a.samples))
        ->type_name("N")
        ->check(count)
        ->needs(frames);
    app.add_option("--views", a.views, fmt::format("views of the moving camera (default {})", a.views))
        ->type_name("N")
        ->check(whole_number(0, 10000))
        ->needs(frames);
    app.add_option("--reference", a.reference, "samples of the reference picture for errors (default: no errors)")
        ->type_name("N")
        ->check(whole_number(0, 1000000))
        ->needs(frames);
    app.add_option_function<std::string>(
           "--clock", [&a](const std::string& text) { a.clock = text == "cpu" ? Clock::cpu : Clock::wall; },
           "clock of all times (default wall)")
        ->type_name("")
        ->check(one_of({"wall", "cpu"}));
    app.add_option("--nodes", a.nodes, "format of the hierarchy's nodes (default " + a.nodes + ")")
        ->type_name("")
        ->check(one_of({"auto", "grid", "float"}));
    app.add_flag("--keep-instances", a.keep_instances, "does not flatten small scenes");
    app.add_flag("--robust", a.robust, "uses Embree's watertight mode instead of its fast one");
    app.add_option("--device", a.device, "device to render on, as for halflight render")->type_name("NAME|N");
    app.add_option("--json", a.json, "writes all times and figures to this file")->type_name("FILE.json");
}

void run_bench(const BenchArguments& arguments, const std::function<void()>& between) {
    gpu::prepare_process();
    check_files(arguments);
    gpu::Context context = gpu::Context::create({.device = arguments.device});
    const unsigned threads = std::thread::hardware_concurrency();
    fmt::print("{}, {} threads, Embree {}\n", context.renderer(), threads, RTC_VERSION_STRING);
    nlohmann::json report = {{"schema", kSchema},
                             {"renderer", context.renderer()},
                             {"threads", threads},
                             {"embree", RTC_VERSION_STRING},
                             {"embree_robust", arguments.robust},
                             {"turns", arguments.turns},
                             {"repeats", arguments.repeats},
                             {"tile", arguments.tile},
                             {"entries", arguments.entries},
                             {"clock", arguments.clock == Clock::wall ? "wall" : "cpu"},
                             {"scenes", nlohmann::json::array()},
                             {"frames", nlohmann::json::array()}};
    std::size_t disagreements = 0;
    const auto add = [&](const char* list, const auto& result, std::size_t wrong) {
        fmt::print("{}", table(result, arguments.clock));
        std::fflush(stdout);
        report[list].push_back(json(result, arguments.clock));
        disagreements += wrong;
    };
    for (const std::string& file : arguments.scenes) {
        if (arguments.frames) {
            const FrameReport result = measure_scene_frames(arguments, file, context, between);
            add("frames", result, result.result.different);
        } else {
            const SceneResult result = measure_scene(arguments, file, context, between);
            add("scenes", result, result.disagreements());
        }
    }
    if (!arguments.json.empty()) write_file(arguments.json, report.dump(2) + '\n');
    if (disagreements > 0)
        throw Error(
            "bench", "{} {}", disagreements,
            arguments.frames ? "pixels depend on the tracing method" : "answers differ from the plain tracer's");
}

}  // namespace halflight::bench
