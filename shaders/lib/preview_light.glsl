// Light of preview texels (passes/preview/preview_texels.h).

// Returns the mean of all samples; 0 if there is none.
vec3 light_of(vec4 first, vec4 second) {
    vec2 samples = max(vec2(first.a, second.a), vec2(0.0));
    vec2 shares = samples / max(samples.x + samples.y, 1e-30);
    return shares.x * first.rgb + shares.y * second.rgb;
}
