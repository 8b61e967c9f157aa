// Lights with a size: points and spots are balls, directional lights are discs in the sky (SHADING.md, Lights with a
// size). Needs shaders/scene_tables.glsl.
#include "shaders/lib/onb.glsl"
#include "shaders/lib/sampling.glsl"
#include "shaders/shared/light.h"
#include "shaders/shared/word.h"

const bool kSizedLights = HALFLIGHT_SIZED_LIGHTS != 0;

// Squared sine of the half angle below which a light is taken as one without size: floats have no directions within.
const float kLeastSquaredSine = 1e-12;

// A sized light as a receiver sees it: a cone of constant radiance.
struct SizedLight {
    vec3 axis;       // unit, towards the light's centre
    float spread;    // 1 - cos of the cone's half angle; 2: the receiver is inside the ball; 0: the light has no size
    float radiance;  // radiance over the light's intensity
    float square;    // squared distance of a ball's centre
    float size;      // radius of a ball, squared sine of the half angle of a disc
};

// Returns the light of a row. `head` and `travel` are texels 0 and 1, `size` is that of texel 2.
SizedLight sized_light(vec3 position, vec4 head, vec3 travel, float size) {
    const float kInversePi = 0.31830988618;
    bool is_disc = light_kind(word_of_float(head.w)) == kLightDirectional;
    vec3 to_centre = head.xyz - position;
    float square = dot(to_centre, to_centre);
    float squared_size = is_disc ? size : size * size;
    float squared_sine = is_disc ? size : squared_size / max(square, 1e-37);
    bool inside = !is_disc && square <= squared_size;
    bool is_sized = squared_size > 0.0 && squared_sine >= kLeastSquaredSine;
    // The quotient is free of the cancellation of 1 - cos.
    float spread = inside ? 2.0 : squared_sine / (1.0 + sqrt(max(1.0 - squared_sine, 0.0)));
    vec3 axis = square > 0.0 ? to_centre * inversesqrt(max(square, 1e-37)) : vec3(0.0, 0.0, 1.0);
    return SizedLight(is_disc ? -travel : axis, is_sized ? spread : 0.0, kInversePi / max(squared_size, 1e-37), square,
                      size);
}

// Returns the density per solid angle of sampled directions.
float density_of(SizedLight light) { return 0.159154943092 / light.spread; }

// Samples a direction of the cone uniformly.
vec3 sample_sized(SizedLight light, vec2 xi) {
    vec3 p = sample_disk(xi);
    float off = p.z * p.z * light.spread;
    return basis_around(light.axis) * vec3(p.xy * sqrt(light.spread * (2.0 - off)), 1.0 - off);
}

// Returns the distance from the receiver to the ball along a direction: to where a ray enters it, or leaves it if the
// receiver is inside. The direction has an angle of this cosine and squared sine with the axis.
float distance_to_ball(SizedLight light, float cosine, float squared_sine) {
    float half_chord = sqrt(max(light.size * light.size - light.square * squared_sine, 0.0));
    float middle = sqrt(light.square) * cosine;
    return light.spread == 2.0 ? middle + half_chord : middle - half_chord;
}
