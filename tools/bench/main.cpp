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
    try {
        app.parse(argc, argv);
        run_bench(arguments, [] {});
        return 0;
    } catch (const CLI::ParseError& error) {
        if (error.get_exit_code() == 0) return app.exit(error);  // --help
        std::fprintf(stderr, "halflight-bench: %s\n", error.what());
        return 2;
    } catch (const std::exception& error) {
        std::fprintf(stderr, "halflight-bench: %s\n", error.what());
        return 1;
    }
}
