// Methods that trace a scene from its page file.
#pragma once

#include "tools/measure/bench/method.h"

namespace halflight::bench {

/// Returns a method with a pool of Bench::pool_bytes. Throws Error if no page file is given.
Method paged_method(const Bench& bench);
Method paged_cold_method(const Bench& bench);
/// Returns a method whose pool has room for a part of the pages that the set needs. Throws Error like paged_method().
Method paged_half_method(const Bench& bench);
Method paged_quarter_method(const Bench& bench);

}  // namespace halflight::bench
