#include "engine/rays/kinds.h"

namespace halflight::rays {

const char* name(RayKind kind) {
    switch (kind) {
        case RayKind::primary:
            return "primary";
        case RayKind::shadow:
            return "shadow";
        case RayKind::sun:
            return "sun";
        case RayKind::diffuse:
            return "diffuse";
        case RayKind::glossy:
            return "glossy";
        case RayKind::continuation:
            return "continuation";
        case RayKind::occlusion:
            return "occlusion";
        case RayKind::connection:
            return "connection";
    }
    return "unknown";
}

const char* name(TraceMethod method) {
    switch (method) {
        case TraceMethod::plain:
            return "plain";
        case TraceMethod::tiles:
            return "tiles";
        case TraceMethod::raster:
            return "raster";
        case TraceMethod::other:
            return "other";
    }
    return "unknown";
}

}  // namespace halflight::rays
