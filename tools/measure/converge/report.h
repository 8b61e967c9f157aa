// What was measured, as JSON, as CSV and as a page for people.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "engine/color/color.h"
#include "tools/measure/converge/measure.h"

namespace halflight::converge {

inline constexpr int kSchema = 2;  // of the JSON

/// What the reports tell beside the measurement.
struct Subject {
    std::string program;  // name and version
    std::string scene;    // the file
    std::string camera;   // "'front' of the scene"
    std::string environment;
    std::string device;  // GL renderer; empty where no method needs one
    View view;
    Plan plan;
    Clock clock = Clock::wall;
    double scene_seconds = 0;           // wall time of preparing the scene for the GPU, once for all methods
    std::vector<std::string> pilots{};  // what they have chosen where an estimator was left open; sentences
};

/// Figures that are not known (intervals of a single seed) are null.
nlohmann::ordered_json report_json(const Subject& subject, const Reference& reference, const Measurement& measured);

/// A field of a CSV file, quoted where it must be (RFC 4180, section 2).
std::string csv_field(const std::string& text);
/// A header, then a row for each run. Errors of components are empty where they are not known.
std::string report_csv(const Subject& subject, const Measurement& measured);

/// One file that needs no other, nor scripts. `view` shows the pictures.
std::string report_html(const Subject& subject, const Reference& reference, const Measurement& measured,
                        const ViewProcessor& view);

/// Why pictures of GL methods would not converge to the reference even so: what was asked for, in sentences.
std::vector<std::string> biases(const Plan& plan);

/// Where the next second lowers the error most: sentences, the methods first, then each method's stages.
std::vector<std::string> advice(const Subject& subject, const Measurement& measured);

}  // namespace halflight::converge
