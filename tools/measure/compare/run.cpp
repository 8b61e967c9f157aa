#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "engine/core/error.h"
#include "engine/core/names.h"
#include "tools/measure/compare/compare.h"
#include "tools/measure/compare/report.h"

namespace halflight::compare {
namespace {

Metric metric_named(const std::string& text) {
    for (const Metric metric : {Metric::mse, Metric::relmse, Metric::flip, Metric::max})
        if (text == name(metric)) return metric;
    throw CLI::ValidationError("there is no metric '" + text + "', only mse, relmse, flip, max");
}

double number(const std::string& text, double lower) {
    double value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size() || !(value >= lower) || std::isinf(value))
        throw CLI::ValidationError(fmt::format("expects a number from {} on, not '{}'", lower, text));
    return value;
}

/// Parses thresholds: X, or METRIC=X,...
Thresholds thresholds(const std::string& text) {
    Thresholds result;
    for (const std::string& part : split_names(text)) {
        const std::size_t equals = part.find('=');
        if (equals == std::string::npos)
            result.all = number(part, 0);
        else
            result.of[metric_named(part.substr(0, equals))] = number(part.substr(equals + 1), 0);
    }
    return result;
}

std::string text_of(const nlohmann::ordered_json& json) {
    return json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

bool is_map(const std::filesystem::path& path) {
    return path.extension() == ".png" || path.extension() == ".exr";
}

/// Compares the files, writes the map, and returns the verdict and what to print.
std::pair<Verdict, std::string> compare_files(const CompareArguments& arguments) {
    for (const Thresholds* thresholds : {&arguments.warn, &arguments.fail})
        for (const auto& [metric, unused] : thresholds->of)
            if (std::ranges::find(arguments.metrics, metric) == arguments.metrics.end())
                throw Error(name(metric), "has a threshold, and is not among the metrics");
    PictureFile image = read_picture(arguments.image), reference = read_picture(arguments.reference);
    for (const PictureFile* file : {&image, &reference})
        if (!file->deep_parts.empty() && arguments.layers.empty())
            throw Error(file->name, "part '{}' has deep data, which cannot be compared; --layer selects other layers",
                        file->deep_parts[0]);
    const std::string windows = align(image, reference);
    const Comparison result = compare(image, reference, arguments);
    const std::string shown = arguments.map ? write_map(*arguments.map, result) : "";
    if (arguments.json) return {result.verdict, text_of(json(result, arguments, image, reference, windows))};
    std::string text = windows.empty() ? "" : windows + "\n";
    text += table(result, arguments, image);
    if (arguments.map) text += fmt::format("wrote {}: {}\n", arguments.map->string(), shown);
    return {result.verdict, text};
}

}  // namespace

void add_options(CLI::App& app, CompareArguments& a) {
    const auto value = [&](const char* option, const char* metavar, const char* description, const auto& parse) {
        const auto named = [option, parse](const std::string& text) {
            try {
                parse(text);
            } catch (const CLI::ValidationError& error) {  // the message does not name the option yet
                throw CLI::ValidationError(option, error.what());
            }
        };
        app.add_option_function<std::string>(option, named, description)->type_name(metavar);
    };
    app.add_option("IMAGE", a.image, "picture: .exr, .png, .jpg, .tif or .hdr")->type_name("")->required();
    app.add_option("REFERENCE", a.reference, "picture to compare with")->type_name("")->required();
    value("--metric", "NAME,...", "error metrics: mse, relmse, flip, max (default: all but max)",
          [&](const std::string& text) {
              a.metrics.clear();
              for (const std::string& part : split_names(text)) {
                  const Metric metric = metric_named(part);
                  if (std::ranges::find(a.metrics, metric) == a.metrics.end()) a.metrics.push_back(metric);
              }
          });
    const char* const kThreshold = "X|METRIC=X,...";
    value("--warn", kThreshold, "threshold above which the exit status is 1",
          [&](const std::string& text) { a.warn = thresholds(text); });
    value("--fail", kThreshold, "threshold above which the exit status is 2 (default: 0 without --warn)",
          [&](const std::string& text) { a.fail = thresholds(text); });
    value("--layer", "NAME,...", "compares only these layers, by the names in the table",
          [&](const std::string& text) { a.layers = split_names(text); });
    value("--ppd", "N", "pixels per degree of visual angle, for FLIP (default 67)",
          [&](const std::string& text) { a.pixels_per_degree = number(text, 1); });
    value("--map", "FILE",
          "writes maps of the error. An .exr has all of them; a .png has that of the first layer, by FLIP if it is "
          "measured, else by the first metric",
          [&](const std::string& text) {
              a.map = text;
              if (!is_map(text)) throw CLI::ValidationError("is an .exr or a .png, not '" + text + "'");
          });
    app.add_flag("--json", a.json, "prints JSON instead of a table, also for pictures that cannot be compared");
    app.footer(
        "Exit status: 0 the same or within the thresholds, 1 above --warn, 2 above --fail, layers missing,\n"
        "ids or non-finite pixels that differ, 3 sizes differ, 4 files or arguments that cannot be used.");
}

Verdict run(const CompareArguments& arguments) {
    const auto [verdict, text] = [&] {
        try {
            return compare_files(arguments);
        } catch (const Error& error) {
            const bool sizes = dynamic_cast<const SizesDiffer*>(&error);
            if (arguments.json)
                fmt::print("{}",
                           text_of(json(sizes ? Verdict::sizes_differ : Verdict::file_error, arguments, error.what())));
            throw;
        }
    }();
    fmt::print("{}", text);
    return verdict;
}

}  // namespace halflight::compare
