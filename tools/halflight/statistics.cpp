#include "tools/halflight/statistics.h"

#include <sys/resource.h>

#include <algorithm>

#include "tools/halflight/facts.h"

namespace halflight {
namespace {

using Json = nlohmann::ordered_json;

std::uint64_t peak_memory_bytes() {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    return static_cast<std::uint64_t>(usage.ru_maxrss) * 1024;  // getrusage(2): kilobytes
}

std::string environment_name(const Environment& environment) {
    if (environment.black()) return "none";
    const vec3 c = environment.color;
    return environment.map.width > 0 ? environment.name : fmt::format("{} {},{},{}", environment.name, c.x, c.y, c.z);
}

Json batch_statistics(const rays::BatchStatistics& b) {
    Json ways = Json::object();
    for (std::size_t i = 0; i < rays::kWays; ++i) {
        const auto& m = b.measured[i];
        if (m.runs > 0) {
            ways[rays::name(static_cast<rays::Way>(i))] = {
                {"runs", m.runs}, {"seconds", m.seconds}, {"fastest_run_seconds", m.best}};
        }
    }
    return {{"batch", b.batch},
            {"way", rays::name(b.way)},
            {"reason", b.reason},
            {"ways", ways},
            {"tiles", b.tiles},
            {"tile_lists_made", b.tiles_culled},
            {"tile_lists_kept", b.tiles - std::min(b.tiles, b.tiles_culled)},
            {"state_bytes", b.state_bytes}};
}

}  // namespace

std::string settings_line(const RenderArguments& a, const RenderSettings& s, const Scene& scene, int samples_done) {
    std::string line = fmt::format("scene {}, {} x {}, {} samples, {} bounces, seed {}, frame {}, environment {}",
                                   a.scene.filename().string(), s.width, s.height, samples_done, s.bounces, s.seed,
                                   s.frame, environment_name(scene.environment));
    if (!s.camera.name.empty()) line += fmt::format(", camera {}", s.camera.name);
    return line;
}

Json run_statistics(const RenderArguments& a, const RenderSettings& s, const Scene& scene, const gpu::Context& context,
                    const RenderStats& stats, const StepTimes& times) {
    Json passes = Json::array();
    for (const PassTime& pass : stats.passes)
        passes.push_back({{"name", pass.name}, {"runs", pass.runs}, {"seconds", pass.seconds}});
    Json non_finite = Json::object();
    for (const NonFiniteCount& count : stats.non_finite) non_finite[count.component] = count.values;
    Json batches = Json::array();
    for (const rays::BatchStatistics& b : stats.batches) batches.push_back(batch_statistics(b));
    Json outputs = Json::array();
    for (const auto& path : a.outputs) outputs.push_back(path.string());

    return {
        {"version", HALFLIGHT_VERSION},
        {"scene", {{"file", a.scene.string()}, {"environment", environment_name(scene.environment)}}},
        {"counts", scene_counts(scene)},
        {"settings",
         {{"width", s.width},
          {"height", s.height},
          {"camera", s.camera.name},
          {"bounces", s.bounces},
          {"culling", rays::name(s.culling)},
          {"seed", s.seed},
          {"frame", s.frame},
          {"aovs", s.aovs}}},
        {"device",
         {{"renderer", context.renderer()},
          {"version", context.version()},
          {"software", context.software()},
          {"errors", context.error_count()}}},
        {"samples", stats.samples},
        {"paths", stats.paths},
        {"paths_per_second", static_cast<double>(stats.paths) / std::max(stats.render_seconds, 1e-9)},
        {"gpu_bytes", stats.gpu_bytes},
        {"peak_memory_bytes", peak_memory_bytes()},
        {"seconds",
         {{"total", times.total},
          {"load", times.load},
          {"context", times.context},
          {"prepare", stats.prepare_seconds},
          {"compile", stats.compile_seconds},
          {"render", stats.render_seconds},
          {"finish",
           std::max(0.0, times.render - stats.prepare_seconds - stats.compile_seconds - stats.render_seconds)},
          {"write", times.write}}},
        {"passes", passes},
        {"ray_batches", batches},
        {"left_out", stats.left_out},
        {"non_finite", non_finite},
        {"outputs", outputs},
    };
}

}  // namespace halflight
