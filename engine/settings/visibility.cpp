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

const char* name(Backfaces backfaces) {
    switch (backfaces) {
        case Backfaces::automatic:
            return "auto";
        case Backfaces::cull:
            return "cull";
        case Backfaces::show:
            return "show";
    }
    return "";
}

std::string_view shown_by_tracing(const Optics& optics, bool lens, bool overscan) {
    if (optics.projection != Projection::camera) return name(optics.projection);
    if (optics.stereo != Stereo::none) return "stereo";
    return lens ? "depth of field" : overscan ? "overscan" : "";
}

PrimaryVisibility resolved(PrimaryVisibility primary, std::uint64_t triangles, const ivec2& image,
                           std::string_view traced_for) {
    if (!traced_for.empty() && primary == PrimaryVisibility::raster)
        throw Error("render settings", "primary raster shows no {}, for which every ray is traced", traced_for);
    if (!traced_for.empty()) return PrimaryVisibility::traced;
    if (primary != PrimaryVisibility::automatic) return primary;
    const double pixels = double(image.x) * double(image.y);
    return double(triangles) > kTracedTrianglesPerPixel * pixels ? PrimaryVisibility::traced
                                                                 : PrimaryVisibility::raster;
}

}  // namespace halflight
