// Profiles of lights: measured intensities by direction (engine/scene/light_profile.h; rows: shaders/shared/light.h).
// Needs shaders/scene_tables.glsl.
#include "shaders/shared/light.h"
#include "shaders/shared/word.h"

// Returns number `i` of the list that begins at a texel.
float profile_number(int first, uint i) { return texelFetch(scene_lights, first + int(i >> 2))[i & 3u]; }

// A place between two entries of a list of angles.
struct ProfilePlace {
    uint lower, upper;
    float weight;  // weight of the upper one
};

// Returns the place of an angle in an ascending list of `count` angles.
ProfilePlace profile_place(int first, uint count, float angle) {
    uint lower = 0u, upper = count - 1u;
    while (upper - lower > 1u) {
        uint middle = (lower + upper) >> 1;
        bool above = profile_number(first, middle) <= angle;
        lower = above ? middle : lower;
        upper = above ? upper : middle;
    }
    float from = profile_number(first, lower), to = profile_number(first, upper);
    return ProfilePlace(lower, upper, to > from ? clamp((angle - from) / (to - from), 0.0, 1.0) : 0.0);
}

// Returns the share of the intensity that a punctual light emits in a direction, by its profile; 1 if it has none.
float profile_share(int row, vec3 leaving) {
    int header = int(word_of_float(texelFetch(scene_lights, row + 2).w));
    if (header == 0) return 1.0;
    vec4 right = texelFetch(scene_lights, header);
    float x = dot(leaving, right.xyz), y = dot(leaving, texelFetch(scene_lights, header + 1).xyz);
    float z = dot(leaving, texelFetch(scene_lights, row + 1).xyz);
    float across = sqrt(x * x + y * y);
    const float kHalfTurn = 3.14159274;  // float32 nearest pi, like 180 degrees in tables
    float v = across > 0.0 || z != 0.0 ? clamp(atan(across, z), 0.0, kHalfTurn) : 0.0;
    float h = across > 0.0 ? atan(y, x) : 0.0;
    h = h < 0.0 ? h + 2.0 * kHalfTurn : h;

    int table = int(word_of_float(right.w));
    vec4 counts = texelFetch(scene_lights, table);
    uint rows = word_of_float(counts.x), columns = word_of_float(counts.y);
    int vertical = table + 1;
    int horizontal = vertical + int((rows + 3u) >> 2);
    int shares = horizontal + int((columns + 3u) >> 2);
    ProfilePlace by_v = profile_place(vertical, rows, v), by_h = profile_place(horizontal, columns, h);
    float near = mix(profile_number(shares, by_h.lower * rows + by_v.lower),
                     profile_number(shares, by_h.lower * rows + by_v.upper), by_v.weight);
    float far = mix(profile_number(shares, by_h.upper * rows + by_v.lower),
                    profile_number(shares, by_h.upper * rows + by_v.upper), by_v.weight);
    bool lit = v >= profile_number(vertical, 0u) && v <= profile_number(vertical, rows - 1u);
    return lit ? mix(near, far, by_h.weight) : 0.0;
}
