#include "tools/measure/bench/report.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>

namespace halflight::bench {
namespace {

/// A method that others are compared with, and the heading of the comparison.
struct Reference {
    const char* method;
    const char* title;
};
constexpr std::array kReferences{
    Reference{"plain", "times as fast as plain"}, Reference{"naive", "times as fast as naive"},
    Reference{"compute", "times as fast as compute"}, Reference{"embree", "times as fast as embree"},
    Reference{"ceiling", "share of the ceiling"}};

const std::vector<double>& times(const MethodResult& m, Clock clock) {
    return clock == Clock::wall ? m.seconds : m.cpu_seconds;
}

/// Returns millions of rays per second.
Quartiles rate(const KindResult& kind, const std::vector<double>& seconds) {
    std::vector<double> rates;
    for (const double s : seconds) rates.push_back(1e-6 * static_cast<double>(kind.live) / s);
    return quartiles(rates);
}

const MethodResult* find(const KindResult& kind, std::string_view method) {
    const auto found = std::ranges::find(kind.methods, method, &MethodResult::method);
    return found == kind.methods.end() ? nullptr : &*found;
}

constexpr int kKindWidth = 11, kCellWidth = 20;

std::string heading(const std::string& title, const KindResult& any) {
    std::string line = fmt::format("  {:{}}", "", kKindWidth);
    for (const MethodResult& m : any.methods) line += fmt::format("{:>{}}", m.method, kCellWidth);
    return "  " + title + '\n' + line + '\n';
}

template <class Cell>
std::string rows(const SceneResult& r, const Cell& cell) {
    std::string text;
    for (const KindResult& kind : r.kinds) {
        text += fmt::format("  {:{}}", kind.kind, kKindWidth);
        for (const MethodResult& m : kind.methods) text += fmt::format("{:>{}}", cell(kind, m), kCellWidth);
        text += '\n';
    }
    return text;
}

/// Returns a table with a row per kind for each method that has figures.
std::string figure_tables(const SceneResult& r, Clock clock) {
    std::string text;
    for (std::size_t m = 0; m < r.kinds.front().methods.size(); ++m) {
        const MethodResult& first = r.kinds.front().methods[m];
        if (first.figures.empty()) continue;
        text += fmt::format("  a run of {}\n  {:{}}{:>10}", first.method, "", kKindWidth, "ms");
        for (const Figure& figure : first.figures) text += fmt::format("{:>10}", figure.name);
        text += '\n';
        for (const KindResult& kind : r.kinds) {
            text += fmt::format("  {:{}}{:>10.1f}", kind.kind, kKindWidth,
                                1e3 * quartiles(times(kind.methods[m], clock)).median);
            for (const Figure& figure : kind.methods[m].figures)
                text += fmt::format("{:>10.{}f}", figure.value, figure.value < 1000 ? 1 : 0);
            text += '\n';
        }
    }
    return text;
}

nlohmann::json quartiles_json(const Quartiles& q) {
    return {{"lower", q.lower}, {"median", q.median}, {"upper", q.upper}};
}

nlohmann::json method_json(const KindResult& kind, const MethodResult& m, Clock clock) {
    nlohmann::json ratios = nlohmann::json::object();
    for (const Reference& reference : kReferences) {
        if (const MethodResult* other = find(kind, reference.method))
            ratios[reference.method] = quartiles_json(speedup(times(m, clock), times(*other, clock)));
    }
    nlohmann::json figures = nlohmann::json::object();
    for (const Figure& figure : m.figures) figures[figure.name] = figure.value;
    return {{"mrays_per_second", quartiles_json(rate(kind, times(m, clock)))},
            {"times_as_fast_as", ratios},
            {"exact", m.exact},
            {"rays_that_differ", m.different},
            {"note", m.note},
            {"figures", figures},
            {"seconds", m.seconds},
            {"cpu_seconds", m.cpu_seconds}};
}

const char* name(rays::NodeFormat format) {
    return format == rays::NodeFormat::grid ? "grid" : "float";
}

}  // namespace

std::size_t SceneResult::disagreements() const {
    std::size_t sum = 0;
    for (const KindResult& kind : kinds)
        for (const MethodResult& m : kind.methods) sum += m.exact ? m.different : 0;
    return sum;
}

std::string table(const SceneResult& r, Clock clock) {
    const rays::TraceStatistics& s = r.statistics;
    std::string text = fmt::format("{}, camera {}, {}x{}: {} triangles, {} instances\n", r.file, r.camera, r.size.x,
                                   r.size.y, s.triangles, s.instances);
    text += fmt::format("  {} nodes ({}), stack of {}, {:.1f} MiB, built in {:.2f} s (Embree's own: {:.2f} s)\n",
                        s.nodes, name(s.node_format), s.stack_entries, static_cast<double>(s.bytes) / 1048576.0,
                        s.build_seconds, r.embree_build_seconds);
    for (const std::string& line : r.left_out) text += "  left out: " + line + '\n';
    if (r.kinds.empty()) return text;

    text += heading(fmt::format("Mrays/s, {}", clock == Clock::wall ? "wall-clock time" : "CPU time"), r.kinds.front());
    text += rows(r, [&](const KindResult& kind, const MethodResult& m) {
        return fmt::format("{:.2f}", rate(kind, times(m, clock)).median);
    });
    for (const Reference& reference : kReferences) {
        if (!find(r.kinds.front(), reference.method)) continue;
        text += heading(reference.title, r.kinds.front());
        text += rows(r, [&](const KindResult& kind, const MethodResult& m) -> std::string {
            if (m.method == reference.method) return "-";
            const Quartiles q = speedup(times(m, clock), times(*find(kind, reference.method), clock));
            return fmt::format("{:.2f} {:.2f}..{:.2f}", q.median, q.lower, q.upper);
        });
    }
    text += figure_tables(r, clock);
    text += heading("rays that differ from plain's", r.kinds.front());
    text += rows(r, [&](const KindResult&, const MethodResult& m) {
        return fmt::format("{}{}", m.different, m.exact && m.different > 0 ? " WRONG" : "");
    });
    text += "  rays\n";
    for (const KindResult& kind : r.kinds) {
        text += fmt::format("  {:{}}{:9} live of {:9}, {:5.1f} % hit", kind.kind, kKindWidth, kind.live, kind.listed,
                            100.0 * static_cast<double>(kind.hits) / static_cast<double>(kind.live));
        for (const MethodResult& m : kind.methods)
            if (!m.note.empty()) text += fmt::format("; {}: {}", m.method, m.note);
        text += '\n';
    }
    return text;
}

nlohmann::json json(const SceneResult& r, Clock clock) {
    const rays::TraceStatistics& s = r.statistics;
    nlohmann::json kinds = nlohmann::json::array();
    for (const KindResult& k : r.kinds) {
        nlohmann::json methods = nlohmann::json::object();
        for (const MethodResult& m : k.methods) methods[m.method] = method_json(k, m, clock);
        kinds.push_back({{"kind", k.kind},
                         {"any_hit", k.any_hit},
                         {"rays", k.listed},
                         {"live_rays", k.live},
                         {"hits", k.hits},
                         {"methods", methods}});
    }
    return {{"file", r.file},
            {"camera", r.camera},
            {"width", r.size.x},
            {"height", r.size.y},
            {"triangles", s.triangles},
            {"instances", s.instances},
            {"nodes", s.nodes},
            {"node_format", name(s.node_format)},
            {"two_level", s.two_level},
            {"stack_entries", s.stack_entries},
            {"bytes", s.bytes},
            {"build_seconds", s.build_seconds},
            {"embree_build_seconds", r.embree_build_seconds},
            {"left_out", r.left_out},
            {"rays_that_disagree", r.disagreements()},
            {"kinds", kinds}};
}

}  // namespace halflight::bench
