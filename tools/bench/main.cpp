// halflight-bench: the same as `halflight bench`, without the rest of it.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>

#include "tools/bench/bench.h"

int main(int argc, char** argv) {
    using namespace halflight::bench;
    CLI::App app("Rays per second of several tracers, in turns, on the rays of real frames.", "halflight-bench");
    BenchArguments arguments;
    add_options(app, arguments);
    CLI11_PARSE(app, argc, argv);
    try {
        run_bench(arguments, [] {});
        return 0;
    } catch (const std::exception& error) {
        std::fprintf(stderr, "halflight-bench: %s\n", error.what());
        return 1;
    }
}
