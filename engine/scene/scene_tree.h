// The nodes of a scene's file, by which edits name instances and lights. Scene has no nodes.
#pragma once

#include <string>
#include <vector>

#include "engine/core/math.h"
#include "engine/scene/material.h"

namespace halflight {

struct SceneNode {
    std::string name;      // name in the file; may be empty, and other nodes may have it, too
    int parent = kNone;    // index of the node above; kNone: none
    bool in_scene = true;  // false: another scene of the file has the node
    dmat4 to_world{1};     // affine
};

/// The nodes of a file, posed at a time.
struct SceneTree {
    std::vector<SceneNode> nodes;     // in the order of the file
    std::vector<int> light_nodes;     // node of each light of the file, in the order of Scene::lights
    std::vector<int> instance_nodes;  // node of each of Scene::instances; empty: Instance::node
};

}  // namespace halflight
