// `halflight compare`: how far two pictures are apart, layer by layer, and whether that is too far.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "engine/core/error.h"
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

/// What a metric may be; above is a warning, or a failure.
struct Thresholds {
    std::optional<double> all;  // for metrics without their own
    std::map<Metric, double> of;
    std::optional<double> at(Metric metric) const;
    bool any() const { return all || !of.empty(); }
};

struct CompareArguments {
    std::filesystem::path image;
    std::filesystem::path reference;
    std::vector<Metric> metrics{Metric::mse, Metric::relmse, Metric::flip};
    Thresholds warn, fail;            // neither: any difference fails
    std::vector<std::string> layers;  // empty: all
    double pixels_per_degree = kPixelsPerDegree;
    std::optional<std::filesystem::path> map;
    bool json = false;
};

void add_options(CLI::App& app, CompareArguments& arguments);

/// Also the program's exit status, as of OpenImageIO's idiff.
enum class Verdict { same = 0, warn = 1, fail = 2, sizes_differ = 3, file_error = 4 };
const char* name(Verdict verdict);

struct MetricResult {
    Metric metric = Metric::mse;
    double value = 0;
    double worst_share = 0;  // of the sum, held by the worst thousandth of the pixels
    Image map;               // per pixel; NaN where either picture is not finite
    Verdict verdict = Verdict::same;
};

struct LayerResult {
    std::string name;
    LayerKind kind = LayerKind::data;
    std::vector<MetricResult> metrics;  // those that apply, in the order asked for; none where no pixel is finite
    std::size_t pixels = 0;
    std::size_t different = 0;           // pixels of which any value differs
    std::size_t not_finite[2] = {0, 0};  // pixels of either that are NaN or infinite in any channel
    bool not_finite_alike = true;        // the same values in the same places
    Verdict verdict = Verdict::same;     // the worst of its metrics; fail where what must be the same differs
};

struct Comparison {
    std::vector<LayerResult> layers;      // of both, in the image's order
    std::vector<std::string> missing[2];  // in the image, in the reference
    Verdict verdict = Verdict::same;
};

/// Sizes must be the same. Throws Error: a display's picture against a scene's, other primaries, a layer that is in
/// neither, nothing to compare.
Comparison compare(const PictureFile& image, const PictureFile& reference, const CompareArguments& arguments);

class SizesDiffer : public Error {
  public:
    using Error::Error;
};

/// Reads, compares, prints, writes the map. Throws SizesDiffer, or Error where a file cannot be read or written.
Verdict run(const CompareArguments& arguments);

}  // namespace halflight::compare
