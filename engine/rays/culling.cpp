#include "engine/rays/culling.h"

#include "engine/rays/raster.h"

namespace halflight::rays {
namespace {

constexpr CullingMethod kMethods[] = {
    {"auto"},
    {"compute"},
    {"raster", make_raster_server},
    {"off"},
};

}  // namespace

std::span<const CullingMethod> culling_methods() {
    return kMethods;
}

const CullingMethod& row_of(Culling culling) {
    return culling_methods()[static_cast<std::size_t>(culling)];
}

}  // namespace halflight::rays
