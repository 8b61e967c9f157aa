#include "engine/settings/visibility.h"

#include "engine/core/error.h"

namespace halflight {

const char* name(PrimaryVisibility primary) {
    switch (primary) {
        case PrimaryVisibility::automatic:
            return "auto";
        case PrimaryVisibility::raster:
            return "raster";
        case PrimaryVisibility::traced:
            return "traced";
    }
    return "";
}

PrimaryVisibility resolved(PrimaryVisibility primary, std::uint64_t triangles, const ivec2& image, bool lens) {
    if (lens && primary == PrimaryVisibility::raster)
        throw Error("render settings", "primary raster shows no depth of field, for which every ray is traced");
    if (lens) return PrimaryVisibility::traced;
    if (primary != PrimaryVisibility::automatic) return primary;
    const double pixels = double(image.x) * double(image.y);
    return double(triangles) > kTracedTrianglesPerPixel * pixels ? PrimaryVisibility::traced
                                                                 : PrimaryVisibility::raster;
}

}  // namespace halflight
