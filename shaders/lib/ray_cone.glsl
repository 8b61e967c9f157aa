// Ray cones, which choose mip levels (Akenine-Moeller et al. 2019, Texture Level of Detail Strategies for Real-Time Ray
// Tracing; Akenine-Moeller et al. 2021, Improved Shader and Texture Level of Detail Using Ray Cones). SHADING.md, Mip
// levels, has the equations.
#include "shaders/shared/frame_block.h"

const bool kTextureLevels = HALFLIGHT_TEXTURE_LEVELS != 0;  // lookups choose mip levels by cones

struct RayCone {
    float width;   // at the ray's origin, world units
    float spread;  // growth of the width per distance
};

// Share of a lobe's spread by which a scattered ray widens its cone. Rays of other samples fill the lobe, too.
const float kLobeShare = 0.25;

// Returns the cone of a camera ray: half a pixel wide, so that texels blur a pixel little.
RayCone camera_cone(Frame frame) {
    bool perspective = frame.camera_position.w != 0.0;
    return perspective ? RayCone(0.0, frame.half_pixel) : RayCone(frame.half_pixel, 0.0);
}

float cone_width(RayCone cone, float way) { return cone.width + cone.spread * way; }

// Returns the cone of a ray that is scattered at a distance from the last ray's origin. pdf: density of the direction
// in its lobe, per solid angle; 0: a mirror, which keeps the spread.
RayCone scattered_cone(RayCone last, float way, float pdf) {
    float widened = pdf > 0.0 ? min(kLobeShare * inversesqrt(pdf), 1.0) : 0.0;
    return RayCone(cone_width(last, way), last.spread + widened);
}
