// Frees the memory of large vectors before their scope ends.
#pragma once

#include <vector>

namespace halflight {

/// Empties a vector and frees its memory. The assignment `values = {}` and clear() would keep the memory.
template <class T>
void release(std::vector<T>& values) {
    std::vector<T>().swap(values);
}

/// Returns freed memory to the system. The C library otherwise keeps arrays of up to 32 MiB for later allocations.
void trim_memory();

}  // namespace halflight
