#include "tools/measure/compare/report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "engine/core/error.h"
#include "engine/core/image_tools.h"
#include "engine/core/memory_ledger.h"
#include "engine/core/metrics.h"
#include "engine/core/statistics.h"
#include "engine/io/exr.h"
#include "engine/io/files.h"
#include "engine/io/png.h"
#include "tools/common/color_map.h"

namespace halflight::compare {
namespace {

using Json = nlohmann::ordered_json;

const MetricResult* find(const LayerResult& layer, Metric metric) {
    const auto found = std::ranges::find(layer.metrics, metric, &MetricResult::metric);
    return found == layer.metrics.end() ? nullptr : &*found;
}

std::string percent(double part, double whole) {
    return part == 0 ? "0 %" : fmt::format("{:.3g} %", 100 * part / whole);
}

/// Returns one line for each cause of a layer's warning or failure.
std::string reasons(const LayerResult& layer, const CompareArguments& a) {
    std::string lines;
    const auto line = [&](Verdict verdict, const std::string& what) {
        lines += fmt::format("{}: {}: {}\n", name(verdict), layer.name, what);
    };
    if (layer.kind == LayerKind::ids && layer.different > 0) line(Verdict::fail, "ids differ");
    if (!layer.not_finite_alike) line(Verdict::fail, "NaN or infinities in one that are not in the other");
    if (!a.warn.any() && !a.fail.any()) {
        if (layer.kind != LayerKind::ids && layer.different > 0) line(Verdict::fail, "differs");
        return lines;
    }
    for (const MetricResult& m : layer.metrics) {
        if (m.verdict == Verdict::same) continue;
        const double allowed = (m.verdict == Verdict::fail ? a.fail : a.warn).at(m.metric).value_or(0);
        line(m.verdict, fmt::format("{} {:.6g} is above {:.6g}", name(m.metric), m.value, allowed));
    }
    return lines;
}

/// Returns the verdict in words, which table and JSON share. different: something differs.
std::string in_words(Verdict verdict, bool different) {
    return verdict == Verdict::same && different ? "within the thresholds" : name(verdict);
}

bool differs(const Comparison& result) {
    return std::ranges::any_of(result.layers, [](const LayerResult& layer) { return layer.different > 0; });
}

}  // namespace

std::string table(const Comparison& result, const CompareArguments& a, const PictureFile& image) {
    std::size_t widest = 5;
    for (const LayerResult& layer : result.layers) widest = std::max(widest, layer.name.size());
    std::string text = fmt::format("{} against {}, {} x {}\n\n{:<{}}", a.image.string(), a.reference.string(),
                                   image.width, image.height, "layer", widest);
    for (const Metric metric : a.metrics) text += fmt::format("  {:>10}", name(metric));
    const std::string worst = fmt::format("{} of worst 0.1 %", name(a.metrics.front()));
    text += fmt::format("  {}  different  not finite\n", worst);
    for (const LayerResult& layer : result.layers) {
        text += fmt::format("{:<{}}", layer.name, widest);
        for (const Metric metric : a.metrics) {
            const MetricResult* m = find(layer, metric);
            text += fmt::format("  {:>10}", m ? fmt::format("{:.4g}", m->value) : "-");
        }
        const MetricResult* first = find(layer, a.metrics.front());
        const std::string not_finite = layer.not_finite[0] + layer.not_finite[1] == 0
                                           ? "-"
                                           : fmt::format("{} / {}", layer.not_finite[0], layer.not_finite[1]);
        text +=
            fmt::format("  {:>{}}  {:>9}  {:>10}\n", first ? percent(first->worst_share, 1) : "-", worst.size(),
                        percent(static_cast<double>(layer.different), static_cast<double>(layer.pixels)), not_finite);
    }
    text += "\n";
    for (const int side : {0, 1}) {
        if (result.missing[side].empty()) continue;
        text += fmt::format("{}: missing in {}: {}\n", name(Verdict::fail), (side ? a.reference : a.image).string(),
                            fmt::join(result.missing[side], ", "));
    }
    for (const LayerResult& layer : result.layers) text += reasons(layer, a);
    if (result.verdict == Verdict::same) text += in_words(result.verdict, differs(result)) + "\n";
    return text;
}

Json json(const Comparison& result, const CompareArguments& a, const PictureFile& image, const PictureFile& reference,
          const std::string& windows) {
    const auto corners = [](const PictureFile& file) {
        const ivec2 first = file.own.origin, end = first + file.own.size;
        return Json::array({first.x, first.y, end.x, end.y});
    };
    Json layers = Json::array();
    for (const LayerResult& layer : result.layers) {
        Json metrics = Json::object();
        for (const MetricResult& m : layer.metrics) {
            metrics[name(m.metric)] = {{"value", m.value},
                                       {"share_of_worst_thousandth", m.worst_share},
                                       {"verdict", in_words(m.verdict, m.value != 0)}};
        }
        layers.push_back({{"layer", layer.name},
                          {"metrics", metrics},
                          {"pixels", layer.pixels},
                          {"different_pixels", layer.different},
                          {"not_finite_pixels", {layer.not_finite[0], layer.not_finite[1]}},
                          {"not_finite_alike", layer.not_finite_alike},
                          {"verdict", in_words(layer.verdict, layer.different > 0)}});
    }
    return {{"schema", 1},
            {"image", a.image.string()},
            {"reference", a.reference.string()},
            {"width", image.width},
            {"height", image.height},
            {"windows", {{"image", corners(image)}, {"reference", corners(reference)}, {"differences", windows}}},
            {"relmse_epsilon", kRelativeEpsilon},
            {"pixels_per_degree", a.pixels_per_degree},
            {"layers", layers},
            {"missing_in_image", result.missing[0]},
            {"missing_in_reference", result.missing[1]},
            {"verdict", in_words(result.verdict, differs(result))},
            {"exit_status", static_cast<int>(result.verdict)}};
}

Json json(Verdict verdict, const CompareArguments& a, const std::string& reason) {
    return {{"schema", 1},
            {"image", a.image.string()},
            {"reference", a.reference.string()},
            {"verdict", name(verdict)},
            {"reason", reason},
            {"exit_status", static_cast<int>(verdict)}};
}

std::string write_map(const std::filesystem::path& path, const Comparison& result) {
    std::vector<ExrLayer> maps;
    std::vector<ivec2> origins;
    for (const LayerResult& layer : result.layers)
        for (const MetricResult& m : layer.metrics) {
            maps.push_back({{layer.name + "." + name(m.metric)}, m.map});
            origins.push_back(layer.origin);
        }
    if (maps.empty()) throw Error(path.string(), "there is no difference to map: no layer has any of these metrics");
    make_folder_of(path);
    if (path.extension() != ".png") {
        // The layers of a file have the same window.
        ivec2 first = origins[0], end = first;
        for (std::size_t i = 0; i < maps.size(); ++i) {
            first = glm::min(first, origins[i]);
            end = glm::max(end, origins[i] + ivec2(maps[i].image.width, maps[i].image.height));
        }
        const ivec2 size = end - first;
        MemoryLedger::process().check(
            sizeof(float) * maps.size() * static_cast<std::size_t>(size.x) * static_cast<std::size_t>(size.y),
            path.string(), "pixels");
        for (std::size_t i = 0; i < maps.size(); ++i) maps[i].image = placed(maps[i].image, origins[i] - first, size);
        write_exr(path, maps, {});
        return fmt::format("{} maps", maps.size());
    }
    const auto flip = std::ranges::find_if(maps, [](const ExrLayer& m) { return m.channels[0].ends_with(".flip"); });
    const ExrLayer& first = flip == maps.end() ? maps.front() : *flip;
    double top = 1;
    if (flip == maps.end()) {
        std::vector<double> values;
        for (const float v : first.image.pixels)
            if (!std::isnan(v)) values.push_back(v);
        top = quantile(values, 1 - kWorstShare);
        if (top == 0) top = std::ranges::max(values);
        if (top == 0) top = 1;
    }
    write_png(path, magma(first.image, top));
    return fmt::format("{} from 0 to {:.3g}", first.channels[0], top);
}

}  // namespace halflight::compare
