// What it saves to leave out what a scene does not need: the scene rendered with and without it, in turns within one
// process.
#pragma once

#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "renderer/render.h"
#include "tools/measure/bench/measure.h"

namespace halflight::leftout {

struct Settings {
    int width = 256, height = 256;  // pixels
    int samples = 4;                // of a picture
    int turns = 9;                  // pictures of each
    int starts = 1;                 // how often each is prepared and compiled anew before that, > 0
};

/// One of the two. Seconds are CPU time of all threads: what else the machine does prolongs nothing.
struct Side {
    std::vector<double> sample_seconds;   // per sample, by turn
    std::vector<double> prepare_seconds;  // tables, hierarchies, upload; by start
    std::vector<double> compile_seconds;  // what the first picture took more than its samples; by start
    std::size_t bytes = 0;                // in device memory
    std::vector<LeftOut> left_out;
};

struct Comparison {
    Side lean;  // with nothing kept
    Side kept;
    bool same_bits = true;  // of the pictures
    /// What is there in `kept` alone, by name: the item asked for, and those that it cannot do without. Empty where it
    /// cannot be kept; then there were no turns.
    std::vector<std::string> added() const;
    /// How many times as long a sample takes with it: of the ratios in each turn.
    bench::Quartiles time_ratio() const;
};

/// By the scene's first camera, without culling, whose trials would be timed, too. between() is called before each
/// picture; what it throws ends the measurement.
Comparison compare(
    gpu::Context& context, const Scene& scene, const ColorConfig& colors, const Kept& kept, const Settings& settings,
    const std::function<void()>& between = [] {});

/// All figures, as {"lean": ..., "kept": ...} each.
nlohmann::ordered_json to_json(const Comparison& comparison);

}  // namespace halflight::leftout
