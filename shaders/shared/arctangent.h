// The arctangent. GLSL's own one has other bits in other versions of Mesa.
#pragma once

#include "shaders/shared/portable.h"

HALFLIGHT_SHARED_BEGIN

#ifdef __cplusplus
inline float arctangent(float y, float x) {
    return std::atan2(y, x);
}
#else
// Returns the angle of (x, y) from the x axis, in [-pi, pi], with an error of 4e-6. The polynomial is that of Mesa 22.3
// (nir_builtin_builder.c), so that pictures keep their bits.
float arctangent(float y, float x) {
    const float quarter = 1.57079637;
    bool turned = x <= 0.0;  // by a quarter, which puts the cut of the angle where the quotient has its pole
    float s = turned ? abs(x) : y, t = turned ? y : abs(x);
    float scale = abs(t) >= 1e18 ? 0.25 : 1.0;  // keeps the reciprocal from being flushed to 0
    float reciprocal = 1.0 / (t * scale);
    float quotient = abs(x) == abs(y) ? 1.0 : abs(s * scale * reciprocal);
    float q = min(quotient, 1.0) / max(quotient, 1.0);
    float q2 = q * q, q3 = q2 * q, q5 = q3 * q2, q7 = q5 * q2, q9 = q7 * q2, q11 = q9 * q2;
    float angle = q * 0.9999793128310355 - q3 * 0.3326756418091246 + q5 * 0.1938924977115610 - q7 * 0.1173503194786851 +
                  q9 * 0.0536813784310406 - q11 * 0.0121323213173444;
    angle = quotient > 1.0 ? angle + (quarter - 2.0 * angle) : angle;
    angle = turned ? angle + quarter : angle;
    return min(y, reciprocal) < 0.0 ? -angle : angle;
}
#endif

HALFLIGHT_SHARED_END
