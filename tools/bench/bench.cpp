#include "tools/bench/bench.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <map>
#include <thread>

#include "engine/core/error.h"
#include "engine/io/files.h"
#include "engine/io/gltf.h"
#include "tools/bench/capture.h"
#include "tools/bench/report.h"

namespace halflight::bench {
namespace {

struct NamedCamera {
    std::string name;
    Camera camera;
};

NamedCamera pick_camera(const Scene& scene, const std::string& wanted) {
    for (std::size_t i = 0; i < scene.cameras.size(); ++i) {
        const std::string& name = scene.cameras[i].name;
        if (wanted.empty() || wanted == name || wanted == std::to_string(i)) return {name, scene.cameras[i]};
    }
    if (!wanted.empty()) throw Error(scene.name, "has no camera \"{}\"", wanted);
    return {"framing", framing_camera(scene)};
}

ivec2 parse_size(const std::string& text) {
    ivec2 size(0);
    char end = 0;
    if (std::sscanf(text.c_str(), "%dx%d%c", &size.x, &size.y, &end) != 2 || glm::any(glm::lessThan(size, ivec2(1))))
        throw Error("--size", "\"{}\" is not WIDTHxHEIGHT", text);
    return size;
}

/// With light, and without coverage: what is measured is the way to triangles, and other tracers would need callbacks
/// for alpha tests.
Scene load(const std::string& file) {
    Scene scene = load_gltf(file);
    for (Material& m : scene.materials) m.alpha_mode = AlphaMode::opaque;
    if (!has_light(scene)) scene.environment = default_sky();
    return scene;
}

rays::PackedScene pack(const TraceTables& tables, const std::string& nodes) {
    if (nodes == "auto") return rays::pack_scene(tables);
    return rays::pack_scene(tables, nodes == "grid" ? rays::NodeFormat::grid : rays::NodeFormat::floating);
}

/// In the order of reports.
std::vector<Method> make_methods(const std::vector<std::string>& wanted, const Bench& bench,
                                 std::vector<std::string>& left_out) {
    std::vector<Method> methods;
    for (const std::string& name : method_names()) {
        if (!wanted.empty() && std::ranges::find(wanted, name) == wanted.end()) continue;
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
    Scene scene = load(file);
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
    const std::vector<Method> methods =
        make_methods(arguments.methods, {context, programs, tables, packed, trace, embree}, result.left_out);
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

}  // namespace

void add_options(CLI::App& app, BenchArguments& a) {
    static const std::map<std::string, Clock> clocks{{"wall", Clock::wall}, {"cpu", Clock::cpu}};
    app.add_option("--scene", a.scenes, "glTF files")->type_name("FILE")->required();
    app.add_option("--camera", a.camera, "name or number (default: the first, else one that sees everything)")
        ->type_name("NAME|N");
    app.add_option("--size", a.size, "of the picture (default " + a.size + ")")->type_name("WIDTHxHEIGHT");
    app.add_option("--kinds", a.kinds, "which rays (default all)")->delimiter(',')->check(CLI::IsMember(ray_kinds()));
    app.add_option("--methods", a.methods, "which tracers (default all)")
        ->delimiter(',')
        ->check(CLI::IsMember(method_names()));
    const CLI::Range count(1, 10000);
    app.add_option("--turns", a.turns,
                   fmt::format("rounds through all methods, after one to warm up (default {})", a.turns))
        ->type_name("N")
        ->check(count);
    app.add_option("--repeats", a.repeats,
                   fmt::format("runs of a method in each turn, whose mean counts (default {})", a.repeats))
        ->type_name("N")
        ->check(count);
    app.add_option("--clock", a.clock, "time that figures are made of (default wall)")
        ->transform(CLI::CheckedTransformer(clocks).description("{wall,cpu}"))
        ->type_name("");
    app.add_option("--nodes", a.nodes, "format of the hierarchy's nodes (default " + a.nodes + ")")
        ->type_name("")
        ->check(CLI::IsMember({"auto", "grid", "float"}));
    app.add_flag("--keep-instances", a.keep_instances, "no flattening of small scenes");
    app.add_flag("--robust", a.robust, "Embree's watertight mode instead of its fast one");
    app.add_option("--device", a.device, "as of halflight render")->type_name("NAME|N");
    app.add_option("--json", a.json, "write all times and figures")->type_name("FILE.json");
}

void run_bench(const BenchArguments& arguments, const std::function<void()>& between) {
    parse_size(arguments.size);
    gpu::Context context = gpu::Context::create({.device = arguments.device});
    const unsigned threads = std::thread::hardware_concurrency();
    fmt::print("{}, {} threads, Embree {}, {} turns of {}\n", context.renderer(), threads, RTC_VERSION_STRING,
               arguments.turns, arguments.repeats);
    nlohmann::json report = {{"schema", kSchema},
                             {"renderer", context.renderer()},
                             {"threads", threads},
                             {"embree", RTC_VERSION_STRING},
                             {"embree_robust", arguments.robust},
                             {"turns", arguments.turns},
                             {"repeats", arguments.repeats},
                             {"clock", arguments.clock == Clock::wall ? "wall" : "cpu"},
                             {"scenes", nlohmann::json::array()}};
    std::size_t disagreements = 0;
    for (const std::string& file : arguments.scenes) {
        const SceneResult result = measure_scene(arguments, file, context, between);
        fmt::print("{}", table(result, arguments.clock));
        std::fflush(stdout);
        report["scenes"].push_back(json(result, arguments.clock));
        disagreements += result.disagreements();
    }
    if (!arguments.json.empty()) write_file(arguments.json, report.dump(2) + '\n');
    if (disagreements > 0) throw Error("bench", "{} answers differ from the plain tracer's", disagreements);
}

}  // namespace halflight::bench
