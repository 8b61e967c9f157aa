// Loading of glTF 2.0 scenes (.gltf with its files, .glb); the format is detected by content.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/core/frames.h"
#include "engine/core/versioned_file.h"
#include "engine/scene/animation.h"
#include "engine/scene/deformer.h"
#include "engine/scene/mesh_source.h"
#include "engine/scene/scene.h"
#include "engine/scene/scene_size.h"
#include "engine/scene/scene_tree.h"

namespace halflight {

class TextureStore;

/// Limits for the contents of a file.
struct GltfOptions {
    std::uint64_t max_json_bytes = 0xffffffffu;  // bytes of the JSON, which is parsed in memory
    int max_image_side = 16384;                  // texels along an edge
    bool allow_outside_folder = false;           // whether URIs may point outside the scene's folder
    bool strict = false;                       // refuses what the loader otherwise reads with a warning (docs/gltf.md)
    bool mip_levels = false;                   // whether textures get mip levels
    bool straight_glass = false;               // sets Material::straight_shadows of all materials
    std::string variant{};                     // variant of KHR_materials_variants; empty: the file's own materials
    double line_width = 0;                     // diameter of points and lines, world units; 0: they are left out
    std::shared_ptr<TextureStore> textures{};  // takes the texels of all images; null: they stay in memory
};

/// Loads the default scene in its rest pose. A file without a default gives its first scene; one without scenes gives
/// all root nodes. Morph targets and skins are applied; skinned meshes are in world space. Nodes that share a mesh
/// become instances of one Mesh.
///
/// docs/gltf.md lists the supported extensions. Our own root extension HALFLIGHT_environment {"color": [r, g, b]} is a
/// constant radiance (linear Rec.709) from all directions, which glTF lacks. Extensions that are not supported are
/// refused if the file requires them, otherwise named in a warning.
///
/// Repairs are made where possible and reported. Everything else throws Error, one line that names file and element.
/// The result has passed validate().
Scene load_gltf(const std::filesystem::path& path, const GltfOptions& options = {});

/// Data of a file for deforming meshes.
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
    std::vector<MorphedMesh> morphed_meshes;  // meshes with targets
};

/// A file that is read once and can be posed at any time. A pose is a function of the file, the animations and the
/// time, not of earlier poses.
class GltfScene {
  public:
    /// Indices of playing animations, in the order in which they apply: the last animation of a property wins.
    using Playing = std::span<const std::size_t>;

    /// Reads and checks the document like load_gltf(). Animations and images are read when first needed.
    explicit GltfScene(const std::filesystem::path& path, const GltfOptions& options = {});
    GltfScene(GltfScene&&) noexcept;
    GltfScene& operator=(GltfScene&&) noexcept;
    ~GltfScene();

    /// Reads the animations. Damaged ones are marked (Animation::damage), and cannot play.
    const std::vector<Animation>& animations();
    /// Returns the ignored channels and other faults of animations() that can play, one line each.
    const std::vector<std::string>& animation_warnings();
    /// Returns the frame rate for which the file was made, from its extras: "fps" or "frame_rate" of its scene, else of
    /// its asset.
    const std::optional<FrameRate>& frame_rate() const;
    /// Returns the names of the material variants (GltfOptions::variant).
    const std::vector<std::string>& variants() const;
    GltfDeformers deformers() const;
    /// Returns the size that at_rest() will have, from headers alone (engine/io/gltf/size.h).
    SceneSize size();
    /// Makes at() and pose() leave out surfaces that no animation of the file moves, because they are in pages
    /// (engine/paging). Their instances stay, and their meshes have names only. Surfaces that some animation moves are
    /// marked (Instance::moves, Mesh::deforms) even if it does not play, and the default material is always there.
    /// size() then counts the geometry of those alone.
    void leave_out_still();
    /// Returns, per material of the file, whether some animation drives a property of it; empty without animations.
    std::vector<bool> driven_materials();
    /// Lets a store take the texels of all images, which are read later. Precondition: no images have been read.
    void put_textures_into(std::shared_ptr<TextureStore> store);
    /// Returns the scene at a time, with finite skins, morph targets, nodes, cameras, lights and materials; without
    /// animations, the scene of load_gltf(). Animated parts are marked (Instance::moves, Mesh::deforms), even if they
    /// are at rest at that time. Throws what load_gltf() throws, also for an invalid pose: "nodes[3]: its transform
    /// overflows". Images are read anew by every call but the first.
    Scene at(double seconds, Playing playing);
    /// Makes a deformer move the vertices of animated meshes (Mesh::deforms) in at() and pose(); null: the CPU. It must
    /// outlive those calls.
    void deform_by(Deformer* deformer);
    /// Returns the scene of load_gltf(), and keeps nothing for other times.
    Scene at_rest();
    /// Changes a scene of at() or pose() to another time; images are kept. Throws what at() throws, and then leaves the
    /// scene unchanged.
    void pose(Scene& scene, double seconds, Playing playing);
    /// Returns only the cameras of at().
    std::vector<Camera> cameras_at(double seconds, Playing playing);
    /// Returns whether animations may let parts of the scene appear or vanish: lights, emission, lobes of materials, or
    /// surfaces, which are gone at a scale of 0.
    bool parts_come_and_go(Playing playing);
    /// Returns the times at which a camera of at() jumps, rising: those of keys where the transform of a node above it
    /// changes at once.
    std::vector<float> camera_cuts(std::size_t camera, Playing playing);
    /// Returns the nodes of at().
    SceneTree tree_at(double seconds, Playing playing);
    /// Returns whether anything but cameras changes over time: meshes, instances, lights or materials.
    bool surfaces_move(Playing playing);
    /// Returns the files opened so far: the scene's own first, then buffers, and images once at() has been called.
    const std::vector<VersionedFile>& files() const;

  private:
    struct State;
    std::unique_ptr<State> state_;
};

/// The scene of load_gltf(), whose meshes are read one by one.
class GltfMeshSource final : public MeshSource {
  public:
    /// Reads everything but meshes. Surfaces that some animation moves are marked (Instance::moves, Mesh::deforms), and
    /// share no mesh with those that deform. Throws what load_gltf() and GltfScene::animations() throw.
    explicit GltfMeshSource(const std::filesystem::path& path, const GltfOptions& options = {});
    GltfMeshSource(GltfMeshSource&&) noexcept;
    ~GltfMeshSource() override;

    /// Returns the scene. It has a default material after the others whether triangles have it or not.
    const Scene& scene() const override;
    SceneReport report() const override;
    std::vector<VersionedFile> files() const override;
    Mesh read(std::size_t mesh) override;
    Mesh all_parts(std::size_t mesh) override;

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace halflight
