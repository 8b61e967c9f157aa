#include "engine/core/release.h"

#include <malloc.h>

namespace halflight {

void trim_memory() {
#ifdef __GLIBC__
    malloc_trim(0);
#endif
}

}  // namespace halflight
