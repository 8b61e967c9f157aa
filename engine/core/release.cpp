#include "engine/core/release.h"

#include <cstddef>
#ifdef __GLIBC__
#include <malloc.h>
#endif

// jemalloc's interface to its state; null if the program has another allocator.
extern "C" [[gnu::weak]] int mallctl(const char* name, void* old, std::size_t* old_size, void* now,
                                     std::size_t now_size);

namespace halflight {

void trim_memory() {
    if (mallctl != nullptr) mallctl("arena.4096.purge", nullptr, nullptr, nullptr, 0);  // MALLCTL_ARENAS_ALL
#ifdef __GLIBC__
    malloc_trim(0);
#endif
}

}  // namespace halflight
