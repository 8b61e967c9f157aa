#include "tools/bench/report.h"

#include <fmt/format.h>

#include "engine/core/statistics.h"

namespace halflight::bench {
namespace {

double mrays(std::size_t rays, const std::vector<double>& seconds) {
    return static_cast<double>(rays) / median(seconds) * 1e-6;
}
double spread(const std::vector<double>& seconds) {
    return 0.5 * (quantile(seconds, 0.75) - quantile(seconds, 0.25)) / median(seconds);
}
double ratio(const std::vector<double>& mine, const std::vector<double>& theirs) {
    return median(mine) / median(theirs);
}

nlohmann::json times_json(std::size_t rays, const Times& times) {
    return {{"mrays_per_second", mrays(rays, times.seconds)},
            {"spread", spread(times.seconds)},
            {"mrays_per_cpu_second", mrays(rays, times.cpu_seconds)},
            {"seconds", times.seconds},
            {"cpu_seconds", times.cpu_seconds}};
}

}  // namespace

std::string table(const SceneResult& r) {
    const rays::TraceStatistics& s = r.statistics;
    std::string text =
        fmt::format("{}: {} triangles, {} instances, {}x{}\n", r.file, s.triangles, s.instances, r.width, r.height);
    text += fmt::format("  {} nodes ({}), stack of {}, {:.1f} MiB, built in {:.2f} s (Embree's own: {:.2f} s)\n",
                        s.nodes, s.node_format == rays::NodeFormat::grid ? "grid" : "float", s.stack_entries,
                        static_cast<double>(s.bytes) / 1048576.0, s.build_seconds, r.embree_build_seconds);
    text += "            plain Mray/s  spread   Embree Mray/s  spread   Embree is faster by  in CPU time   differ\n";
    for (const KindResult& k : r.kinds) {
        text +=
            fmt::format("  {:8}  {:12.2f}  {:5.1f}%  {:14.2f}  {:5.1f}%  {:20.2f}  {:11.2f}  {:7}\n", k.kind,
                        mrays(k.live, k.plain.seconds), 100 * spread(k.plain.seconds), mrays(k.live, k.embree.seconds),
                        100 * spread(k.embree.seconds), ratio(k.plain.seconds, k.embree.seconds),
                        ratio(k.plain.cpu_seconds, k.embree.cpu_seconds), k.different);
    }
    return text;
}

nlohmann::json json(const SceneResult& r) {
    const rays::TraceStatistics& s = r.statistics;
    nlohmann::json kinds = nlohmann::json::array();
    for (const KindResult& k : r.kinds) {
        kinds.push_back({{"kind", k.kind},
                         {"live_rays", k.live},
                         {"plain", times_json(k.live, k.plain)},
                         {"embree", times_json(k.live, k.embree)},
                         {"embree_faster_by", ratio(k.plain.seconds, k.embree.seconds)},
                         {"embree_faster_by_cpu", ratio(k.plain.cpu_seconds, k.embree.cpu_seconds)},
                         {"rays_that_differ", k.different}});
    }
    return {{"file", r.file},
            {"width", r.width},
            {"height", r.height},
            {"triangles", s.triangles},
            {"instances", s.instances},
            {"nodes", s.nodes},
            {"node_format", s.node_format == rays::NodeFormat::grid ? "grid" : "float"},
            {"two_level", s.two_level},
            {"stack_entries", s.stack_entries},
            {"bytes", s.bytes},
            {"build_seconds", s.build_seconds},
            {"embree_build_seconds", r.embree_build_seconds},
            {"kinds", kinds}};
}

}  // namespace halflight::bench
