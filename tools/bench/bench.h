// Rays per second: the engine's tracers beside others, on the rays of real frames, interleaved in one process. The
// whole of `halflight-bench` and `halflight bench` but for the command line's errors.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "tools/bench/report.h"

namespace CLI {
class App;
}

namespace halflight::bench {

struct BenchArguments {
    std::vector<std::string> scenes;
    std::string camera;
    std::string size = "1280x720";
    std::vector<std::string> kinds = ray_kinds();
    std::vector<std::string> methods = method_names();
    int turns = 9;
    int repeats = 1;
    Clock clock = Clock::wall;
    std::string nodes = "auto";
    bool keep_instances = false;
    bool robust = false;
    std::string device;
    std::string json;
};

void add_options(CLI::App& app, BenchArguments& arguments);

/// Prints the tables and writes the JSON. between() is called between turns; what it throws ends the run. Throws Error
/// where something cannot be done, and, after all is printed and written, where exact methods disagree.
void run_bench(const BenchArguments& arguments, const std::function<void()>& between);

}  // namespace halflight::bench
