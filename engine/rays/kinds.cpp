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

const char* name(Way way) {
    switch (way) {
        case Way::plain:
            return "plain";
        case Way::tiles:
            return "tiles";
        case Way::raster:
            return "raster";
        case Way::other:
            return "other";
    }
    return "unknown";
}

}  // namespace halflight::rays
