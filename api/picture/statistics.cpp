#include "api/halflight/statistics.h"

#include <fmt/format.h>

#include <sys/resource.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "api/halflight/loaded_scene.h"
#include "api/scene/facts.h"
#include "api/sequence/source_hash.h"

#include "engine/core/metrics.h"
#include "engine/core/names.h"
#include "engine/core/statistics.h"

namespace halflight {
namespace {

using Json = nlohmann::ordered_json;

double ratio(std::uint64_t part, std::uint64_t whole) {
    return whole == 0 ? 0.0 : static_cast<double>(part) / static_cast<double>(whole);
}

Json paging_json(const RenderStats::Paging& p) {
    const paging::PagingStatistics& t = p.tracing;
    return {{"pages", t.pages},
            {"slots", t.slots},
            {"loaded", t.traffic.loaded},
            {"loaded_moving", t.traffic.moving},
            {"loaded_bytes", t.traffic.bytes},
            {"evicted", t.traffic.evicted},
            {"seconds", t.traffic.seconds},
            {"batches", t.batches},
            {"rounds", t.rounds},
            {"rays_again", t.again},
            {"prefetched_used", t.prefetched_used},
            {"prefetched_unused", t.prefetched_unused},
            {"queries", t.queries},
            {"query_seconds", t.query_seconds},
            {"rows", p.rows},
            {"row_seconds", p.row_seconds}};
}

Json textures_json(const paging::TileStatistics& t) {
    return {{"tiles", t.tiles},      {"slots", t.slots},     {"loaded", t.loaded},   {"loaded_bytes", t.bytes},
            {"evicted", t.evicted},  {"seconds", t.seconds}, {"batches", t.batches}, {"rounds", t.rounds},
            {"hits_again", t.again}, {"splits", t.splits}};
}

Json batch_statistics(const rays::BatchStatistics& b) {
    Json methods = Json::object();
    for (std::size_t i = 0; i < rays::kTraceMethods; ++i) {
        const auto& m = b.measured[i];
        if (m.runs > 0) {
            methods[rays::name(static_cast<rays::TraceMethod>(i))] = {
                {"runs", m.runs}, {"rays", m.rays}, {"seconds", m.seconds}, {"fastest_run_seconds", m.best}};
        }
    }
    Json json{{"batch", b.batch}, {"next_method", rays::name(b.method)}, {"reason", b.reason}, {"methods", methods}};
    const auto& plain = b.measured[static_cast<std::size_t>(rays::TraceMethod::plain)];
    const auto& tiles = b.measured[static_cast<std::size_t>(rays::TraceMethod::tiles)];
    if (plain.runs > 0 && tiles.runs > 0) json["speed_of_tiles_to_plain"] = plain.best / std::max(tiles.best, 1e-9);
    if (tiles.runs > 0) {
        const rays::BatchStatistics::Lists& l = b.lists;
        json["tile_lists"] = {{"seconds", {{"cull", b.steps.cull}, {"search", b.steps.search}, {"rest", b.steps.rest}}},
                              {"wanted", l.tiles},
                              {"made", b.tiles_culled},
                              {"kept", l.tiles - std::min(l.tiles, b.tiles_culled)},
                              {"mean_entries", ratio(l.entries, l.tiles)},
                              {"mean_leaves", ratio(l.leaves, l.tiles)},
                              {"most_entries", l.longest},
                              {"share_of_rays_beyond_leaves", ratio(l.rest_rays, l.rays)},
                              {"share_of_rays_ended_by_remembered_leaves", ratio(l.remembered, l.rays)}};
    }
    if (const double rays = b.native_alone.rays + b.native_together.rays; rays > 0) {
        const auto pace = [](const auto& tasks) { return tasks.seconds > 0 ? tasks.rays / tasks.seconds : 0; };
        json["native"] = {{"rays", rays},
                          {"share_of_rays_together", b.native_together.rays / rays},
                          {"rays_per_second_together", pace(b.native_together)},
                          {"rays_per_second_in_turns", pace(b.native_alone)}};
    }
    json["state_bytes"] = b.state_bytes;
    return json;
}

Json raster_statistics(const rays::RasterBatch& batch) {
    const rays::RasterStatistics& s = batch.statistics;
    return {{"kind", rays::name(batch.kind)},
            {"depth", batch.depth},
            {"runs", s.runs},
            {"queries_issued", s.queries},
            {"multi_queries", s.multi_queries},
            {"queries_saved_hidden", s.saved_hidden},
            {"queries_saved_visible", s.saved_visible},
            {"waits", s.waits},
            {"nodes_visited", s.nodes},
            {"leaves_traced", s.leaves},
            {"draws", s.traces},
            {"tile_node_pairs", s.pairs},
            {"seconds", s.seconds},
            {"seconds_of_all_threads",
             {{"bounds", s.stages.bounds},
              {"ask", s.stages.ask},
              {"mark", s.stages.mark},
              {"trace", s.stages.trace},
              {"end", s.stages.end}}}};
}

}  // namespace

nlohmann::ordered_json memory_json(const MemoryLedger& ledger) {
    Json parts;
    for (const MemoryPart part : first_enumerators<MemoryPart, kMemoryParts>()) parts[name(part)] = ledger.bytes(part);
    return {{"limit_bytes", ledger.limit()}, {"free_bytes", ledger.free()}, {"part_bytes", parts}};
}

std::uint64_t peak_memory_bytes() {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    return static_cast<std::uint64_t>(usage.ru_maxrss) * 1024;  // getrusage(2) counts kilobytes
}

std::string environment_name(const Environment& environment) {
    if (environment.black()) return "none";
    const vec3 c = environment.color;
    return environment.map.width > 0 ? environment.name : fmt::format("{} {},{},{}", environment.name, c.x, c.y, c.z);
}

std::string lens_text(const Camera& camera, const Lens& lens, const ivec2& image) {
    if (!lens.blurs()) return "";
    Camera with = camera;
    with.lens = lens;
    std::string words = lens.aperture > 0 ? "" : fmt::format("f/{:g}, ", lens.fstop);
    words +=
        fmt::format("aperture {:.4g} mm, focus at ", 2000 * aperture_radius(with, eye_aspect(camera.optics, image)));
    words += std::isinf(lens.focus.distance) ? "infinity" : fmt::format("{:.6g} m", lens.focus.distance);
    if (lens.blades > 0) words += fmt::format(", {} blades", lens.blades);
    if (lens.blades > 0 && lens.rotation != 0) words += fmt::format(" turned by {:g} degrees", lens.rotation);
    return words;
}

std::string settings_line(const FrameRenderer& renderer, const RenderStats& stats) {
    const RenderSettings& s = renderer.settings();
    const LoadedScene& scene = renderer.scene();
    std::string line = fmt::format(
        "scene {}, {} x {}, {} samples, {} bounces, seed {}, frame {}, filter {}, environment {}, estimator {}, "
        "primary {}",
        scene.choice().scene.filename().string(), s.width, s.height, stats.samples, bounces_of(s), s.seed, s.frame,
        text(s.filter), environment_name(scene.scene().environment), text(stats.estimator), name(stats.primary));
    if (has_window(s)) {
        const PixelWindow window = data_window(s);
        line += fmt::format(", pixels {},{} to {},{}", window.first.x, window.first.y, window.end.x, window.end.y);
    }
    if (s.backfaces != Backfaces::automatic) line += fmt::format(", back faces {}", name(s.backfaces));
    if (s.camera.optics.traced()) line += ", " + text(s.camera.optics);
    if (s.transparent) line += ", transparent";
    if (s.show_lamps) line += ", lamps shown";
    if (s.adaptive) line += ", adaptive";
    if (s.preview.any()) line += fmt::format(", preview {}", text(s.preview));
    if (!s.camera.name.empty()) line += fmt::format(", camera {}", s.camera.name);
    return s.denoise ? line + denoised_text(neighbour_frames(s)) : line;
}

std::string denoised_text(int frames) {
    return frames > 0 ? fmt::format(", denoised with {} frames before and after", frames) : ", denoised";
}

std::string describe_bad_values(const RenderStats& stats) {
    std::string text;
    for (const BadValues& bad : stats.bad_values) {
        if (bad.total() == 0) continue;
        text += fmt::format("{}{} gave {} NaN, {} infinite and {} negative values", text.empty() ? "" : "; ",
                            bad.component, bad.nans, bad.infinities, bad.negatives);
    }
    return text;
}

std::string error_line(const DenoisedError& error) {
    const ErrorEstimate& e = error.estimate;
    return fmt::format("denoised picture: estimated {} {:.4g}, {:.4g} to {:.4g} at {:g} %, from {} other samples",
                       name(error.metric), e.value, e.lower, e.upper, 100 * kConfidence, 2 * error.samples);
}

std::string error_line(const AchievedError& error) {
    const ErrorEstimate& e = error.estimate;
    return fmt::format("{} {:.4g}, {:.4g} to {:.4g} at {:g} %, target {:g} {}", name(error.target.metric), e.value,
                       e.lower, e.upper, 100 * kConfidence, error.target.error,
                       error.reached ? "reached" : "not reached");
}

Json run_statistics(const FrameRenderer& renderer, const RenderStats& stats, const StepTimes& times,
                    const std::vector<std::filesystem::path>& files) {
    const RenderSettings& s = renderer.settings();
    const Shutter& shutter = renderer.shutter();
    const LoadedScene& scene = renderer.scene();
    const gpu::Context& context = renderer.context();
    Json passes = Json::array();
    for (const PassTime& pass : stats.passes)
        passes.push_back({{"name", pass.name}, {"runs", pass.runs}, {"seconds", pass.seconds}});
    Json bad_values = Json::object();
    for (const BadValues& bad : stats.bad_values)
        bad_values[bad.component] = {{"nan", bad.nans}, {"infinite", bad.infinities}, {"negative", bad.negatives}};
    Json batches = Json::array();
    for (const rays::BatchStatistics& b : stats.batches) batches.push_back(batch_statistics(b));
    Json raster = Json::array();
    for (const rays::RasterBatch& batch : stats.raster) raster.push_back(raster_statistics(batch));
    Json radiance_cache;
    if (const auto& c = stats.radiance_cache)
        radiance_cache = {{"cells", c->cells}, {"used", c->used}, {"mature", c->mature}, {"refused", c->refused}};
    Json deformed_json;
    if (const auto& d = renderer.deformed())
        deformed_json = {{"vertices", d->vertices}, {"vertices_on_cpu", d->vertices_on_cpu}, {"seconds", d->seconds}};
    Json neighbours;
    if (const auto& n = stats.neighbours)
        neighbours = {{"frames", n->frames}, {"rendered_frames", n->rendered}, {"seconds", n->seconds}};
    Json error;
    if (const auto& e = stats.error) {
        error = {{"metric", name(e->target.metric)}, {"relmse_epsilon", kRelativeEpsilon}, {"value", e->estimate.value},
                 {"lower", e->estimate.lower},       {"upper", e->estimate.upper},         {"bound", e->estimate.bound},
                 {"confidence", kConfidence},        {"target", e->target.error},          {"reached", e->reached}};
    }
    Json denoised_error;
    if (const auto& e = stats.denoised_error) {
        denoised_error = {{"metric", name(e->metric)},          {"relmse_epsilon", kRelativeEpsilon},
                          {"value", e->estimate.value},         {"lower", e->estimate.lower},
                          {"upper", e->estimate.upper},         {"confidence", kConfidence},
                          {"held_out_samples", 2 * e->samples}, {"seconds", e->seconds}};
    }
    Json outputs = Json::array();
    for (const auto& path : files) outputs.push_back(path.string());

    return {
        {"version", HALFLIGHT_VERSION},
        {"sources", source_hash()},
        {"scene",
         {{"file", scene.choice().scene.string()}, {"environment", environment_name(scene.scene().environment)}}},
        {"counts", scene_counts(scene.scene(), scene.size())},
        {"settings",
         {{"width", s.width},
          {"height", s.height},
          {"data_window", {data_window(s).first.x, data_window(s).first.y, data_window(s).end.x, data_window(s).end.y}},
          {"transparent", s.transparent},
          {"show_lamps", s.show_lamps},
          {"camera", s.camera.name},
          {"bounces", bounces_of(s)},
          {"exposure", s.want_view ? Json(s.view.stops()) : Json()},
          {"filter", {{"shape", name(s.filter.shape)}, {"radius", s.filter.radius}}},
          {"shutter", shutter.open > 0 ? Json{{"open", shutter.open},
                                              {"times", shutter_times(shutter, renderer.scene(), s, s.samples)}}
                                       : Json()},
          {"lens", !stats.lens.blurs() ? Json() : Json(lens_text(s.camera, stats.lens, {s.width, s.height}))},
          {"projection", s.camera.optics.traced() ? Json(text(s.camera.optics)) : Json()},
          {"clamp", s.clamp > 0 ? Json(s.clamp) : Json()},
          {"culling", rays::name(s.culling)},
          {"primary", name(stats.primary)},
          {"backfaces", name(s.backfaces)},
          {"kept", s.kept.text()},
          {"estimator", text(stats.estimator)},
          {"asked_estimator", text(s.estimator)},
          {"adaptive", s.adaptive},
          {"denoise", s.denoise},
          {"denoise_frames", neighbour_frames(s)},
          {"preview", text(s.preview)},
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
        {"error", error},
        {"denoised_error", denoised_error},
        {"biases", stats.biases},
        {"gpu_bytes", stats.gpu_bytes},
        {"memory", memory_json(MemoryLedger::process())},
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
        {"radiance_cache", radiance_cache},
        {"deformed", deformed_json},
        {"denoise_neighbours", neighbours},
        {"hierarchies",
         {{"kept", stats.hierarchies.kept},
          {"refitted", stats.hierarchies.refitted},
          {"built", stats.hierarchies.built}}},
        {"paging", stats.paging ? paging_json(*stats.paging) : Json()},
        {"textures", stats.textures ? textures_json(*stats.textures) : Json()},
        {"passes", passes},
        {"ray_batches", batches},
        {"raster_culling", raster},
        {"left_out", left_out_json(stats.left_out)},
        {"bad_values", bad_values},
        {"outputs", outputs},
    };
}

}  // namespace halflight
