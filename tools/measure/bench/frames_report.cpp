#include "tools/measure/bench/frames_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

namespace halflight::bench {
namespace {

constexpr std::size_t kSettled = 8;  // number of frames until times no longer change

std::vector<double> by(Clock clock, const std::vector<Seconds>& seconds) {
    std::vector<double> values;
    for (const Seconds& s : seconds) values.push_back(halflight::by(clock, s));
    return values;
}

/// Returns the values without the first ones, but always the last one.
std::vector<double> from(const std::vector<double>& values, std::size_t first) {
    return {values.begin() + static_cast<std::ptrdiff_t>(std::min(first, values.size() - 1)), values.end()};
}

std::string milliseconds(const std::vector<double>& values) {
    const Quartiles q = quartiles(values);
    return fmt::format("{0:.{3}f} {1:.{3}f}..{2:.{3}f}", 1e3 * q.median, 1e3 * q.lower, 1e3 * q.upper,
                       q.median < 0.1 ? 1 : 0);
}

std::string ratio(const std::vector<double>& mine, const std::vector<double>& theirs) {
    const Quartiles q = speedup(mine, theirs);
    return fmt::format("{:.2f} {:.2f}..{:.2f}", q.median, q.lower, q.upper);
}

/// Returns times of first, later and settled frames, and ratios of settled ones. values(series): seconds by frame.
template <class Values>
std::string rows(const std::vector<Series>& all, const Values& values) {
    std::string text = fmt::format("  {:10}{:>10}{:>20}{:>20}{:>16}{:>20}\n", "", "first ms", "later", "settled",
                                   "first/settled", "times as fast");
    const std::vector<double> base = values(all.front());
    for (const Series& series : all) {
        const std::vector<double> v = values(series);
        text += fmt::format("  {:10}{:>10.1f}{:>20}{:>20}{:>16.2f}{:>20}\n", series.variant, 1e3 * v.front(),
                            milliseconds(from(v, 1)), milliseconds(from(v, kSettled)),
                            v.front() / quartiles(from(v, kSettled)).median,
                            ratio(from(v, kSettled), from(base, kSettled)));
    }
    return text;
}

std::string tables(const std::string& title, const std::vector<Series>& all, Clock clock) {
    std::string text =
        fmt::format("  {}: whole frames, {}\n", title, clock == Clock::wall ? "wall-clock time" : "CPU time");
    text += rows(all, [&](const Series& s) { return by(clock, s.frames); });
    for (const auto& batch : all.front().batches) {
        text += fmt::format("  {}: {} rays\n", title, batch.first);
        text += rows(all, [&](const Series& s) { return by(clock, s.batches.at(batch.first)); });
    }
    for (const Series& series : all) {
        for (const rays::BatchStatistics& b : series.chosen) {
            if (b.state_bytes == 0) continue;
            text += fmt::format(
                "  {}: {} by {} ({}), {:.1f} % of lists made, {:.1f} MiB of state\n", series.variant, b.batch,
                rays::name(b.method), b.reason,
                b.tiles > 0 ? 100.0 * static_cast<double>(b.tiles_culled) / static_cast<double>(b.tiles) : 0,
                static_cast<double>(b.state_bytes) / 1048576.0);
        }
    }
    return text;
}

/// Returns the sum over the first `count` frames.
double sum(const std::vector<double>& values, int count) {
    double total = 0;
    for (int i = 0; i < count; ++i) total += values[static_cast<std::size_t>(i)];
    return total;
}

std::string error_table(const FrameReport& r, Clock clock) {
    std::string text = fmt::format("  relative MSE, from a picture of {} samples, against seconds\n  {:>7}{:>12}{:>12}",
                                   r.order.reference, "samples", "relMSE", "trimmed");
    for (const Series& series : r.result.still) text += fmt::format("{:>10}", series.variant);
    text += '\n';
    for (const ErrorPoint& point : r.result.errors) {
        text += fmt::format("  {:>7}{:>12.5f}{:>12.5f}", point.samples, point.relative_mse, point.trimmed_mse);
        for (const Series& series : r.result.still)
            text += fmt::format("{:>10.2f}", sum(by(clock, series.frames), point.samples));
        text += '\n';
    }
    return text;
}

nlohmann::json series_json(const std::vector<Series>& all, Clock clock) {
    nlohmann::json list = nlohmann::json::array();
    for (const Series& series : all) {
        const std::vector<double> mine = by(clock, series.frames), base = by(clock, all.front().frames);
        const Quartiles faster = speedup(from(mine, kSettled), from(base, kSettled));
        nlohmann::json by_batch = nlohmann::json::object();
        for (const auto& [batch, taken] : series.batches)
            by_batch[batch] = {{"seconds", by(Clock::wall, taken)}, {"cpu_seconds", by(Clock::cpu, taken)}};
        nlohmann::json chosen = nlohmann::json::array();
        for (const rays::BatchStatistics& b : series.chosen) {
            chosen.push_back({{"batch", b.batch},
                              {"method", rays::name(b.method)},
                              {"reason", b.reason},
                              {"tiles", b.tiles},
                              {"tiles_culled", b.tiles_culled},
                              {"state_bytes", b.state_bytes}});
        }
        list.push_back(
            {{"variant", series.variant},
             {"seconds", by(Clock::wall, series.frames)},
             {"cpu_seconds", by(Clock::cpu, series.frames)},
             {"ray_batches", by_batch},
             {"first_seconds", mine.front()},
             {"later_seconds", quartiles(from(mine, 1)).median},
             {"settled_seconds", quartiles(from(mine, kSettled)).median},
             {"settled_times_as_fast", {{"lower", faster.lower}, {"median", faster.median}, {"upper", faster.upper}}},
             {"chosen", chosen}});
    }
    return list;
}

}  // namespace

std::string table(const FrameReport& r, Clock clock) {
    std::string text = fmt::format("{}, camera {}, {}x{}, {} bounces\n", r.file, r.camera, r.order.size.x,
                                   r.order.size.y, r.order.bounces);
    text += tables("still", r.result.still, clock);
    if (!r.result.errors.empty()) text += error_table(r, clock);
    if (!r.result.moving.empty()) text += tables("moving", r.result.moving, clock);
    return text +
           fmt::format("  pixels that differ: {}{}\n", r.result.different, r.result.different > 0 ? " WRONG" : "");
}

nlohmann::json json(const FrameReport& r, Clock clock) {
    nlohmann::json errors = nlohmann::json::array();
    for (const ErrorPoint& point : r.result.errors) {
        nlohmann::json until = nlohmann::json::object();
        for (const Series& series : r.result.still)
            until[series.variant] = sum(by(clock, series.frames), point.samples);
        errors.push_back({{"samples", point.samples},
                          {"relative_mse", point.relative_mse},
                          {"trimmed_mse", point.trimmed_mse},
                          {"seconds", until}});
    }
    return {{"file", r.file},
            {"camera", r.camera},
            {"width", r.order.size.x},
            {"height", r.order.size.y},
            {"bounces", r.order.bounces},
            {"reference_samples", r.order.reference},
            {"still", series_json(r.result.still, clock)},
            {"moving", series_json(r.result.moving, clock)},
            {"errors", errors},
            {"pixels_that_differ", r.result.different}};
}

}  // namespace halflight::bench
