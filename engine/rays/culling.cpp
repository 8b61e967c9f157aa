#include "engine/rays/culling.h"

#include <algorithm>

#include "engine/rays/raster.h"

namespace halflight::rays {
namespace {

constexpr CullingMethod kMethods[] = {
    {Culling::automatic, "auto"},
    {Culling::compute, "compute"},
    {Culling::raster, "raster", make_raster_server, true},
    {Culling::off, "off"},
};

}  // namespace

std::span<const CullingMethod> culling_methods() {
    return kMethods;
}

const CullingMethod& row_of(Culling culling) {
    return *std::ranges::find(kMethods, culling, &CullingMethod::culling);
}

}  // namespace halflight::rays
