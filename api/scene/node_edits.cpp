#include "api/scene/node_edits.h"

#include <algorithm>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <map>
#include <utility>

#include "api/halflight/object_names.h"
#include "engine/core/error.h"
#include "engine/scene/geometry.h"

namespace halflight {
namespace {

bool invertible(const dmat4& m) {
    const double determinant = glm::determinant(dmat3(m));
    return is_affine(m) && determinant != 0 && std::isfinite(determinant);
}

/// Returns scaling, rotation and translation of an edit about a point, from world to world space.
dmat4 about(const dvec3& origin, const NodeEdit& edit) {
    dmat4 m = glm::translate(dmat4(1), origin + edit.translate);
    for (const int axis : {2, 1, 0}) {
        dvec3 around(0);
        around[axis] = 1;
        if (edit.rotate[axis] != 0) m = glm::rotate(m, glm::radians(edit.rotate[axis]), around);
    }
    return glm::translate(glm::scale(m, edit.scale), -origin);
}

/// The edit of one node.
struct NodeMotion {
    dmat4 moved{1};         // world to world
    bool absolute = false;  // the node does not follow edits of nodes above it
};

/// The motions that edits give to the nodes of a scene.
class Motions {
  public:
    /// Throws Error about `subject`, or about the source of an edit.
    Motions(const SceneEdits& edits, const Scene& scene, const SceneTree& tree, const std::string& subject)
        : tree_(tree) {
        const NamedObjects nodes = nodes_of(tree);
        const std::vector<bool> movable = movable_nodes(scene, tree);
        for (const NamedEdit<NodeEdit>& named : edits.nodes) {
            const std::string where = named.source.empty() ? subject : named.source + ": " + scene.name;
            check_values(named.edit, where);
            const std::vector<std::size_t> found = find_objects(nodes, named.name, where);
            if (std::ranges::none_of(found, [&](std::size_t index) { return movable[index]; }))
                throw Error(where,
                            "node '{}' has no surface and no light that an edit could move; edits leave cameras "
                            "and the joints of skins in place",
                            named.name);
            for (const std::size_t index : found) add(index, named.edit, where);
        }
    }
    bool empty() const { return motions_.empty(); }

    /// Returns the motion of a node with those of the nodes above it.
    NodeMotion at(int node) const {
        NodeMotion all;
        for (; node != kNone && !all.absolute; node = tree_.nodes[static_cast<std::size_t>(node)].parent) {
            const auto own = motions_.find(node);
            if (own != motions_.end()) all = {own->second.moved * all.moved, own->second.absolute};
        }
        return all;
    }
    /// Returns the matrix that replaces that of an instance which has the transform of its node; null if none does.
    const dmat4* replacement(int node, const dmat4& object_to_world) const {
        const auto own = replaced_.find(node);
        const bool same =
            own != replaced_.end() && tree_.nodes[static_cast<std::size_t>(node)].to_world == object_to_world;
        return same ? &own->second : nullptr;
    }

  private:
    void add(std::size_t index, const NodeEdit& edit, const std::string& where) {
        const dmat4& own = tree_.nodes[index].to_world;
        const int node = static_cast<int>(index);
        NodeMotion& motion = motions_[node];
        replaced_.erase(node);
        if (edit.matrix) {
            if (invertible(own))
                motion = {*edit.matrix * glm::inverse(own), true};
            else if (!leaves_area(own) && !has_light_below(node))
                motion = {dmat4(1), true};  // all surfaces are hidden
            else
                throw Error(where, "the transform of node {} has no inverse, so a matrix cannot replace it", index);
        }
        if (NodeEdit{.matrix = edit.matrix} != edit)
            motion.moved = about(dvec3(motion.moved * own[3]), edit) * motion.moved;
        else if (edit.matrix)
            replaced_[node] = *edit.matrix;  // products of matrices would be rounded
        if (!invertible(motion.moved)) throw Error(where, "the transform of node {} overflows", index);
    }

    bool has_light_below(int node) const {
        return std::ranges::any_of(tree_.light_nodes, [&](int above) {
            while (above != kNone && above != node) above = tree_.nodes[static_cast<std::size_t>(above)].parent;
            return above == node;
        });
    }

