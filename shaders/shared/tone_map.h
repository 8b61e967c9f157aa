// View transforms that OpenColorIO has no transform for (engine/color/view.cpp). Both map linear Rec.709, white at 1,
// to linear Rec.709. The result of AgX may lie outside [0, 1] for saturated colours; the display cuts it off.
#pragma once

#include "shaders/shared/portable.h"

HALFLIGHT_SHARED_BEGIN

// Returns Khronos PBR Neutral (PBR_Neutral/README.md in github.com/KhronosGroup/ToneMapping), whose names these are. It
// is made for colours >= 0; negative channels become 0.
HALFLIGHT_SHARED_FUNCTION vec3 pbr_neutral(vec3 colour) {
    float f90 = 0.04f;                                   // reflectance of dielectrics at normal incidence
    float ks = 0.8f - f90;                               // peak where compression starts
    float kd = 0.15f;                                    // speed of desaturation
    colour = clamp(colour, vec3(0.0f), vec3(65504.0f));  // a look may give infinities
    float x = min(min(colour.x, colour.y), colour.z);
    colour -= x <= 2.0f * f90 ? x - x * x / (4.0f * f90) : f90;
    float p = max(max(colour.x, colour.y), colour.z);
    float pn = 1.0f - (1.0f - ks) * (1.0f - ks) / (p + 1.0f - 2.0f * ks);
    float g = 1.0f / (kd * (p - pn) + 1.0f);
    return p <= ks ? colour : mix(vec3(pn), colour * (pn / p), vec3(g));
}

// Returns the signal of AgX for a logarithmic exposure in [0, 1]. The curve is that of AgX_Default_Contrast.spi1d
// (github.com/sobotka/AgX, 2022), a sigmoid of slope 2 at the pivot with powers of 3 below and 3.25 above
// (github.com/sobotka/SB2383-Configuration-Generation, sigmoid.py). It agrees with that table to its last digit, 5e-8.
HALFLIGHT_SHARED_FUNCTION float agx_curve(float x) {
    float pivot_x = 10.0f / 16.5f;  // middle grey, 0.18
    float pivot_y = 0.5f;
    float slope = 2.0f;
    bool above = x >= pivot_x;
    float power = above ? 3.25f : 3.0f;
    float run = slope * (above ? 1.0f - pivot_x : pivot_x);
    float rise = above ? 1.0f - pivot_y : pivot_y;
    float scale = pow(pow(rise, -power) - pow(run, -power), -1.0f / power);
    float t = slope * abs(x - pivot_x) / scale;
    float y = scale * t * pow(1.0f + pow(t, power), -1.0f / power);
    return pivot_y + (above ? y : -y);
}

// Returns AgX as Filament and three.js have it, which follow Blender. Primaries are moved inwards in Rec.2020, the
// curve is applied to each channel, and the primaries are moved back out. Matrices: AgXToneMapping() of three.js
// (tonemapping_pars_fragment.glsl.js). Its polynomial for the curve is off by 6e-3; this is the curve itself.
HALFLIGHT_SHARED_FUNCTION vec3 agx(vec3 colour) {
    colour = clamp(colour, vec3(-65504.0f), vec3(65504.0f));
    mat3 to_rec2020 = mat3(0.6274039f, 0.0690973f, 0.0163914f, 0.3292830f, 0.9195404f, 0.0880133f, 0.0433131f,
                           0.0113623f, 0.8955953f);  // ITU-R BT.2087
    mat3 to_rec709 = mat3(1.6604910f, -0.1245505f, -0.0181508f, -0.5876411f, 1.1328999f, -0.1005789f, -0.0728499f,
                          -0.0083494f, 1.1187297f);  // inverse of to_rec2020
    mat3 inset = mat3(0.856627153f, 0.137318973f, 0.111898213f, 0.0951212405f, 0.761241991f, 0.0767994186f,
                      0.0482516061f, 0.101439036f, 0.811302368f);
    mat3 outset = mat3(1.12710058f, -0.141329763f, -0.141329763f, -0.110606643f, 1.15782370f, -0.110606643f,
                       -0.0164939387f, -0.0164939387f, 1.25193641f);
    vec3 stops = log2(max(inset * (to_rec2020 * colour), vec3(1e-10f)) / 0.18f);
    vec3 x = clamp((stops + 10.0f) / 16.5f, vec3(0.0f), vec3(1.0f));  // 10 stops below middle grey, 6.5 above
    vec3 signal = outset * vec3(agx_curve(x.x), agx_curve(x.y), agx_curve(x.z));
    return to_rec709 * pow(max(signal, vec3(0.0f)), vec3(2.2f));  // the signal is for a display of gamma 2.2
}

HALFLIGHT_SHARED_END
