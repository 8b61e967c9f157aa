// halflight-bench: `halflight bench` as a program of its own.
#include "tools/common/tool_main.h"
#include "tools/measure/bench/bench.h"

int main(int argc, char** argv) {
    using namespace halflight::bench;
    CLI::App app("Measures rays per second of several tracers, in turns, on the rays of real frames.",
                 "halflight-bench");
    BenchArguments arguments;
    add_options(app, arguments);
    return halflight::tool_main(app, argc, argv, [&] {
        run_bench(arguments, [] {});
        return 0;
    });
}
