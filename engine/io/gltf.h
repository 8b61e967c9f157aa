// glTF 2.0 scenes (.gltf with its files, .glb), told apart by content.
#pragma once

#include <cstdint>
#include <filesystem>

#include "engine/scene/scene.h"

namespace halflight {

/// What a file is allowed to ask for.
struct GltfOptions {
    std::uint64_t max_file_bytes = std::uint64_t{8} << 30;    // of each file
    std::uint64_t max_total_bytes = std::uint64_t{32} << 30;  // of all of them
    int max_image_side = 16384;                               // texels
    bool allow_outside_folder = false;                        // whether URIs may leave the scene's folder
};

/// The default scene (the first where none is named, all root nodes where there is none), at the pose that its nodes
/// and default morph weights give: morph targets and skins are applied, skinned meshes are in world space. Nodes that
/// share a mesh become instances of one Mesh.
///
/// Extensions: KHR_lights_punctual, KHR_materials_{clearcoat, emissive_strength, ior, pbrSpecularGlossiness, specular,
/// transmission, unlit}, KHR_mesh_quantization, KHR_texture_transform, EXT_mesh_gpu_instancing; and one of our own, at
/// the root: HALFLIGHT_environment {"color": [r, g, b]}, constant radiance (linear Rec.709) from all around, for which
/// glTF has nothing. Others are refused
/// where the file requires them, otherwise named in a warning.
///
/// What can be mended is, and the report says so. All else throws Error, one line that names file and element. The
/// result has passed validate().
Scene load_gltf(const std::filesystem::path& path, const GltfOptions& options = {});

}  // namespace halflight
