// The engine's own tracers as methods; method.h describes them.
#pragma once

#include "tools/measure/bench/method.h"

namespace halflight::bench {

Method plain_method(const Bench& bench);
Method compute_method(const Bench& bench);
Method kept_method(const Bench& bench);
Method automatic_method(const Bench& bench);
Method raster_method(const Bench& bench);
Method native_method(const Bench& bench);

}  // namespace halflight::bench
