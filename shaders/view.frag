// Draws a picture for the display. With HALFLIGHT_VIEW the picture is linear and the text of ocio_view() stands above;
// without it the picture is display-encoded already. With HALFLIGHT_DIFFERENCE the absolute difference from another
// picture is drawn.
uniform sampler2D picture;
uniform sampler2D other;
uniform float exposure_scale;
layout(location = 0) out vec4 color;

void main() {
    vec3 pixel = texelFetch(picture, ivec2(gl_FragCoord.xy), 0).rgb;
    if (HALFLIGHT_DIFFERENCE != 0) {
        ivec2 there = ivec2(gl_FragCoord.xy) * textureSize(other, 0) / textureSize(picture, 0);
        pixel = abs(pixel - texelFetch(other, there, 0).rgb);
    }
#if HALFLIGHT_VIEW
    pixel = ocio_view(vec4(pixel * exposure_scale, 1.0)).rgb;
#endif
    color = vec4(pixel, 1.0);
}
