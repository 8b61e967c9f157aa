// NaN and infinity, tested by bits: a compiler may assume that isnan() of arithmetic is false.
bool finite(float v) { return (floatBitsToUint(v) & 0x7f800000u) != 0x7f800000u; }
bool all_finite(vec3 v) { return finite(v.x) && finite(v.y) && finite(v.z); }

const float kLargestFloat = 3.4028234663852886e38;

float not_a_number() { return uintBitsToFloat(0x7fc00000u); }
