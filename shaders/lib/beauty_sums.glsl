// Sums of the light of a band's samples, and their beauty.
layout(std430) readonly buffer Emission { double emission[]; };  // rgb, coverage
#if HALFLIGHT_DIRECT
layout(std430) readonly buffer Direct { double direct[]; };  // diffuse rgb, glossy rgb
#endif
#if HALFLIGHT_INDIRECT
layout(std430) readonly buffer Indirect { double indirect[]; };  // diffuse rgb, glossy rgb
#endif

double beauty_sum(uint path, uint channel) {
    double sum = emission[path * 4u + channel];
#if HALFLIGHT_DIRECT
    sum += direct[path * 6u + channel] + direct[path * 6u + 3u + channel];
#endif
#if HALFLIGHT_INDIRECT
    sum += indirect[path * 6u + channel] + indirect[path * 6u + 3u + channel];
#endif
    return sum;
}
