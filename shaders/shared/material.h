// Material rows (UNIT_MATERIALS, RGBA32F): kMaterialStride texels per material of Scene::materials. Texture slots hold
// a word (word.h), index of a descriptor (texture.h) or kNoTexture.
//
//   texel 0   base colour, alpha
//   texel 1   emission (unlit: 0), 1 where unlit
//   texel 2   metallic, roughness, specular, ((ior - 1) / (ior + 1))^2
//   texel 3   specular colour, transmission
//   texel 4   clearcoat, clearcoat roughness, normal scale, clearcoat normal scale
//   texel 5   alpha cutoff (kAlphaBlend: blend; 0: opaque), slots: base colour, metallic-roughness, normal
//   texel 6   slots: emission, specular, specular colour, transmission
//   texel 7   slots: clearcoat, clearcoat roughness, clearcoat normal, -
#ifndef HALFLIGHT_SHARED_MATERIAL_H
#define HALFLIGHT_SHARED_MATERIAL_H

#include "shaders/shared/portable.h"

HALFLIGHT_SHARED_BEGIN

HALFLIGHT_SHARED_CONST int kMaterialStride = 8;
HALFLIGHT_SHARED_CONST float kAlphaBlend = -1.0f;

HALFLIGHT_SHARED_END

#endif