    const SceneTree& tree_;
    std::map<int, NodeMotion> motions_;
    std::map<int, dmat4> replaced_;  // nodes whose edit is a matrix alone
};

/// Objects of some names.
struct Found {
    std::vector<bool> nodes, meshes, lights;
    Found(const Scene& scene, const SceneTree& tree)
        : nodes(tree.nodes.size()), meshes(scene.meshes.size()), lights(scene.lights.size()) {}
    /// Adds objects by the kinds of find_among(): nodes, meshes, lights.
    void add(const std::vector<std::vector<std::size_t>>& objects) {
        std::vector<bool>* const lists[] = {&nodes, &meshes, &lights};
        for (std::size_t k = 0; k < objects.size(); ++k)
            for (const std::size_t i : objects[k]) (*lists[k])[i] = true;
    }
    /// Returns whether a node or a node above it is found.
    bool below(int node, const SceneTree& tree) const {
        for (; node != kNone; node = tree.nodes[static_cast<std::size_t>(node)].parent)
            if (nodes[static_cast<std::size_t>(node)]) return true;
        return false;
    }
    bool has(const Instance& instance, int node, const SceneTree& tree) const {
        return meshes[static_cast<std::size_t>(instance.mesh)] || below(node, tree);
    }
};

Found find_hidden(const SceneEdits& edits, const Scene& scene, const SceneTree& tree, const std::string& subject) {
    const NamedObjects kinds[] = {nodes_of(tree), meshes_of(scene), lights_of(scene)};
    Found hidden(scene, tree);
    for (const auto& [name, source] : edits.hidden)
        hidden.add(find_among(kinds, name, source.empty() ? subject : source + ": " + scene.name));
    return hidden;
}

Found find_catchers(const SceneEdits& edits, const Scene& scene, const SceneTree& tree, const std::string& subject) {
    const NamedObjects kinds[] = {nodes_of(tree), meshes_of(scene)};
    Found catchers(scene, tree);
    for (const auto& [name, source] : edits.catchers) {
        const std::string where = source.empty() ? subject : source + ": " + scene.name;
        const auto objects = find_among(kinds, name, where);
        catchers.add(objects);
        Found own(scene, tree);
        own.add(objects);
        bool any = false;
        for (std::size_t i = 0; i < scene.instances.size() && !any; ++i)
            any = own.has(scene.instances[i], node_of_instance(scene, tree, i), tree);
        if (!any) throw Error(where, "'{}' has no surface that could catch shadows", name);
    }
    return catchers;
}

}  // namespace

std::vector<bool> instances_below(const std::vector<std::string>& nodes, const std::vector<std::string>& names,
                                  const Scene& scene, const SceneTree& tree) {
    const NamedObjects kinds[] = {nodes_of(tree), meshes_of(scene), lights_of(scene)};
    Found found(scene, tree);
    const auto add = [&](const auto& find) {
        try {
            find();
        } catch (const Error&) {  // applying the edits reports it
        }
    };
    for (const std::string& name : nodes) add([&] { found.add({find_objects(kinds[0], name, ""), {}, {}}); });
    for (const std::string& name : names) add([&] { found.add(find_among(kinds, name, "")); });
    std::vector<bool> below(scene.instances.size());
    for (std::size_t i = 0; i < below.size(); ++i)
        below[i] = found.has(scene.instances[i], node_of_instance(scene, tree, i), tree);
    return below;
}

int node_of_instance(const Scene& scene, const SceneTree& tree, std::size_t index) {
    const int node = tree.instance_nodes.empty() ? scene.instances[index].node : tree.instance_nodes.at(index);
    return node >= 0 && static_cast<std::size_t>(node) < tree.nodes.size() ? node : kNone;
}

int node_of_light(const SceneTree& tree, std::size_t index) {
    return index < tree.light_nodes.size() ? tree.light_nodes[index] : kNone;
}

std::vector<bool> movable_nodes(const Scene& scene, const SceneTree& tree) {
    std::vector<bool> movable(tree.nodes.size());
    const auto mark = [&](int node) {
        for (; node != kNone && !movable[static_cast<std::size_t>(node)];
             node = tree.nodes[static_cast<std::size_t>(node)].parent)
            movable[static_cast<std::size_t>(node)] = true;
    };
    for (std::size_t i = 0; i < scene.instances.size(); ++i) mark(node_of_instance(scene, tree, i));
    for (std::size_t i = 0; i < scene.lights.size(); ++i) mark(node_of_light(tree, i));
    return movable;
}

MovedObjects move_objects(const SceneEdits& edits, const Scene& scene, const SceneTree& tree,
                          const std::string& subject) {
    MovedObjects result{scene.lights, {}, {}};
    if (edits.nodes.empty() && edits.hidden.empty() && edits.catchers.empty()) {
        result.instances = scene.instances;
        return result;
    }
    const Motions motions(edits, scene, tree, subject);
    const Found hidden = find_hidden(edits, scene, tree, subject);
    const Found catchers = find_catchers(edits, scene, tree, subject);
    for (std::size_t i = 0; i < result.lights.size(); ++i) {
        PunctualLight& light = result.lights[i];
        const int node = node_of_light(tree, i);
        if (hidden.lights[i] || hidden.below(node, tree)) result.hidden_lights.push_back(i);
        const dmat4 moved = motions.at(node).moved;
        if (moved == dmat4(1)) continue;
        light.position = dvec3(moved * dvec4(light.position, 1));
        const dmat3 axes(light.right, light.up, -light.direction);
        light.direction = vec3(glm::normalize(dmat3(moved) * dvec3(light.direction)));
        set_profile_axes(light, dmat3(moved) * axes);
    }
    std::vector<Instance>& instances = result.instances;
    for (std::size_t i = 0; i < scene.instances.size(); ++i) {
        Instance instance = scene.instances[i];
        const int node = node_of_instance(scene, tree, i);
        if (hidden.has(instance, node, tree)) continue;
        instance.catcher = instance.catcher || catchers.has(instance, node, tree);
        if (const dmat4* matrix = motions.replacement(node, instance.object_to_world)) {
            instance.object_to_world = *matrix;
        } else if (const dmat4 moved = motions.at(node).moved; moved != dmat4(1)) {
            instance.object_to_world = moved * instance.object_to_world;
            if (!is_affine(instance.object_to_world)) throw Error(subject, "instance {}: its transform overflows", i);
        }
        instances.push_back(std::move(instance));
    }
    return result;
}

void check_values(const NodeEdit& edit, const std::string& subject) {
    const auto check = [&](const char* what, const dvec3& v, const EditRange& range) {
        for (int i = 0; i < 3; ++i)
            if (!(v[i] >= range.lower && v[i] <= range.upper))
                throw Error(subject, "{}: {} is outside [{}, {}]", what, v[i], range.lower, range.upper);
    };
    check("translate", edit.translate, kEditPosition);
    check("rotate", edit.rotate, kEditRotation);
    check("scale", edit.scale, kEditScale);
    if (edit.scale.x == 0 || edit.scale.y == 0 || edit.scale.z == 0)
        throw Error(subject, "scale: 0 is no factor; --hide hides nodes");
    if (edit.matrix && !invertible(*edit.matrix))
        throw Error(subject, "matrix: is not finite, not affine, or has no inverse");
}

bool change_surfaces(const SceneEdits& edits) {
    return surface_edits(edits) != SceneEdits();
}

namespace {

/// Returns the part of an edit that decides where the surface of a light is, and whether it is there.
LightEdit shape_of(const LightEdit& edit) {
    LightEdit shape{.position = edit.position, .direction = edit.direction, .size = edit.size};
    shape.off = edit.off || edit.factor == 0;
    if (edit.color == vec3(0)) shape.color = edit.color;
    if (edit.intensity) shape.intensity = *edit.intensity > 0 ? 1.0f : 0.0f;
    return shape;
}

}  // namespace

SceneEdits surface_edits(const SceneEdits& edits) {
    SceneEdits part;
    for (const AddedLamp& lamp : edits.added_lights)
        if (is_area(lamp.kind)) part.added_lights.push_back({lamp.name, lamp.kind, shape_of(lamp.edit)});
    if (!part.added_lights.empty())  // patterns may find them
        for (const auto& [name, edit, source] : edits.lights)
            if (const LightEdit shape = shape_of(edit); shape != LightEdit()) part.lights.push_back({name, shape});
    part.transforms = edits.transforms;
    part.nodes = edits.nodes;
    part.catchers = edits.catchers;
    part.ground = edits.ground, part.ground_height = edits.ground_height;
    std::ranges::copy_if(edits.hidden, std::back_inserter(part.hidden), [&](const ObjectName& h) {
        return !h.name.starts_with("light:") || !part.added_lights.empty();
    });
    return part;
}

SceneTree tree_of(const Scene& scene) {
    SceneTree tree;
    const auto add = [&](const std::string& name, const dmat4& to_world) {
        tree.nodes.push_back({name, kNone, true, to_world});
        return static_cast<int>(tree.nodes.size()) - 1;
    };
    for (const Instance& instance : scene.instances)
        tree.instance_nodes.push_back(add(instance.name, instance.object_to_world));
    for (const PunctualLight& light : scene.lights)
        if (!light.of_environment)
            tree.light_nodes.push_back(add(light.name, glm::translate(dmat4(1), light.position)));
    return tree;
}

}  // namespace halflight
