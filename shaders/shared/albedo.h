// Coordinates in the directional albedo table (engine/tables/albedo.h).
#ifndef HALFLIGHT_SHARED_ALBEDO_H
#define HALFLIGHT_SHARED_ALBEDO_H

#include "shaders/shared/portable.h"

HALFLIGHT_SHARED_BEGIN

// texels along both edges of each part; the centres of the first and last are at 0 and 1
HALFLIGHT_SHARED_CONST int kAlbedoTableSize = 128;
HALFLIGHT_SHARED_CONST float kMirrorAlpha = 1e-4f;  // alpha below which lobes are perfect mirrors (SHADING.md)
HALFLIGHT_SHARED_CONST float kAlbedoKnee = 4.0f;
HALFLIGHT_SHARED_CONST float kLeastSheenRoughness = 0.07f;
HALFLIGHT_SHARED_CONST float kSheenHorizon = 0.01f;  // cosine below which the sheen levels off (SHADING.md)

// Returns coordinates in [0, 1]. x stretches the cosines around alpha, where the albedo of a smooth lobe dips; y is the
// roughness, starting at that of kMirrorAlpha.
#ifdef __cplusplus
inline
#endif
    vec2
    albedo_coordinates(float cosine, float alpha) {
    float knee = kAlbedoKnee * alpha;
    return vec2(sqrt(cosine * (1.0f + knee) / (cosine + knee)), (sqrt(alpha) - 0.01f) * (1.0f / 0.99f));
}

// Returns coordinates of the sheen, in [0, 1] for cosines in [0, 1] and roughnesses in [kLeastSheenRoughness, 1].
#ifdef __cplusplus
inline
#endif
    vec2
    sheen_coordinates(float cosine, float roughness) {
    return vec2(sqrt(cosine), sqrt((roughness - kLeastSheenRoughness) * (1.0f / (1.0f - kLeastSheenRoughness))));
}

HALFLIGHT_SHARED_END

#endif
