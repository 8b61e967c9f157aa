// Captures ray sets from the engine's own passes: sets frames up as the renderer does, and reads their rays back.
#pragma once

#include "engine/gpu/context.h"
#include "engine/gpu/program_cache.h"
#include "engine/tables/tables.h"
#include "tools/measure/bench/ray_set.h"

namespace halflight::bench {

/// Greatest number of rays of the kind `connection`; if a frame has more, evenly spread groups are taken.
inline constexpr std::size_t kConnectionRays = std::size_t{1} << 20;

/// Returns the rays of sample 0 of frame 0, rendered with seed 0: one set per kind, in the order of ray_kinds(). A set
/// is empty if the scene has no such rays. Changes `scene` and restores it. `tables` are made from `scene`, `trace`
/// from `tables`. Precondition: no material is alpha-tested.
std::vector<RaySet> capture(const gpu::Context& context, gpu::ProgramCache& programs, Scene& scene,
                            const TraceTables& tables, const rays::TraceScene& trace, const Camera& camera,
                            const ivec2& size, const std::vector<std::string>& kinds);

}  // namespace halflight::bench
