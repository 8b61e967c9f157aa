// Conversion of nodes with meshes to instances, and the objects that animations move.
#pragma once

#include <algorithm>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <tuple>
#include <vector>

#include "engine/io/gltf/document.h"
#include "engine/io/gltf/mesh.h"
#include "engine/io/gltf/nodes.h"
#include "engine/scene/animation.h"

namespace halflight {

/// Objects that animations move in any pose. The lists are empty without animations.
struct GltfAnimatedObjects {
    std::vector<bool> nodes;        // per node: the node or a node above is driven
    std::vector<bool> switched;     // per node: the visibility of the node or of a node above is driven
    std::vector<bool> weights;      // per node: the weights of the node or its mesh are driven
    std::vector<bool> normal_maps;  // per material: the transform of a normal map is driven, and tangents follow

    bool move(int node) const { return !nodes.empty() && nodes[static_cast<std::size_t>(node)]; }
    bool vanish(int node) const { return !switched.empty() && switched[static_cast<std::size_t>(node)]; }
    bool morph(int node) const { return !weights.empty() && weights[static_cast<std::size_t>(node)]; }
    bool turn_tangents(const tinygltf::Mesh& mesh) const {
        return !normal_maps.empty() && std::ranges::any_of(mesh.primitives, [&](const tinygltf::Primitive& p) {
            return p.material != kNone && normal_maps[static_cast<std::size_t>(p.material)];
        });
    }
    bool bend(const tinygltf::Skin& skin) const {
        return std::ranges::any_of(skin.joints, [&](int joint) { return move(joint); });
    }
    /// Returns whether the surface of a node that has a mesh moves, deforms or gets other tangents.
    bool move_surface(const tinygltf::Model& model, int node) const {
        const tinygltf::Node& n = model.nodes[static_cast<std::size_t>(node)];
        const bool moved = n.skin == kNone ? move(node) : bend(model.skins[static_cast<std::size_t>(n.skin)]);
        return moved || vanish(node) || morph(node) || turn_tangents(model.meshes[static_cast<std::size_t>(n.mesh)]);
    }
};

using GltfMeshKey = std::tuple<int, int, int, std::vector<double>>;  // mesh, skin, flattened node, weights

/// A mesh that is equal in all poses, and its report and warnings.
struct GltfStaticMesh {
    Mesh mesh;
    bool used_default_material = false;
    SceneReport report;
    GltfWarnings warnings;
};

/// Results that are kept for other poses.
struct GltfPoseCache {
    bool wanted = false;  // whether other poses may follow
    // Surfaces that do not move are in pages (engine/paging): their meshes have names only, and are not shared with
    // surfaces that move. `animated` then has the objects of all animations, whether they play or not.
    bool still_in_pages = false;
    GltfAnimatedObjects animated;
    std::map<GltfMeshKey, GltfStaticMesh> meshes;
    GltfPrimitives primitives;     // primitives of meshes that deform
    Deformer* deformer = nullptr;  // deformer of deforming meshes; null: deform()
};

/// Returns the objects that the channels move.
GltfAnimatedObjects find_animated_objects(const GltfDocument& document, std::span<const AnimationChannel> channels);

/// The part of a mesh that a transform leaves.
enum class GltfShape {
    solid,    // the transform is invertible: instances share the mesh
    flat,     // each instance has a mesh of its own, since no later step could invert the transform
    nothing,  // no area is left: the instance is left out, or hidden if an animation moves it
};
GltfShape shape_of(const dmat4& object_to_world);

/// Returns the transforms of the instances [first, first + count) of EXT_mesh_gpu_instancing, relative to their node.
/// Throws Error about `element` if one is not finite, or its data cannot be read.
std::vector<Joint> instance_transforms(const GltfDocument& document, const tinygltf::Value& extension,
                                       const std::string& element, std::size_t first, std::size_t count);

/// Returns the number of instances that EXT_mesh_gpu_instancing gives to a node. Throws Error about `element` if its
/// attributes differ in number, and if their data is too short.
std::size_t count_instances(const GltfDocument& document, const tinygltf::Value& extension, const std::string& element);

/// Fills Scene::meshes and Scene::instances. Returns whether some triangle has the default material.
bool add_instances(GltfDocument& document, const GltfNodes& nodes, GltfMeshes& meshes, GltfPoseCache& kept,
                   Scene& scene);

/// The meshes of a document, which are read one by one. Fills Scene::instances; Instance::mesh is an index for read().
class GltfMeshStream {
  public:
    /// The arguments are those of add_instances() and must outlive the object.
    GltfMeshStream(GltfDocument& document, const GltfNodes& nodes, GltfMeshes& meshes, GltfPoseCache& kept,
                   Scene& scene);
    ~GltfMeshStream();
    std::size_t meshes() const;  ///< Returns the number of meshes.
    std::string name(std::size_t mesh) const;
    std::size_t file_mesh(std::size_t mesh) const;  ///< Returns the index of the file's mesh that it is made of.
    bool deforms(std::size_t mesh) const;           ///< Returns Mesh::deforms.
    /// Reads a mesh; it has no triangles if add_instances() leaves it out.
    Mesh read(std::size_t mesh);
    Mesh all_parts(std::size_t mesh);  ///< Returns MeshSource::all_parts().

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace halflight
