// The G-buffer: the surface that a path's camera ray hits, as rows of vec4 at the path's index. It has only the rows
// that the scene's materials need.
//
//   row 0   position relative to TraceTables::origin; distance of new rays' origins along the geometric normal
//   row 1   emission towards the camera (of the environment if there is no surface); lift of the position, or -1
//           if there is no surface, or -2 if the ray met a shadow catcher, which counts as none
//   row 2   geometric normal on the camera's side, or the smooth surface's if the position is lifted; P_d
//   row 3   shading normal; alpha
//   row 4   diffuse albedo; probability of transmission
//   with HALFLIGHT_GLOSSY and others: pack_bsdf() in shaders/lib/bsdf_record.glsl
//   with HALFLIGHT_LIGHT_LINKS, the last row: class of the object (shaders/shared/light_links.h), as a word
// The names are those of struct Bsdf. record_rows() in engine/scene/material_properties.h returns the number of rows.
#pragma once

#include "shaders/shared/portable.h"

HALFLIGHT_SHARED_BEGIN

HALFLIGHT_SHARED_CONST int kBsdfRow = 2;           // first row of pack_bsdf()
HALFLIGHT_SHARED_CONST int kLeastSurfaceRows = 5;  // rows of every record

HALFLIGHT_SHARED_END
