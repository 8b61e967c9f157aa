// Copies a part of a picture, and adds columns on both sides, which are copies of those at the other side.
layout(local_size_x = 8, local_size_y = 8) in;

uniform sampler2D source;
uniform ivec2 corner;  // upper left pixel of the part
uniform int columns;   // width of the part, pixels
uniform int margin;    // columns beyond either side, at most `columns`
layout(rgba32f) writeonly uniform image2D part;

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(part)))) return;
    ivec2 from = corner + ivec2((pixel.x + columns - margin) % columns, pixel.y);
    imageStore(part, pixel, texelFetch(source, from, 0));
}
