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

// The table of solid transmission has slices of equal index of refraction, kSolidTableColumns of them side by side.
HALFLIGHT_SHARED_CONST int kSolidTableSize = 24;  // texels along both edges of a slice
HALFLIGHT_SHARED_CONST int kSolidTableSlices = 32;
HALFLIGHT_SHARED_CONST int kSolidTableColumns = 5;
HALFLIGHT_SHARED_CONST int kSolidTableRows = 168;        // rows of texels
HALFLIGHT_SHARED_CONST float kSolidReflectance = 0.92f;  // largest (eta - 1) / (eta + 1), of eta = 24

// Returns coordinates of the solid transmission, in [0, 1]. Slices are dense around equal indices. eta: index of refraction beyond the surface, relative to
// that on the side of the cosine.
#ifdef __cplusplus
inline
#endif
    vec3
    solid_coordinates(float cosine, float alpha, float eta) {
    float reflectance = (eta - 1.0f) / (eta + 1.0f) * (1.0f / kSolidReflectance);
    float root = sqrt(reflectance < 0.0f ? -reflectance : reflectance);
    root = root > 1.0f ? 1.0f : root;
    return vec3(albedo_coordinates(cosine, alpha), 0.5f + (reflectance < 0.0f ? -0.5f : 0.5f) * root);
}

HALFLIGHT_SHARED_END

#endif
