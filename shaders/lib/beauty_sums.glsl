// Sums of the light of a band's samples, and their beauty.
const bool kDirect = HALFLIGHT_DIRECT != 0, kIndirect = HALFLIGHT_INDIRECT != 0;
layout(std430) readonly buffer Emission { double emission[]; };  // rgb, coverage
OPTIONAL(HALFLIGHT_DIRECT) layout(std430) readonly buffer Direct { double direct[]; };  // diffuse rgb, glossy rgb
OPTIONAL(HALFLIGHT_INDIRECT) layout(std430) readonly buffer Indirect { double indirect[]; };  // diffuse rgb, glossy rgb

// Returns `sum` and the light that surfaces reflect.
double with_reflected(double sum, uint path, uint channel) {
    if (kDirect) sum += direct[path * 6u + channel] + direct[path * 6u + 3u + channel];
    if (kIndirect) sum += indirect[path * 6u + channel] + indirect[path * 6u + 3u + channel];
    return sum;
}

double beauty_sum(uint path, uint channel) { return with_reflected(emission[path * 4u + channel], path, channel); }
