#include "tools/measure/bench/bench.h"

#include "tools/cli/signals.h"
#include "tools/halflight/commands.h"

namespace halflight {

void run_bench(const BenchArguments& arguments) {
    bench::run_bench(arguments, [] {
        if (const int signal = stop_signal()) throw Interrupted(signal, "bench", "stopped; nothing was written");
    });
}

}  // namespace halflight
