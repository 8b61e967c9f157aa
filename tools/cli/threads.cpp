#include "tools/cli/threads.h"

#include <tbb/global_control.h>

#include <cstdlib>
#include <memory>
#include <string>

namespace halflight {

void limit_threads(int most) {
    // llvmpipe and lavapipe read the variable when they are loaded; the native tracer follows it, too.
    setenv("LP_NUM_THREADS", std::to_string(most).c_str(), 1);
    static std::unique_ptr<tbb::global_control> limit;
    limit = std::make_unique<tbb::global_control>(tbb::global_control::max_allowed_parallelism,
                                                  static_cast<std::size_t>(most));
}

}  // namespace halflight
