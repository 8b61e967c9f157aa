// Path reuse across pixels (SHADING.md, Path reuse): densities and contributions of a group.
#include "shaders/lib/bsdf.glsl"
#include "shaders/lib/sobol.glsl"
#include "shaders/shared/reuse_groups.h"

// Returns the argument of member_step(), equal for all bands of a frame's sample. Four samples share it, because four
// points of a pixel's sequence are well distributed together. This saves a tenth of the squared error in smooth
// scenes.
uint sample_grouping(uint frame_seed, uint sample_index) {
    return hash_combine(hash_combine(frame_seed, sample_index >> 2), 0x72657573u) >> 16;
}

// A point as seen from a first surface.
struct Sight {
    vec3 direction;  // unit length
    float geometry;  // solid angle per area of y, times the square of y.distance: cosine / relative distance^2
};

// Returns y as seen from `from`. If `finder` is set, the path from there has found y, by the sampled direction.
Sight sight_of(ReusePoint y, vec3 from, bool finder) {
    vec3 way = (y.position - from) / y.distance;
    float square = max(dot(way, way), 1e-20);  // relative distance; nearer points have equal weight
    vec3 direction = finder ? y.direction : way * inversesqrt(square);
    bool seen = leaves_base(unpack_layers(y.layers), -direction);
    float cosine = max(-dot(y.geometric_normal, direction), 0.0);
    return Sight(direction, seen || finder ? (finder ? cosine : cosine / square) : 0.0);
}

// Returns the value for light that the group shares. Light inside of solids, and light of one
// colour channel, is not shared.
BsdfValue shared_value(Bsdf b, vec3 wo, vec3 wi) {
    BsdfValue f = evaluate_bsdf(b, wo, wi);
    if (kVolume && (b.disperses || leads_inside(b, wi))) {
        f.diffuse = vec3(0.0);
        f.glossy = vec3(0.0);
    }
    return f;
}

// Returns the density per solid angle with which shaders/first_scatter.glsl continues a path, without mirrors.
// Directions without value are not selected.
float scatter_density(Bsdf b, BsdfValue f) {
    return (f.diffuse != vec3(0.0) ? b.p_diffuse * f.pdf_diffuse : 0.0) +
           (f.glossy != vec3(0.0) ? (1.0 - b.p_diffuse) * f.pdf_glossy : 0.0);
}
