// Contents of texel pools.
#pragma once

#include <vector>

#include "engine/tables/shading_tables.h"

namespace halflight {

/// Returns all texels of a pool.
template <class Channel>
std::vector<typename TexelPool<Channel>::Texel> texels_of(const TexelPool<Channel>& pool) {
    std::vector<typename TexelPool<Channel>::Texel> texels(pool.size());
    pool.read(0, texels);
    return texels;
}

}  // namespace halflight
