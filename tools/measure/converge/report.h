// Writes a measurement as JSON, as CSV and as an HTML page.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "engine/color/color.h"
#include "tools/measure/converge/measure.h"

namespace halflight::converge {

inline constexpr int kSchema = 3;  // version of the JSON's layout

/// Description of the measured scene, picture and machine.
struct Subject {
    std::string program;      // name and version
    std::string scene;        // path of the scene's file
    std::string camera;       // camera and its source: "'front' of the scene"
    std::string environment;  // environment: "none", a colour or the name of a map
    std::string device;       // GL renderer; empty if no method needs one
    View view;
    Plan plan;
    Clock clock = Clock::wall;
    double scene_seconds = 0;           // wall time of preparing the scene for the GPU, once for all methods
    std::vector<std::string> pilots{};  // sentences about the choices of pilots for estimators that were left open
};

/// Returns all figures. Unknown figures, such as the intervals of a single seed, are null.
nlohmann::ordered_json report_json(const Subject& subject, const Reference& reference, const Measurement& measured);

/// Returns a field of a CSV file, quoted if it must be (RFC 4180, section 2).
std::string csv_field(const std::string& text);
/// Returns a header and a row for each run. Errors of components are empty if they are not known.
std::string report_csv(const Subject& subject, const Measurement& measured);

/// Returns a page that needs no other file and no script. `view` encodes the pictures for display.
std::string report_html(const Subject& subject, const Reference& reference, const Measurement& measured,
                        const ViewProcessor& view);

/// Returns a sentence for each setting of the plan that keeps pictures from converging to the reference.
std::vector<std::string> biases(const Plan& plan);

/// Returns sentences about the most efficient method. If differences between programs count, other programs are
/// compared with methods that are not biased on request, by variance, and Halflight's own methods by MSE.
std::vector<std::string> rankings(const Subject& subject, const Measurement& measured);

/// Returns advice on where more time lowers the error most: rankings(), then a sentence about each method's stages.
std::vector<std::string> advice(const Subject& subject, const Measurement& measured);

}  // namespace halflight::converge
