// Nodes with meshes to instances, and what of them animations move.
#pragma once

#include <algorithm>
#include <map>
#include <span>
#include <tuple>
#include <vector>

#include "engine/io/gltf/document.h"
#include "engine/io/gltf/mesh.h"
#include "engine/io/gltf/nodes.h"
#include "engine/scene/animation.h"

namespace halflight {

/// What animations move, in whatever pose; nothing where there are none.
struct GltfMovers {
    std::vector<bool> nodes;        // they, or nodes above them, are driven
    std::vector<bool> weights;      // of nodes, or of their meshes, are driven
    std::vector<bool> normal_maps;  // of materials, are moved, and tangents with them

    bool move(int node) const { return !nodes.empty() && nodes[static_cast<std::size_t>(node)]; }
    bool morph(int node) const { return !weights.empty() && weights[static_cast<std::size_t>(node)]; }
    bool turn_tangents(const tinygltf::Mesh& mesh) const {
        return !normal_maps.empty() && std::ranges::any_of(mesh.primitives, [&](const tinygltf::Primitive& p) {
            return p.material != kNone && normal_maps[static_cast<std::size_t>(p.material)];
        });
    }
    bool bend(const tinygltf::Skin& skin) const {
        return std::ranges::any_of(skin.joints, [&](int joint) { return move(joint); });
    }
};

using GltfMeshKey = std::tuple<int, int, int, std::vector<double>>;  // mesh, skin, flattened node, weights

/// A mesh that is the same in all poses, and what was to be said of it.
struct GltfStillMesh {
    Mesh mesh;
    bool used_default_material = false;
    SceneReport report;
    GltfWarnings warnings;
};

/// What need not be made again for another pose.
struct GltfKept {
    bool wanted = false;  // there may be other poses
    GltfMovers movers;
    std::map<GltfMeshKey, GltfStillMesh> meshes;
    GltfPrimitives primitives;     // of meshes that deform
    Deformer* deformer = nullptr;  // who deforms those; null: deform()
};

/// Returns what the channels move.
GltfMovers find_movers(const GltfDocument& document, std::span<const AnimationChannel> channels);

/// Fills Scene::meshes and Scene::instances. Returns whether anything has the default material.
bool add_instances(GltfDocument& document, const GltfNodes& nodes, GltfMeshes& meshes, GltfKept& kept, Scene& scene);

}  // namespace halflight
