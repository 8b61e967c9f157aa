// One path from the camera (SHADING.md, "Estimator").
#pragma once

#include <algorithm>
#include <array>

#include "engine/reference/lights.h"
#include "engine/reference/random.h"
#include "engine/reference/reference.h"
#include "engine/reference/surface.h"
#include "engine/reference/tracer.h"

namespace halflight::reference {

/// A scene with all derived data.
struct Prepared {
    Tracer tracer;
    Lights lights;
    bool disperses;  // some material has a dispersion
    explicit Prepared(const Scene& scene)
        : tracer(scene),
          lights(tracer),
          disperses(std::ranges::any_of(scene.materials, [](const Material& m) { return m.dispersion > 0; })) {}
};

/// Radiance by component; the arrays are indexed by Component.
struct Radiance {
    dvec3 emission{0};
    std::array<dvec3, 2> direct{dvec3(0), dvec3(0)};
    std::array<dvec3, 2> indirect{dvec3(0), dvec3(0)};

    dvec3 sum() const { return emission + direct[0] + direct[1] + indirect[0] + indirect[1]; }
    Radiance& operator+=(const Radiance& other);
};

struct PathResult {
    Radiance radiance;
    bool covered = false;  // the camera ray met a surface
};

PathResult trace_path(const Prepared& scene, const ReferenceSettings& settings, int x, int y, Random& random);

/// A surface that the camera sees.
struct FirstSurface {
    Surface surface;
    double depth;  // distance along the camera's axis; with a projection other than the camera's own, along the ray
};

/// Returns the surface that the ray through the pixel's centre hits; alpha `blend` is decided by a hash of seed and
/// pixel.
std::optional<FirstSurface> first_surface(const Prepared& scene, const ReferenceSettings& settings, int x, int y);

}  // namespace halflight::reference
