// Kinds of ray batches and methods that trace them, by name. No OpenGL.
#pragma once

#include <cstddef>
#include <cstdint>

namespace halflight::rays {

/// Purpose of a batch. Coherence depends on the kind, and so do all scheduling decisions.
enum class RayKind : std::uint8_t {
    primary,
    shadow,
    sun,  // shadow rays of one direction
    diffuse,
    glossy,
    continuation,
    occlusion,
    connection,
};
inline constexpr RayKind kRayKinds[] = {RayKind::primary,   RayKind::shadow,    RayKind::sun,
                                        RayKind::diffuse,   RayKind::glossy,    RayKind::continuation,
                                        RayKind::occlusion, RayKind::connection};
const char* name(RayKind kind);

/// Methods that serve a batch.
enum class Way : std::uint8_t {
    plain,   // rays.h
    tiles,   // tiles.h
    raster,  // raster.h
    other,   // a custom server
};
inline constexpr std::size_t kWays = 4;
const char* name(Way way);

}  // namespace halflight::rays
