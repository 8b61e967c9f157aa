// The surface at the end of a ray: position with an error bound, normals, and the material after texture lookups.
#pragma once

#include "engine/core/math.h"
#include "engine/reference/bsdf.h"
#include "engine/reference/tracer.h"

namespace halflight::reference {

struct Surface {
    dvec3 seen{0};       // point of the triangle, relative to Tracer::origin()
    dvec3 position{0};   // where rays start: `seen`, or the point of the smooth surface above it
    double offset = 0;   // world units, see offset_bound()
    dvec3 wo{0};         // unit length, towards the ray's origin
    dvec3 n_g{0};        // unit length, on the side of wo: of the triangle, or of the smooth surface
    dvec3 n{0}, n_k{0};  // shading normals of base and coat, bent towards wo
    TriangleId triangle;
    BsdfParameters parameters;
    dvec3 emitted{0};  // emitted radiance, linear Rec.709
    bool unlit = false;
    bool front = true;  // wo is on the side of the vertex normals

    /// Returns the origin of a ray in this direction.
    dvec3 leave(const dvec3& direction) const { return position + (dot(direction, n_g) < 0 ? -offset : offset) * n_g; }
};

Surface make_surface(const Tracer& tracer, const ReferenceHit& hit, const dvec3& wo);

/// Returns base_color.a x texture.a x vertex colour.a.
double coverage(const Tracer& tracer, const TriangleId& id, double u, double v);
/// Returns the radiance of a lit material, not of an unlit one.
dvec3 emission(const Tracer& tracer, const TriangleId& id, double u, double v);

/// Returns the distance along its normal by which a point p (exact, in double) of a triangle must be moved. The float
/// arithmetic of a ray/triangle test then places it on the right side of the planes of that triangle's neighbours.
///
/// Any summand of dot(v - o, cross(e1, e2)) has at most ten roundings. One is of the origin o, two are of vertices
/// relative to it, two of the edge differences, two of the cross product, and three of the dot product. Each is at most
/// 2^-24 of |p|_1 or of max |v - p|_1 (Higham 2002, gamma_n; Pharr, Jakob, Humphreys 2023, section 6.8).
double offset_bound(const dvec3& p, const std::array<dvec3, 3>& corners);

}  // namespace halflight::reference
