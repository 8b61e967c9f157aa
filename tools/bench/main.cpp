// halflight-bench: rays per second of the plain tracer beside Embree's single-ray mode, interleaved in one process.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <thread>

#include "engine/core/error.h"
#include "engine/gpu/context.h"
#include "engine/io/files.h"
#include "engine/io/gltf.h"
#include "tools/bench/report.h"

namespace {

using namespace halflight;

struct Arguments {
    std::vector<std::string> scenes;
    std::vector<std::string> kinds = bench::ray_kinds();
    std::string camera;
    std::string size = "1280x720";
    std::string json;
    std::string device;
    std::string nodes = "auto";
    int repeats = 9;
    bool robust = false;
    bool keep_instances = false;
};

Camera pick_camera(const Scene& scene, const std::string& wanted) {
    for (std::size_t i = 0; i < scene.cameras.size(); ++i) {
        if (wanted.empty() || wanted == scene.cameras[i].name || wanted == std::to_string(i)) return scene.cameras[i];
    }
    if (!wanted.empty()) throw Error(scene.name, "has no camera \"{}\"", wanted);
    return framing_camera(scene);
}

/// What is measured is the way to triangles: alpha tests, which Embree would leave to a callback, are taken off.
TraceTables opaque_tables(const Scene& scene, bool flatten) {
    TraceTables tables = build_trace_tables(scene, flatten ? kFlattenLimit : 0);
    for (uvec4& t : tables.triangles) t.w &= ~kTriangleAlpha;
    tables.alpha_tested = false;
    return tables;
}

rays::TraceScene plain_scene(const TraceTables& tables, const std::string& nodes) {
    if (nodes == "auto") return rays::TraceScene(tables);
    const rays::NodeFormat format = nodes == "grid" ? rays::NodeFormat::grid : rays::NodeFormat::floating;
    return {tables, rays::pack_scene(tables, format), {}};
}

bench::SceneResult measure_scene(const Arguments& arguments, const std::string& file) {
    bench::SceneResult result;
    result.file = file;
    if (std::sscanf(arguments.size.c_str(), "%dx%d", &result.width, &result.height) != 2 || result.width < 1 ||
        result.height < 1) {
        throw Error("--size", "\"{}\" is not WIDTHxHEIGHT", arguments.size);
    }
    const Scene scene = load_gltf(file);
    const TraceTables tables = opaque_tables(scene, !arguments.keep_instances);
    const bench::EmbreeTracer embree(tables, arguments.robust);
    const rays::TraceScene plain = plain_scene(tables, arguments.nodes);
    result.statistics = plain.statistics();
    result.embree_build_seconds = embree.build_seconds();
    gpu::ProgramCache programs;
    const auto sets =
        bench::make_rays(scene, tables, embree, pick_camera(scene, arguments.camera), result.width, result.height);
    for (const bench::RaySet& set : sets) {
        if (std::find(arguments.kinds.begin(), arguments.kinds.end(), set.kind) == arguments.kinds.end()) continue;
        result.kinds.push_back(bench::measure(set, plain, embree, programs, arguments.repeats));
    }
    return result;
}

int run(int argc, char** argv) {
    CLI::App app("Rays per second of the plain tracer and of Embree's single-ray mode, in turns.", "halflight-bench");
    Arguments arguments;
    app.add_option("--scene", arguments.scenes, "glTF files")->required();
    app.add_option("--camera", arguments.camera, "name or index; default: the first, else one that sees everything");
    app.add_option("--size", arguments.size, "WIDTHxHEIGHT")->capture_default_str();
    app.add_option("--kinds", arguments.kinds, "which rays")->delimiter(',')->check(CLI::IsMember(bench::ray_kinds()));
    app.add_option("--repeats", arguments.repeats, "turns after one to warm up")
        ->check(CLI::Range(1, 1000))
        ->capture_default_str();
    app.add_option("--nodes", arguments.nodes, "format of the hierarchy's nodes")
        ->check(CLI::IsMember({"auto", "grid", "float"}))
        ->capture_default_str();
    app.add_flag("--keep-instances", arguments.keep_instances, "no flattening of small scenes");
    app.add_flag("--robust", arguments.robust, "Embree's watertight mode instead of its fast one");
    app.add_option("--device", arguments.device, "as of halflight render");
    app.add_option("--json", arguments.json, "a file for the figures");
    CLI11_PARSE(app, argc, argv);

    const gpu::Context context = gpu::Context::create({.device = arguments.device});
    const unsigned threads = std::thread::hardware_concurrency();
    std::printf("%s, %u threads, Embree %s, medians of %d\n", context.renderer().c_str(), threads, RTC_VERSION_STRING,
                arguments.repeats);
    nlohmann::json report = {{"schema", 1},
                             {"renderer", context.renderer()},
                             {"threads", threads},
                             {"embree", RTC_VERSION_STRING},
                             {"embree_robust", arguments.robust},
                             {"repeats", arguments.repeats},
                             {"scenes", nlohmann::json::array()}};
    for (const std::string& file : arguments.scenes) {
        const bench::SceneResult result = measure_scene(arguments, file);
        std::fputs(bench::table(result).c_str(), stdout);
        std::fflush(stdout);
        report["scenes"].push_back(bench::json(result));
    }
    if (!arguments.json.empty()) write_file(arguments.json, report.dump(2) + '\n');
    return 0;
}

}  // namespace

int main(int argc, char** argv) {
    try {
        return run(argc, argv);
    } catch (const std::exception& error) {
        std::fprintf(stderr, "halflight-bench: %s\n", error.what());
        return 1;
    }
}
