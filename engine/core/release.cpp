#include "engine/core/release.h"

#ifdef __GLIBC__
#include <malloc.h>
#endif

namespace halflight {

void trim_memory() {
#ifdef __GLIBC__
    malloc_trim(0);
#endif
}

}  // namespace halflight
