// glTF 2.0 scenes (.gltf with its files, .glb), told apart by content.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/core/frames.h"
#include "engine/scene/animation.h"
#include "engine/scene/deformer.h"
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
/// Extensions: KHR_animation_pointer (of nodes, weights of meshes, cameras, and what is converted of lights and
/// materials), KHR_lights_punctual, KHR_materials_{clearcoat, emissive_strength, ior, pbrSpecularGlossiness, specular,
/// transmission, unlit}, KHR_mesh_quantization, KHR_texture_transform, EXT_mesh_gpu_instancing; and one of our own, at
/// the root: HALFLIGHT_environment {"color": [r, g, b]}, constant radiance (linear Rec.709) from all around, for which
/// glTF has nothing. Others are refused where the file requires them, otherwise named in a warning.
///
/// What can be mended is, and the report says so. All else throws Error, one line that names file and element. The
/// result has passed validate().
Scene load_gltf(const std::filesystem::path& path, const GltfOptions& options = {});

/// What a file has to deform meshes by.
struct GltfDeformers {
    struct Skin {
        std::string name;
        std::size_t joints = 0;
    };
    struct MorphedMesh {
        std::string name;
        std::size_t targets = 0;
    };
    std::vector<Skin> skins;
    std::vector<MorphedMesh> morphed_meshes;  // those that have targets
};

/// A file that is read once and can be posed at any time. What it gives for a time is a function of the file, the
/// animations and that time, whatever was asked for before.
class GltfScene {
  public:
    /// Indices of animations that play, in the order in which they apply: of those that drive the same property of a
    /// node, the last one counts.
    using Playing = std::span<const std::size_t>;

    /// Reads and checks the document, as load_gltf() does. Animations and images are read when they are first needed.
    explicit GltfScene(const std::filesystem::path& path, const GltfOptions& options = {});
    GltfScene(GltfScene&&) noexcept;
    GltfScene& operator=(GltfScene&&) noexcept;
    ~GltfScene();

    /// Throws Error that names animation, channel or sampler (gltf_animation.h).
    const std::vector<Animation>& animations();
    /// Of animations(): left out channels, one line each.
    const std::vector<std::string>& animation_warnings();
    /// That the file was made for, where its extras tell: "fps" or "frame_rate" of its scene, else of its asset.
    const std::optional<FrameRate>& frame_rate() const;
    GltfDeformers deformers() const;
    /// Of skins and morph targets, nodes, cameras, lights and materials at that time, finite; without animations what
    /// load_gltf() gives. What the animations move says so (Instance::moves, Mesh::deforms), whether it is elsewhere at
    /// that time or not. Throws what that throws, also where the pose is at fault: "nodes[3]: its transform overflows".
    Scene at(double seconds, Playing playing);
    /// From now on it is the deformer that moves the vertices of meshes which animations deform (Mesh::deforms), in
    /// at() and pose(); null: the CPU. It must outlive those calls.
    void deform_by(Deformer* deformer);
    /// The same as load_gltf(). Unlike at() it keeps no copy of the images for another time.
    Scene at_rest();
    /// Makes of a scene that at() gave, or this, what at() gives for another time; images stay where they are. Throws
    /// what that throws, and leaves the scene as it was.
    void pose(Scene& scene, double seconds, Playing playing);
    /// Only the cameras of at().
    std::vector<Camera> cameras_at(double seconds, Playing playing);
    /// Whether at() gives more than other cameras as time goes by: meshes, instances, lights or materials.
    bool surfaces_move(Playing playing);
    /// That have been read so far: the scene's own first, buffers, images once at() has been called.
    const std::vector<std::filesystem::path>& files() const;

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace halflight
