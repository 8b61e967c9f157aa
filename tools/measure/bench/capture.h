// Ray sets out of the engine's own passes: frames are set up as the renderer does, and their rays read back.
#pragma once

#include "engine/gpu/context.h"
#include "engine/gpu/program.h"
#include "engine/tables/tables.h"
#include "tools/measure/bench/ray_set.h"

namespace halflight::bench {

/// Most rays of the kind `connection`: that many are some groups of a frame, evenly spread.
inline constexpr std::size_t kConnectionRays = std::size_t{1} << 20;

/// Sample 0 of frame 0, as rendered with seed 0. Sets come in the order of ray_kinds(); one for which a scene has no
/// rays is empty. `scene` is changed for a while, and as before when this returns. `trace`: of `tables`, which are
/// those of the scene. Precondition: no material is alpha-tested.
std::vector<RaySet> capture(const gpu::Context& context, gpu::ProgramCache& programs, Scene& scene,
                            const TraceTables& tables, const rays::TraceScene& trace, const Camera& camera,
                            const ivec2& size, const std::vector<std::string>& kinds);

}  // namespace halflight::bench
