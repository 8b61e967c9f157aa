// Methods that trace a scene from its page file.
#pragma once

#include "tools/measure/bench/method.h"

namespace halflight::bench {

/// Throw Error where no page file is given. The pool has room for Bench::pool_bytes.
Method paged_method(const Bench& bench);
Method paged_cold_method(const Bench& bench);
/// Throw Error where no page file is given. The pool has room for a part of the pages that the ray set needs.
Method paged_half_method(const Bench& bench);
Method paged_quarter_method(const Bench& bench);

}  // namespace halflight::bench
