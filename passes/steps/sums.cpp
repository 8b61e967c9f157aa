#include "passes/steps/sums.h"

namespace halflight {

using graph::Access;

void read_light(graph::Pass& pass, gpu::Defines& defines, const Accumulated& sums) {
    pass.read(sums.emission, Access::storage_read, "Emission");
    if (sums.direct) {
        pass.read(sums.direct, Access::storage_read, "Direct");
        defines.set("HALFLIGHT_DIRECT");
    }
    if (sums.indirect) {
        pass.read(sums.indirect, Access::storage_read, "Indirect");
        defines.set("HALFLIGHT_INDIRECT");
    }
}

}  // namespace halflight
