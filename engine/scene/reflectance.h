// What a scene's surfaces do with light, on the whole.
#pragma once

#include "engine/scene/scene.h"

namespace halflight {

/// Share, 0 to 1, of the area of all surfaces at which light is reflected by metal or transmitted instead of scattered
/// diffusely; by the materials' factors and the means of their textures. What lies above a diffuse base, a dielectric's
/// own reflection or a coat, does not count; areas of instances are as if they were scaled evenly. 0 for a scene
/// without area.
double glossy_share(const Scene& scene);

}  // namespace halflight
