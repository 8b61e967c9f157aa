// Reading of rows of the G-buffer (shaders/shared/surface_rows.h), which shaders/resolve.comp writes.
#include "shaders/lib/bsdf.glsl"
#include "shaders/shared/surface_rows.h"
#include "shaders/shared/word.h"

// Data that passes need in addition to the BSDF.
struct SurfacePoint {
    vec3 position;    // where new rays start, relative to TraceTables::origin
    float offset;     // additional distance of new rays' origins along the geometric normal
    float lift;       // height of the position above the triangle, along the geometric normal, >= 0
    vec3 emission;    // radiance towards the camera
    bool is_surface;  // false: the environment is visible
    bool catches;     // the ray met a shadow catcher, behind which the environment is visible
    uint link_class;  // Instance::link_class; 0 without light links
};

// Row of the class, behind those of the BSDF.
const uint kLinkRow = HALFLIGHT_SURFACE_ROWS - 1u;

uniform samplerBuffer surfaces;  // RGBA32F: rows of records

vec4 surface_row(uint path, uint row) { return texelFetch(surfaces, int(path * HALFLIGHT_SURFACE_ROWS + row)); }

SurfacePoint load_surface_point(uint path) {
    vec4 position = surface_row(path, 0u);
    vec4 emission = surface_row(path, 1u);
    uint link_class = HALFLIGHT_LIGHT_LINKS != 0 ? word_of_float(surface_row(path, kLinkRow).x) : 0u;
    return SurfacePoint(position.xyz, position.w, max(emission.w, 0.0), emission.xyz, emission.w >= 0.0,
                        emission.w == -2.0, link_class);
}

vec3 load_geometric_normal(uint path) { return surface_row(path, 2u).xyz; }

// Returns the point of the triangle that the ray has hit.
vec3 seen_position(uint path, SurfacePoint point) {
    return point.position - point.lift * load_geometric_normal(path);
}

Bsdf load_bsdf(uint path) {
    vec4 rows[kBsdfRows];
    for (uint i = 0u; i < kBsdfRows; ++i) rows[i] = surface_row(path, 2u + i);
    return unpack_bsdf(rows);
}
