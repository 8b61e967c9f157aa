// Applies the view transform, whose GLSL stands above, to a finished picture, as composite.comp does.
// HALFLIGHT_STRAIGHT_VIEW divides its colours by alpha.
layout(local_size_x = 8, local_size_y = 8) in;

uniform sampler2D picture;
layout(rgba32f) writeonly uniform image2D view;
uniform float exposure_scale;

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(view)))) return;
    vec4 mean = texelFetch(picture, pixel, 0);
    vec3 color = mean.rgb;
    if (HALFLIGHT_STRAIGHT_VIEW != 0) color = mean.a > 0.0 ? mean.rgb / mean.a : vec3(0.0);
    imageStore(view, pixel, vec4(ocio_view(vec4(color * exposure_scale, 1.0)).rgb, mean.a));
}
