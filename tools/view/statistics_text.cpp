#include "tools/view/statistics_text.h"

#include <fmt/format.h>

#include <algorithm>

#include "api/halflight/statistics.h"

namespace halflight::view {
namespace {

double share(std::uint64_t part, std::uint64_t whole) {
    return whole == 0 ? 0.0 : static_cast<double>(part) / static_cast<double>(whole);
}

double mebibytes(std::size_t bytes) {
    return static_cast<double>(bytes) / (1 << 20);
}

void add_tiles(const rays::BatchStatistics& b, std::vector<std::string>& lines) {
    const rays::BatchStatistics::Lists& l = b.lists;
    if (l.tiles == 0) return;
    lines.push_back(fmt::format("  {:.1f} pairs per tile, {:.1f} leaves; maximum {}", share(l.entries, l.tiles),
                                share(l.leaves, l.tiles), l.longest));
    lines.push_back(fmt::format("  state hits: {:.0f} % of lists, {:.0f} % of rays by leaf",
                                100 * (1 - std::min(share(b.tiles_culled, l.tiles), 1.0)),
                                100 * share(l.remembered, l.rays)));
    lines.push_back(fmt::format("  {:.0f} % of rays beyond the leaves", 100 * share(l.rest_rays, l.rays)));
}

void add_raster(const rays::RasterBatch& batch, std::vector<std::string>& lines) {
    const rays::RasterStatistics& s = batch.statistics;
    if (s.runs == 0) return;
    const auto runs = static_cast<double>(s.runs);
    lines.push_back(fmt::format("{} {}, occlusion queries per run:", rays::name(batch.kind), batch.depth));
    lines.push_back(fmt::format("  {:.0f} queries, {:.0f} for several nodes", static_cast<double>(s.queries) / runs,
                                static_cast<double>(s.multi_queries) / runs));
    lines.push_back(fmt::format("  state hits: {:.0f} hidden, {:.0f} visible nodes not queried",
                                static_cast<double>(s.saved_hidden) / runs,
                                static_cast<double>(s.saved_visible) / runs));
    lines.push_back(fmt::format("  {:.0f} nodes tested, {:.0f} leaves hit, {:.0f} pairs",
                                static_cast<double>(s.nodes) / runs, static_cast<double>(s.leaves) / runs,
                                static_cast<double>(s.pairs) / runs));
}

}  // namespace

std::vector<std::string> culling_lines(const RenderStats& stats) {
    std::vector<std::string> lines;
    for (const rays::BatchStatistics& b : stats.batches) {
        lines.push_back(fmt::format("{}: {}{}", b.batch, rays::name(b.method),
                                    b.reason.empty() ? "" : fmt::format(" ({})", b.reason)));
        add_tiles(b, lines);
        if (b.state_bytes > 0) lines.push_back(fmt::format("  {:.1f} MiB of state", mebibytes(b.state_bytes)));
    }
    for (const rays::RasterBatch& batch : stats.raster) add_raster(batch, lines);
    return lines;
}

std::vector<std::string> paging_lines(const RenderStats& stats) {
    if (!stats.paging) return {};
    const paging::PagingStatistics& t = stats.paging->tracing;
    return {fmt::format("{} pages, {} fit into the pool", t.pages, t.slots),
            fmt::format("{} loaded ({:.1f} MiB in {:.2f} s), {} left", t.traffic.loaded, mebibytes(t.traffic.bytes),
                        t.traffic.seconds, t.traffic.evicted),
            fmt::format("{} batches in {} rounds", t.batches, t.rounds),
            fmt::format("{} table rows in {:.2f} s", stats.paging->rows, stats.paging->row_seconds)};
}

std::vector<std::string> left_out_lines(const RenderStats& stats) {
    std::vector<std::string> lines;
    for (const LeftOut& l : stats.left_out)
        lines.push_back(fmt::format("{}: {}{}", l.what, l.fact,
                                    l.bytes == 0 ? "" : fmt::format(" ({:.1f} MiB)", mebibytes(l.bytes))));
    return lines;
}

std::vector<MemoryRow> memory_rows(const RenderStats& stats) {
    std::size_t saved = 0;
    for (const LeftOut& l : stats.left_out) saved += l.bytes;
    const MemoryLedger& ledger = MemoryLedger::process();
    return {{"Device", fmt::format("{:.1f} MiB", mebibytes(stats.gpu_bytes)), "buffers of the picture and the scene"},
            {"Left out", fmt::format("{:.1f} MiB", mebibytes(saved)), "buffers that the scene does not need"},
            {"Program, peak", fmt::format("{:.1f} MiB", mebibytes(peak_memory_bytes())), "most memory so far"},
            {"Budget left", fmt::format("{} of {}", text_of_bytes(ledger.free()), text_of_bytes(ledger.limit())),
             "memory that scenes may still take"}};
}

}  // namespace halflight::view
