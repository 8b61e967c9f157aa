// Rays per second: the engine's tracers beside others, on the rays of real frames, interleaved in one process. The
// whole of `halflight-bench` and `halflight bench` but for the command line's errors.
#pragma once

#include <functional>
#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace halflight::bench {

/// Which time the figures are made of. cpu: of all threads; the one to trust where the machine is shared.
enum class Clock { wall, cpu };

struct BenchArguments {
    std::vector<std::string> scenes;   // glTF files
    std::string camera;                // name or number; empty: the first, else one that sees everything
    std::string size = "1280x720";     // WIDTHxHEIGHT
    std::vector<std::string> kinds;    // of ray_kinds(); empty: all
    std::vector<std::string> methods;  // of method_names(); empty: all
    int turns = 9;                     // rounds through all methods, after one to warm up
    int repeats = 1;                   // runs of a method in each turn, whose mean counts
    int tile = 8;                      // pixels along the side of a tile of rays: 8 or 16
    int entries = 32;                  // that a tile's list has room for
    bool frames = false;  // whole frames (frames.h) instead of ray sets; what is not of FrameOrder is ignored
    std::vector<std::string> variants{"off", "compute", "fresh", "auto"};
    int bounces = 8;
    int samples = 64;
    int views = 48;
    int reference = 0;
    Clock clock = Clock::wall;
    std::string nodes = "auto";   // grid, float
    bool keep_instances = false;  // no flattening of small scenes
    bool robust = false;          // Embree's watertight mode
    std::string device;           // as of halflight render
    std::string json;             // file for the figures; empty: none
};

void add_options(CLI::App& app, BenchArguments& arguments);

/// Prints the tables and writes the JSON. between() is called between turns; what it throws ends the run. Throws Error
/// where something cannot be done, and, after all is printed and written, where exact methods disagree.
void run_bench(const BenchArguments& arguments, const std::function<void()>& between);

}  // namespace halflight::bench
