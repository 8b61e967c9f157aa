// `halflight compare`: measures the differences of two pictures layer by layer, and judges them by thresholds.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "tools/measure/common/flip.h"
#include "tools/measure/compare/layers.h"

namespace CLI {
class App;
}

namespace halflight::compare {

enum class Metric {
    mse,     // mean squared difference
    relmse,  // mean relative squared difference (engine/core/metrics.h)
    flip,    // mean FLIP: HDR-FLIP of scene-linear colour, LDR-FLIP of a display's; colour only
    max,     // largest absolute difference
};
const char* name(Metric metric);

/// Largest values of metrics; greater ones are a warning, or a failure.
struct Thresholds {
    std::optional<double> all;  // threshold of metrics without one of their own
    std::map<Metric, double> of;
    std::optional<double> at(Metric metric) const;
    bool any() const { return all || !of.empty(); }
};

struct CompareArguments {
    std::filesystem::path image;
    std::filesystem::path reference;
    std::vector<Metric> metrics{Metric::mse, Metric::relmse, Metric::flip};
    Thresholds warn, fail;            // if neither is set, any difference fails
    std::vector<std::string> layers;  // layers to compare; empty: all
    double pixels_per_degree = kPixelsPerDegree;
    std::optional<std::filesystem::path> map;
    bool json = false;
};

void add_options(CLI::App& app, CompareArguments& arguments);

/// Judgement of a comparison; also the program's exit status, which equals that of OpenImageIO's idiff.
enum class Verdict { same = 0, warn = 1, fail = 2, sizes_differ = 3, file_error = 4 };
const char* name(Verdict verdict);

struct MetricResult {
    Metric metric = Metric::mse;
    double value = 0;
    double worst_share = 0;  // share of the sum in the worst thousandth of the pixels, [0, 1]
    Image map;               // metric by pixel; NaN where either picture is not finite
    Verdict verdict = Verdict::same;
};

struct LayerResult {
    std::string name;
    LayerKind kind = LayerKind::data;
    ivec2 origin{0};                    // upper left pixel in the display window
    std::vector<MetricResult> metrics;  // applicable metrics in the requested order; none if no pixel is finite
    std::size_t pixels = 0;
    std::size_t different = 0;           // number of pixels with a difference in any channel
    std::size_t not_finite[2] = {0, 0};  // number of pixels of each picture that are NaN or infinite in any channel
    bool not_finite_alike = true;        // both have equal non-finite values in the same places
    Verdict verdict = Verdict::same;     // worst verdict of the metrics; fail if ids or non-finite values differ
};

struct Comparison {
    std::vector<LayerResult> layers;      // layers that both have, in the image's order
    std::vector<std::string> missing[2];  // layers that the image lacks, and those that the reference lacks
    Verdict verdict = Verdict::same;
};

/// Compares two pictures of the same size. Throws Error if only one is display-encoded, if primaries differ,
/// if neither has a wanted layer, and if there is nothing to compare.
Comparison compare(const PictureFile& image, const PictureFile& reference, const CompareArguments& arguments);

/// Reads both files, compares them, prints the result and writes the map. Throws SizesDiffer, or Error if a file
/// cannot be read or written; JSON is printed in these cases, too.
Verdict run(const CompareArguments& arguments);

}  // namespace halflight::compare
