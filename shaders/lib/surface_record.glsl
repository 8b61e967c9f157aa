// Reading of rows of the G-buffer (shaders/shared/surface.h), or writing with HALFLIGHT_STORE_SURFACE. Include after
// `buffer ... { vec4 surfaces[]; }`.
#include "shaders/lib/bsdf.glsl"
#include "shaders/shared/surface.h"

const uint kGlossyRow = 5u;
#ifdef HALFLIGHT_GLOSSY
const uint kTransmissionRow = 7u;
#else
const uint kTransmissionRow = 5u;
#endif
#ifdef HALFLIGHT_TRANSMISSION
const uint kCoatRow = kTransmissionRow + 1u;
#else
const uint kCoatRow = kTransmissionRow;
#endif

// Data that passes need in addition to the BSDF.
struct SurfacePoint {
    vec3 position;    // position relative to TraceTables::origin
    float offset;     // distance of new rays' origins along the geometric normal
    vec3 emission;    // radiance towards the camera
    bool is_surface;  // false: the environment is visible
};

#ifdef HALFLIGHT_STORE_SURFACE
void store_surface(uint path, SurfacePoint point, Bsdf b) {
    uint row = path * HALFLIGHT_SURFACE_ROWS;
    surfaces[row] = vec4(point.position, point.offset);
    surfaces[row + 1u] = vec4(point.emission, point.is_surface ? 1.0 : 0.0);
    surfaces[row + 2u] = vec4(b.geometric_normal, b.p_diffuse);
    surfaces[row + 3u] = vec4(b.normal, b.alpha);
    surfaces[row + 4u] = vec4(b.diffuse, b.p_transmission);
#ifdef HALFLIGHT_GLOSSY
    surfaces[row + kGlossyRow] = vec4(b.specular, b.p_coat);
    surfaces[row + kGlossyRow + 1u] = vec4(b.specular_edge, b.coat_alpha);
#endif
#ifdef HALFLIGHT_TRANSMISSION
    surfaces[row + kTransmissionRow] = vec4(b.transmission, 0.0);
#endif
#ifdef HALFLIGHT_CLEARCOAT
    surfaces[row + kCoatRow] = vec4(b.coat_normal, b.coat);
#endif
}

// Stores the part of a record that the last vertex of a path needs.
void store_end(uint path, vec3 emission, bool is_surface, vec3 geometric_normal) {
    uint row = path * HALFLIGHT_SURFACE_ROWS;
    surfaces[row + 1u] = vec4(emission, is_surface ? 1.0 : 0.0);
    surfaces[row + 2u] = vec4(geometric_normal, 0.0);
}
#else
uniform samplerBuffer surfaces;  // RGBA32F: rows of records

vec4 surface_row(uint path, uint row) { return texelFetch(surfaces, int(path * HALFLIGHT_SURFACE_ROWS + row)); }

SurfacePoint load_surface_point(uint path) {
    vec4 position = surface_row(path, 0u);
    vec4 emission = surface_row(path, 1u);
    return SurfacePoint(position.xyz, position.w, emission.xyz, emission.w != 0.0);
}

vec3 load_geometric_normal(uint path) { return surface_row(path, 2u).xyz; }

Bsdf load_bsdf(uint path) {
    vec4 geometric = surface_row(path, 2u);
    vec4 shading = surface_row(path, 3u);
    vec4 diffuse = surface_row(path, 4u);
    Bsdf b;
    b.geometric_normal = geometric.xyz;
    b.p_diffuse = geometric.w;
    b.normal = shading.xyz;
    b.alpha = shading.w;
    b.diffuse = diffuse.rgb;
    b.p_transmission = diffuse.w;
    b.specular = vec3(0.0);
    b.p_coat = 0.0;
    b.specular_edge = vec3(0.0);
    b.coat_alpha = 0.0;
    b.transmission = vec3(0.0);
    b.coat_normal = b.normal;
    b.coat = 0.0;
#ifdef HALFLIGHT_GLOSSY
    vec4 specular = surface_row(path, kGlossyRow);
    vec4 edge = surface_row(path, kGlossyRow + 1u);
    b.specular = specular.rgb;
    b.p_coat = specular.w;
    b.specular_edge = edge.rgb;
    b.coat_alpha = edge.w;
#endif
#ifdef HALFLIGHT_TRANSMISSION
    b.transmission = surface_row(path, kTransmissionRow).rgb;
#endif
#ifdef HALFLIGHT_CLEARCOAT
    vec4 coat = surface_row(path, kCoatRow);
    b.coat_normal = coat.xyz;
    b.coat = coat.w;
#endif
    return b;
}
#endif
