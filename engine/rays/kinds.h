// Kinds of ray batches and methods that trace them, by name. No OpenGL.
#pragma once

#include <cstddef>
#include <cstdint>

namespace halflight::rays {

/// What a batch is for. Coherence, and with it every decision of a scheduler, goes by kind.
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

/// Ways to serve a batch.
enum class Way : std::uint8_t {
    plain,   // rays.h
    tiles,   // tiles.h
    raster,  // raster.h
    other,   // a server of somebody else's
};
inline constexpr std::size_t kWays = 4;
const char* name(Way way);

}  // namespace halflight::rays
