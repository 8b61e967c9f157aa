// halflight-bench: the same as `halflight bench`, without the rest of it.
#include "tools/common/tool_main.h"
#include "tools/measure/bench/bench.h"

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
