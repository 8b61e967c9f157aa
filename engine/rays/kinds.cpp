#include "engine/rays/kinds.h"

#include "engine/core/names.h"

namespace halflight::rays {

const char* name(RayKind kind) {
    return name_among(
        kRayKinds,
        {"primary", "shadow", "sun", "diffuse", "glossy", "continuation", "occlusion", "connection", "specular"}, kind);
}

const char* name(TraceMethod method) {
    switch (method) {
        case TraceMethod::plain:
            return "plain";
        case TraceMethod::tiles:
            return "tiles";
        case TraceMethod::raster:
            return "raster";
        case TraceMethod::native:
            return "native";
        case TraceMethod::other:
            return "other";
    }
    return "unknown";
}

}  // namespace halflight::rays
