#include "engine/rays/culling.h"

#include <array>

#include "engine/core/names.h"
#include "engine/rays/native.h"
#include "engine/rays/raster.h"

namespace halflight::rays {
namespace {

/// Rows in the order of Culling.
constexpr std::array kMethods = {
    CullingMethod{"auto"},
    CullingMethod{"compute"},
    CullingMethod{"raster", make_raster_server, true},
    CullingMethod{"off"},
    CullingMethod{"native", make_native_server},
};

}  // namespace

std::span<const Culling> culling_methods() {
    static constexpr auto methods = first_enumerators<Culling, kMethods.size()>();
    return methods;
}

const CullingMethod& row_of(Culling culling) {
    return kMethods.at(static_cast<std::size_t>(culling));
}

}  // namespace halflight::rays
