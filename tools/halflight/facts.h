// What a scene holds, what was mended, and what it takes to render it.
#pragma once

#include <nlohmann/json.hpp>

#include <vector>

#include "engine/io/gltf/gltf.h"
#include "engine/scene/scene.h"
#include "renderer/memory.h"
#include "renderer/needs.h"

namespace halflight {

/// Counts: meshes, instances, triangles (stored, and with every instance counted), materials, lights, ...
nlohmann::ordered_json scene_counts(const Scene& scene);

/// What rendering the scene, with its light, takes of memory. moves: it has animations.
MemoryEstimate scene_memory(const Scene& scene, bool moves, const RenderSettings& settings, const PictureUse& use);
/// All that `halflight info SCENE` tells, but for the file itself; memory is that of a picture by the settings.
nlohmann::ordered_json scene_facts(const Scene& scene, const RenderSettings& settings, const MemoryEstimate& memory);

/// What a file has that moves: animations, skins, morph targets, and the frame rate that it
/// was made for. Damaged animations are told of in `warnings`.
nlohmann::ordered_json motion_facts(GltfScene& scene, std::vector<std::string>& warnings);

/// A list of {what, fact, bytes, can_be_kept}.
nlohmann::ordered_json left_out_json(const std::vector<LeftOut>& left_out);
/// What rendering the scene with the default settings does without.
std::vector<LeftOut> scene_left_out(const Scene& scene);

}  // namespace halflight
