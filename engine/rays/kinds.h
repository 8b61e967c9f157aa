// Kinds of ray batches and methods that trace them, by name. No OpenGL is used.
#pragma once

#include <cstddef>
#include <cstdint>

namespace halflight::rays {

/// Purpose of a batch. It determines the coherence of the rays, and with it every decision of the tracer.
enum class RayKind : std::uint8_t {
    primary,
    shadow,
    sun,  // shadow rays of one direction
    diffuse,
    glossy,
    continuation,
    occlusion,
    connection,
    specular,  // chains over mirrors and glass
};
inline constexpr RayKind kRayKinds[] = {RayKind::primary,   RayKind::shadow,     RayKind::sun,
                                        RayKind::diffuse,   RayKind::glossy,     RayKind::continuation,
                                        RayKind::occlusion, RayKind::connection, RayKind::specular};
const char* name(RayKind kind);

/// Methods to trace a batch.
enum class TraceMethod : std::uint8_t {
    plain,   // whole hierarchy per ray (rays.h)
    tiles,   // compute culling per tile of rays (tiles.h)
    raster,  // raster culling by occlusion queries (raster.h)
    native,  // code of the processor on the driver's memory (native.h)
    other,   // method of another BatchServer
};
inline constexpr std::size_t kTraceMethods = 5;
const char* name(TraceMethod method);

}  // namespace halflight::rays
