#include "engine/core/thread_limit.h"

#include <pthread.h>

#include <latch>
#include <vector>

namespace halflight {

int startable_threads(int wanted) {
    // The threads allocate nothing: an allocation would give each of them 64 MiB of address space (arenas of glibc).
    const auto wait = [](void* latch) -> void* {
        static_cast<std::latch*>(latch)->wait();
        return nullptr;
    };
    std::latch checked(1);
    std::vector<pthread_t> threads(static_cast<std::size_t>(wanted));
    int started = 0;
    while (started < wanted &&
           pthread_create(&threads[static_cast<std::size_t>(started)], nullptr, wait, &checked) == 0)
        ++started;
    checked.count_down();
    for (int i = 0; i < started; ++i) pthread_join(threads[static_cast<std::size_t>(i)], nullptr);
    return started;
}

}  // namespace halflight
