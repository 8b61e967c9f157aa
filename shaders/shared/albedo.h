// Where a cosine and an alpha lie in the directional albedo table.
#ifndef HALFLIGHT_SHARED_ALBEDO_H
#define HALFLIGHT_SHARED_ALBEDO_H

#include "shaders/shared/portable.h"

HALFLIGHT_SHARED_BEGIN

#ifdef __cplusplus
inline
#endif
vec2 albedo_coordinates(float cosine, float alpha) {
    return vec2(sqrt(cosine), sqrt(alpha));
}

HALFLIGHT_SHARED_END

#endif
