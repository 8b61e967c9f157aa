// The command line as values.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "tools/cli/picture_arguments.h"
#include "tools/measure/bench/bench.h"
#include "tools/measure/compare/compare.h"
#include "tools/measure/converge/plan.h"
#include "tools/measure/converge/reference.h"

namespace halflight {

/// Arguments of `halflight converge`; the size of the picture has another default.
struct ConvergeArguments : ViewArguments {
    std::filesystem::path folder;  // folder of the reports
    converge::Plan plan;
    // What is to be compared, in all combinations; the plan has a technique per method.
    std::vector<Estimator> estimators;  // empty: the default one
    std::vector<Preview> previews;      // empty: none
    std::vector<bool> denoise;          // empty: false
    bench::Clock clock = bench::Clock::wall;
    bool require_agreement = false;      // the external renderer must agree with the other methods
    converge::ReferenceOrder reference;  // folder: empty for the default one
};

/// Arguments of `halflight info`.
struct InfoArguments {
    std::optional<std::filesystem::path> scene;
    bool device = false;      // lists devices
    bool needs = false;       // lists the parts that rendering leaves out
    bool names = false;       // lists names as options
    bool check = false;       // reads a page file as a whole
    bool time = false;        // measures the time that leaving parts out saves
    RenderArguments picture;  // picture whose memory is estimated: size, camera, layers, ...; without files
    bool png = false;         // the picture is written as a .png, too
    bool json = false;
};

/// `halflight --version`.
struct Version {};

/// Man pages and completions that `halflight info --write-manual` writes: text by path.
struct Manual {
    std::map<std::filesystem::path, std::string> files;
};

/// Arguments of `halflight thumbnail`.
struct ThumbnailArguments : RenderArguments {
    ThumbnailArguments() { width = height = 256; }
    int limit = 30;                                // wall time after which the program ends, seconds
    std::size_t bytes = std::size_t{2} << 30;      // memory of the program, bytes
    std::optional<std::filesystem::path> named{};  // name of a picture without an extension; none: that of the output
};

/// Arguments of `halflight denoise`. Of the settings, those of the view and the denoiser apply.
struct DenoiseArguments : RenderArguments {
    std::vector<std::filesystem::path> noisy;  // noisy frames, or pictures beside which they lie
};

/// Arguments of `halflight pack`.
struct PackArguments {
    std::filesystem::path scene;
    std::filesystem::path output;  // page file
    SceneChoice choice;            // allow_outside, strict_scene and edits.straight_glass
    LogChoice log;
};

using bench::BenchArguments;      // `halflight bench`
using compare::CompareArguments;  // `halflight compare`

using Arguments = std::variant<Help, Version, Manual, RenderArguments, DenoiseArguments, ThumbnailArguments,
                               PreviewArguments, ConvergeArguments, InfoArguments, PackArguments, BenchArguments,
                               CompareArguments>;
Arguments parse_arguments(int argc, const char* const* argv);

}  // namespace halflight
