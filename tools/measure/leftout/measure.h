// Renders a scene with and without the work that it does not need, in turns within one process.
#pragma once

#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "renderer/render.h"
#include "tools/measure/bench/measure.h"

namespace halflight::leftout {

struct Settings {
    int width = 256, height = 256;  // size of a picture, pixels
    int samples = 4;                // number of samples of a picture
    int turns = 9;                  // number of pictures of each side
    int starts = 1;                 // number of times that each side is prepared and compiled before the turns, > 0
};

/// Measurements of one of the two sides. Seconds are CPU time of all threads, which the load of other programs does not
/// prolong.
struct Side {
    std::vector<double> sample_seconds;   // time of a sample, by turn
    std::vector<double> prepare_seconds;  // time of tables, hierarchies and upload, by start
    std::vector<double> compile_seconds;  // time of the first picture beyond its samples, by start
    std::size_t bytes = 0;                // size of the device memory
    std::vector<LeftOut> left_out;
};

struct Comparison {
    Side lean;  // side on which nothing is kept
    Side kept;
    bool same_bits = true;  // all pictures of both sides are equal
    /// Returns the names of the items that only `kept` has: the item asked for, and those that it depends on. Empty
    /// if it cannot be kept; then there were no turns.
    std::vector<std::string> added() const;
    /// Returns the quartiles of a sample's time, kept / lean, turn by turn.
    bench::Quartiles time_ratio() const;
};

/// Measures both sides with the scene's first camera, without culling, whose trials would count. Calls between() before
/// each picture; an exception from it ends the measurement.
Comparison compare(
    gpu::Context& context, const Scene& scene, const ColorConfig& colors, const Kept& kept, const Settings& settings,
    const std::function<void()>& between = [] {});

/// Returns all figures, each as {"lean": ..., "kept": ...}.
nlohmann::ordered_json to_json(const Comparison& comparison);

}  // namespace halflight::leftout
