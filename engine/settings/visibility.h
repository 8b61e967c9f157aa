// Visibility of camera rays: the surfaces that they meet, and the method.
#pragma once

#include <cstdint>
#include <string_view>

#include "engine/core/math.h"
#include "engine/core/optics.h"
#include "engine/scene/backfaces.h"

namespace halflight {

/// Method of primary visibility: raster or traced. Both methods converge to the same picture, except for details
/// smaller than a pixel (passes/surface/gbuffer.h, add_gbuffer).
enum class PrimaryVisibility : std::uint8_t {
    automatic,  // traced if triangles are far smaller than pixels, else raster
    raster,
    traced,
};
/// Returns "auto", "raster" or "traced".
const char* name(PrimaryVisibility primary);
/// Triangles per pixel above which `automatic` traces. A rasterizer visits every triangle for every sample; a tracer
/// visits the nodes that a ray meets. docs/measuring.md has the times from which the number follows.
inline constexpr double kTracedTrianglesPerPixel = 0.25;
/// Resolves `automatic` from the triangle count (each instance counts) and the image size in pixels. The choice can
/// change pictures, so it depends on scene, camera and picture alone. traced_for: what only tracing can show, such as
/// "depth of field"; empty: nothing. Throws Error for `raster` then.
PrimaryVisibility resolved(PrimaryVisibility primary, std::uint64_t triangles, const ivec2& image,
                           std::string_view traced_for = {});
/// Returns "auto", "cull" or "show".
const char* name(Backfaces backfaces);
/// Returns what only tracing can show: another projection, two eyes, depth of field, or pixels beyond the edges of the
/// picture. Empty: nothing.
std::string_view shown_by_tracing(const Optics& optics, bool lens, bool overscan);

}  // namespace halflight
