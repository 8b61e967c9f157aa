// Keeps the albedo of pixels with light to filter. Others become 0.
layout(local_size_x = 8, local_size_y = 8) in;

uniform sampler2D first;
uniform sampler2D albedo;
layout(rgba32f) writeonly uniform image2D reflected;

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(reflected)))) return;
    bool good = texelFetch(first, pixel, 0).a > 0.0;
    imageStore(reflected, pixel, good ? texelFetch(albedo, pixel, 0) : vec4(0.0));
}
