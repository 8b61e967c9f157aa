// Coordinates in the directional albedo table (engine/tables/albedo.h).
#pragma once

#include "shaders/shared/arctangent.h"
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
HALFLIGHT_SHARED_FUNCTION vec2 albedo_coordinates(float cosine, float alpha) {
    float knee = kAlbedoKnee * alpha;
    return vec2(sqrt(cosine * (1.0f + knee) / (cosine + knee)), (sqrt(alpha) - 0.01f) * (1.0f / 0.99f));
}

// Returns coordinates of the sheen, in [0, 1] for cosines in [0, 1] and roughnesses in [kLeastSheenRoughness, 1].
HALFLIGHT_SHARED_FUNCTION vec2 sheen_coordinates(float cosine, float roughness) {
    return vec2(sqrt(cosine), sqrt((roughness - kLeastSheenRoughness) * (1.0f / (1.0f - kLeastSheenRoughness))));
}

// Returns L of the sheen's Lambda (Estevez and Kulla 2017, Production Friendly Microfacet Sheen BRDF, eq. 3 and table
// 1).
HALFLIGHT_SHARED_FUNCTION float sheen_fit(float x, float alpha) {
    float t = (1.0f - alpha) * (1.0f - alpha);
    return mix(21.5473f, 25.3245f, t) / (1.0f + mix(3.82987f, 3.32435f, t) * pow(x, mix(0.19823f, 0.16801f, t))) -
           mix(1.97760f, 1.27393f, t) * x - mix(4.32054f, 4.85967f, t);
}

HALFLIGHT_SHARED_FUNCTION float sheen_lambda(float cosine, float alpha) {
    return exp(cosine < 0.5f ? sheen_fit(cosine, alpha)
                             : 2.0f * sheen_fit(0.5f, alpha) - sheen_fit(max(1.0f - cosine, 0.0f), alpha));
}

// Texels of the anisotropic lobe's part along its coordinates: cosine, angle, roughness, strength.
HALFLIGHT_SHARED_CONST int kAnisotropyCosines = 32;
HALFLIGHT_SHARED_CONST int kAnisotropyAngles = 16;
HALFLIGHT_SHARED_CONST int kAnisotropyRoughnesses = 16;
HALFLIGHT_SHARED_CONST int kAnisotropyStrengths = 16;
HALFLIGHT_SHARED_CONST int kAnisotropyTableRows =
    kAnisotropyCosines * kAnisotropyAngles * kAnisotropyRoughnesses * kAnisotropyStrengths / kAlbedoTableSize;

// Returns coordinates of the anisotropic lobe, in [0, 1]. wo has unit length, alpha.x >= alpha.y. The cosine is
// stretched by the roughness that wo sees, and angles are dense where wo is across the rough direction.
HALFLIGHT_SHARED_FUNCTION vec4 anisotropy_coordinates(vec3 wo, vec2 alpha) {
    float along = abs(wo.x), across = abs(wo.y);
    float sine = max(sqrt(along * along + across * across), 1e-10f);
    vec2 seen = alpha * vec2(along / sine, across / sine);
    float angle = arctangent(across, max(along, 1e-20f)) * 0.636619772f;  // 2 / pi
    float strength = (alpha.x - alpha.y) / max(1.0f - alpha.y, 1e-6f);
    return vec4(albedo_coordinates(clamp(wo.z, 0.0f, 1.0f), max(length(seen), alpha.y)).x,
                1.0f - sqrt(max(1.0f - angle, 0.0f)), (sqrt(alpha.y) - 0.01f) * (1.0f / 0.99f),
                sqrt(clamp(strength, 0.0f, 1.0f)));
}

// Returns the texel of a node, in rows after the first one of the part.
HALFLIGHT_SHARED_FUNCTION ivec2 anisotropy_texel(ivec4 node) {
    int row = (node.w * kAnisotropyRoughnesses + node.z) * kAnisotropyAngles + node.y;
    int index = row * kAnisotropyCosines + node.x;
    return ivec2(index % kAlbedoTableSize, index / kAlbedoTableSize);
}

// The table of solid transmission has slices of equal index of refraction, kSolidTableColumns of them side by side.
HALFLIGHT_SHARED_CONST int kSolidTableSize = 24;  // texels along both edges of a slice
HALFLIGHT_SHARED_CONST int kSolidTableSlices = 32;
HALFLIGHT_SHARED_CONST int kSolidTableColumns = 5;
HALFLIGHT_SHARED_CONST int kSolidTableRows = 168;        // rows of texels
HALFLIGHT_SHARED_CONST float kSolidReflectance = 0.92f;  // largest (eta - 1) / (eta + 1), of eta = 24

// Returns coordinates of the solid transmission, in [0, 1]. Slices are dense around equal indices. eta: index of
// refraction beyond the surface, relative to that on the side of the cosine.
HALFLIGHT_SHARED_FUNCTION vec3 solid_coordinates(float cosine, float alpha, float eta) {
    float reflectance = (eta - 1.0f) / (eta + 1.0f) * (1.0f / kSolidReflectance);
    float root = sqrt(reflectance < 0.0f ? -reflectance : reflectance);
    root = root > 1.0f ? 1.0f : root;
    return vec3(albedo_coordinates(cosine, alpha), 0.5f + (reflectance < 0.0f ? -0.5f : 0.5f) * root);
}

HALFLIGHT_SHARED_END
