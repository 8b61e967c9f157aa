// Weights of linear RGB (ITU-R BT.709-6).
const vec3 kToLuminance = vec3(0.2126, 0.7152, 0.0722);

float luminance_of(vec3 rgb) { return dot(rgb, kToLuminance); }
