// Facts about a scene for `halflight info`: contents, repairs, and the memory to render it.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include <vector>

#include "engine/io/gltf/gltf.h"
#include "engine/scene/scene.h"
#include "engine/tables/tables.h"
#include "renderer/memory.h"
#include "renderer/needs.h"

namespace halflight {

/// Returns counts of meshes, instances, triangles (stored and instanced), materials, lights and so on.
nlohmann::ordered_json scene_counts(const Scene& scene, const SceneSize& size);

/// Estimates the memory for rendering the scene with its lights. `moves`: the scene has animations.
/// `tables`: those of the scene, here and below.
MemoryEstimate scene_memory(const Scene& scene, const TraceTables& tables, bool moves, const RenderSettings& settings,
                            const PictureUse& use);
/// Returns all facts of `halflight info SCENE` except those of the file; `memory`: scene_memory() for these
/// settings.
nlohmann::ordered_json scene_facts(const Scene& scene, const TraceTables& tables, const RenderSettings& settings,
                                   const MemoryEstimate& memory);

/// Returns the moving parts of a file: animations, skins, morph targets, and the frame rate for which it was made.
/// Damaged animations are reported in `warnings`.
nlohmann::ordered_json motion_facts(GltfScene& scene, std::vector<std::string>& warnings);

/// Returns a list of {what, fact, bytes, can_be_kept}.
nlohmann::ordered_json left_out_json(const std::vector<LeftOut>& left_out);
/// Returns the parts that rendering with the default settings leaves out.
std::vector<LeftOut> scene_left_out(const Scene& scene, const TraceTables& tables);

}  // namespace halflight
