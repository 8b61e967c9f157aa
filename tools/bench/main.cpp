// halflight-bench: the same as `halflight bench`, without the rest of it.
#include "tools/bench/bench.h"
#include "tools/tool_main.h"

int main(int argc, char** argv) {
    using namespace halflight::bench;
    CLI::App app("Rays per second of several tracers, in turns, on the rays of real frames.", "halflight-bench");
    BenchArguments arguments;
    add_options(app, arguments);
    return halflight::tool_main(app, argc, argv, [&] {
        run_bench(arguments, [] {});
        return 0;
    });
}
