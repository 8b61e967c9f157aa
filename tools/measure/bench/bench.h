// Measures rays per second of the engine's tracers and of others on the rays of real frames, interleaved in one
// process. Contains all of `halflight-bench` and `halflight bench` except for errors of the command line.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "engine/paging/page_schedule.h"
#include "tools/measure/common/clock.h"

namespace CLI {
class App;
}

namespace halflight::bench {

using halflight::Clock;

struct BenchArguments {
    std::vector<std::string> scenes;   // glTF files
    std::string camera;                // camera by name or number; empty: the first, or one that frames the whole scene
    std::string size = "1280x720";     // WIDTHxHEIGHT, pixels
    std::vector<std::string> kinds;    // members of ray_kinds(); empty: all
    std::vector<std::string> methods;  // members of method_names(); empty: all
    int turns = 9;                     // rounds through all methods, after one to warm up
    int repeats = 1;                   // runs of a method in each turn, whose times are averaged
    int tile = 8;                      // side of a tile of rays, pixels: 8 or 16
    int entries = 32;                  // capacity of a tile's list
    std::string pages;                 // page file of the scene, for the methods that need it; empty: none
    std::size_t pool_bytes = ~std::size_t{0};  // bytes of a pool of pages; at most all pages are held
    paging::PageSchedule page_schedule = paging::kDefaultPageSchedule;
    bool frames = false;  // measures whole frames (frames.h) instead of ray sets
    // The following members are used for frames only; see FrameOrder.
    std::vector<std::string> variants{"off", "compute", "fresh", "auto"};
    int bounces = 8;
    int samples = 64;
    int views = 48;
    int reference = 0;

    Clock clock = Clock::wall;
    std::string nodes = "auto";   // format of the hierarchy's nodes: auto, grid, float
    bool strict = false;          // GltfOptions::strict
    bool keep_instances = false;  // does not flatten small scenes
    bool robust = false;          // uses Embree's watertight mode
    std::string device;           // name of the device (ContextOptions::device)
    std::string json;             // file for the figures; empty: none
};

void add_options(CLI::App& app, BenchArguments& arguments);

/// Prints the tables and writes the JSON. Calls between() between turns; an exception from it ends the run. Throws
/// Error if a file or scene cannot be used, and, after the output is complete, if exact methods disagree.
void run_bench(const BenchArguments& arguments, const std::function<void()>& between);

}  // namespace halflight::bench
