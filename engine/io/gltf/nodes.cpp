#include "engine/io/gltf/nodes.h"

#include <algorithm>
#include <cmath>
#include <glm/gtc/matrix_access.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/gtc/type_ptr.hpp>
#include <limits>
#include <set>

#include "engine/io/gltf/light_profiles.h"
#include "engine/scene/deformer.h"
#include "engine/scene/light_types.h"

namespace halflight {
namespace {

std::string name(std::size_t node) {
    return fmt::format("nodes[{}]", node);
}

template <class V>
V to_vector(const std::vector<double>& values, V otherwise) {
    for (int i = 0; i < V::length() && !values.empty(); ++i) otherwise[i] = values[static_cast<std::size_t>(i)];
    return otherwise;
}

dmat4 local_matrix(GltfDocument& document, std::size_t index) {
    const tinygltf::Node& node = document.model.nodes[index];
    if (node.matrix.empty()) {
        const dvec4 rotation = to_vector(node.rotation, dvec4(0, 0, 0, 1));
        if (rotation == dvec4(0)) document.value_fault("rotation is a zero quaternion, it is ignored", name(index));
        return compose(to_vector(node.translation, dvec3(0)), rotation, to_vector(node.scale, dvec3(1)));
    }
    dmat4 m = glm::make_mat4(node.matrix.data());
    if (glm::row(m, 3) != dvec4(0, 0, 0, 1)) {
        document.warnings.fault("last row of the matrix is not 0 0 0 1, it is ignored", name(index));
        for (int column = 0; column < 4; ++column) m[column].w = column == 3 ? 1 : 0;
    }
    return m;
}

/// Returns the linear part of a node's own transform as if scales of 0 were 1. A column of zeros in its matrix stands
/// for such a scale. A matrix with such a column does not tell a mirror from a turn and counts as a turn.
dmat3 directions_of(const tinygltf::Node& node) {
    if (node.matrix.empty()) {
        dvec3 scale = to_vector(node.scale, dvec3(1));
        for (int axis = 0; axis < 3; ++axis)
            if (scale[axis] == 0) scale[axis] = 1;
        return dmat3(compose(dvec3(0), to_vector(node.rotation, dvec4(0, 0, 0, 1)), scale));
    }
    dmat3 m(glm::make_mat4(node.matrix.data()));
    for (int axis = 0; axis < 3; ++axis) {
        if (m[axis] != dvec3(0)) continue;
        m[axis] = glm::cross(m[(axis + 1) % 3], m[(axis + 2) % 3]);
    }
    return m;
}

/// Returns whether a node's own transform mirrors, with scales of 0 taken as 1.
bool mirrors(const tinygltf::Node& node) {
    if (!node.matrix.empty()) return determinant_of(dmat4(directions_of(node))) < 0;
    return std::ranges::count_if(node.scale, [](double s) { return s < 0; }) % 2 == 1;
}

/// Calls f(). If nothing uses a node, an Error becomes a warning.
template <class F>
void tolerate(GltfDocument& document, std::size_t node, F f) {
    try {
        f();
    } catch (const Error& error) {
        document.tolerate_unused("nodes", node, error);
    }
}

std::vector<int> find_parents(GltfDocument& document) {
    const auto& nodes = document.model.nodes;
    std::vector<int> parents(nodes.size(), kNone);
    for (const bool used : {true, false}) {  // parents that the scene uses come first
        for (std::size_t i = 0; i < nodes.size(); ++i) {
            if (is_used(document.uses, "nodes", i) != used) continue;
            for (const int child : nodes[i].children) {
                int& parent = parents[static_cast<std::size_t>(child)];
                if (parent == kNone)
                    parent = static_cast<int>(i);
                else
                    tolerate(document, i, [&] {
                        document.fail(name(static_cast<std::size_t>(child)),
                                      "is a child of both nodes[{}] and nodes[{}]", parent, i);
                    });
            }
        }
    }
    return parents;
}

/// Calls f(node) once for each of `roots` and all nodes below, parents first, in the file's order.
template <class F>
void walk(const GltfDocument& document, std::vector<int> roots, F f) {
    std::vector<bool> visited(document.model.nodes.size(), false);
    std::vector<int> todo(roots.rbegin(), roots.rend());
    while (!todo.empty()) {
        const auto node = static_cast<std::size_t>(todo.back());
        todo.pop_back();
        if (visited[node]) continue;
        visited[node] = true;
        f(node);
        const std::vector<int>& children = document.model.nodes[node].children;
        todo.insert(todo.end(), children.rbegin(), children.rend());
    }
}

/// Unique names of objects: own name, else the node's, else "kind[3]"; the first that is not taken.
class Names {
  public:
    std::string pick(const std::string& own, const std::string& node, const std::string& fallback) {
        for (const std::string& candidate : {own, node, fallback}) {
            if (!candidate.empty() && taken_.insert(candidate).second) return candidate;
        }
        return fallback;
    }

  private:
    std::set<std::string> taken_;
};

float to_light(double value) {
    return static_cast<float>(std::clamp(value, 0.0, double(std::numeric_limits<float>::max())));
}

/// Returns the reference of a node to a light of KHR_lights_punctual; null if it has none.
const tinygltf::Value* find_light(const tinygltf::Node& node) {
    return find_extension(node.extensions, "KHR_lights_punctual");
}

PunctualLight convert_light(GltfDocument& document, std::size_t index) {
    const tinygltf::Light& from = document.model.lights[index];
    const std::string element = fmt::format("extensions.KHR_lights_punctual.lights[{}]", index);
    PunctualLight light;
    const dvec3 intensity = from.intensity * to_vector(from.color, dvec3(1));
    light.intensity = vec3(to_light(intensity.x), to_light(intensity.y), to_light(intensity.z));
    if (dvec3(light.intensity) != dvec3(vec3(intensity)))
        document.value_fault("light intensity is negative or too large, clamped", element);
    const LightTypeRow* type = find_light_type(from.type);
    if (!type) document.fail(element, "light type '{}' is unknown", from.type);
    light.type = type->type;
    if (index < document.light_sizes.size())
        light.radius = document.light_sizes[index].radius, light.angle = document.light_sizes[index].angle;
    if (light.type != LightType::spot) return light;
    light.outer_cone = static_cast<float>(std::min(from.spot.outerConeAngle, kPi / 2));
    light.inner_cone = static_cast<float>(std::max(from.spot.innerConeAngle, 0.0));
    if (!(light.outer_cone > 0)) document.fail(element, "outerConeAngle {} is not positive", from.spot.outerConeAngle);
    if (light.inner_cone >= light.outer_cone) light.inner_cone = std::nextafter(light.outer_cone, 0.0f);
    if (light.outer_cone != float(from.spot.outerConeAngle) || light.inner_cone != float(from.spot.innerConeAngle))
        document.value_fault("cone angles are not 0 <= inner < outer <= pi/2, clamped", element);
    return light;
}

/// Returns the linear part of a node's world transform as if scales of 0 were 1: these hide surfaces, but lights and
/// cameras keep their directions.
dmat3 directions_of(const GltfDocument& document, const GltfNodes& nodes, std::size_t node) {
    dmat3 all(1);
    for (int n = static_cast<int>(node); n != kNone; n = nodes.parents[static_cast<std::size_t>(n)]) {
        all = directions_of(document.model.nodes[static_cast<std::size_t>(n)]) * all;
    }
    return all;
}

/// Returns the node's frame without its scale. It keeps the direction of -Z and the plane of Y and Z.
dmat4 camera_frame(GltfDocument& document, const GltfNodes& nodes, std::size_t node) {
    const dmat4& world = nodes.world[node];
    const auto frame_of = [&](const dmat3& m) {
        const dvec3 z = glm::normalize(m[2]), x = glm::normalize(glm::cross(m[1], z));
        return dmat4(dvec4(x, 0), dvec4(glm::cross(z, x), 0), dvec4(z, 0), world[3]);
    };
    const auto is_singular = [](const dmat4& frame) { return glm::any(glm::isnan(frame[0])); };
    dmat4 frame = frame_of(dmat3(world));
    if (is_singular(frame)) frame = frame_of(directions_of(document, nodes, node));
    if (is_singular(frame)) {
        document.warnings.add("camera's node has a singular transform, its rotation is ignored", name(node));
        frame = dmat4(1);
        frame[3] = world[3];
    }
    return frame;
}

Camera convert_camera(GltfDocument& document, std::size_t index) {
    const tinygltf::Camera& from = document.model.cameras[index];
    const std::string element = fmt::format("cameras[{}]", index);
    Camera camera;
    camera.orthographic = from.type == "orthographic";
    if (camera.orthographic) {
        const auto& o = from.orthographic;
        if (o.xmag == 0 || o.ymag == 0) document.fail(element, "xmag and ymag must not be zero");
        camera.ortho_height = 2 * std::abs(o.ymag);
        camera.aspect = std::abs(o.xmag / o.ymag);
        camera.near_plane = o.znear;
        camera.far_plane = o.zfar;
    } else {
        const auto& p = from.perspective;
        if (!(p.yfov > 0 && p.yfov < kPi)) document.fail(element, "yfov {} is not between 0 and pi", p.yfov);
        camera.vertical_fov = p.yfov;
        camera.aspect = std::max(p.aspectRatio, 0.0);
        camera.near_plane = p.znear;
        camera.far_plane = p.zfar;
    }
    if (index < document.lenses.size() && document.lenses[index].blurs()) {
        camera.lens = document.lenses[index];
        if (const std::string problem = lens_problem(camera); !problem.empty()) {
            document.warnings.add(fmt::format("{}; the lens is ignored", problem), element + ".extras");
            camera.lens = {};
        }
    }
    if (camera.near_plane < 0 || camera.far_plane < 0 ||
        (camera.far_plane != 0 && camera.far_plane <= camera.near_plane)) {
        document.value_fault("znear and zfar are not 0 <= znear < zfar, they are ignored", element);
        camera.near_plane = camera.far_plane = 0;
    }
    return camera;
}

}  // namespace

bool is_light(const tinygltf::Node& node) {
    return find_light(node) || find_profile_light(node);
}

bool within_float_range(const dmat4& m) {
    for (int i = 0; i < 16; ++i) {
        if (!(std::abs(m[i / 4][i % 4]) <= double(std::numeric_limits<float>::max()))) return false;
    }
    return true;
}

dmat4 compose(const dvec3& translation, const dvec4& rotation, const dvec3& scale) {
    const dvec4 q = rotation == dvec4(0) ? dvec4(0, 0, 0, 1) : glm::normalize(rotation);
    const dmat3 r = glm::mat3_cast(glm::dquat(q.w, q.x, q.y, q.z));
    return dmat4(dvec4(r[0] * scale.x, 0), dvec4(r[1] * scale.y, 0), dvec4(r[2] * scale.z, 0), dvec4(translation, 1));
}

GltfNodes resolve_nodes(GltfDocument& document) {
    const tinygltf::Model& model = document.model;
    GltfNodes nodes;
    nodes.parents = find_parents(document);
    const std::vector<int>& parents = nodes.parents;
    std::vector<int> roots;
    for (std::size_t i = 0; i < parents.size(); ++i) {
        if (parents[i] == kNone) roots.push_back(static_cast<int>(i));
    }

    nodes.world.resize(model.nodes.size());
    nodes.mirrored.resize(model.nodes.size());
    std::vector<bool> reached(model.nodes.size(), false);
    std::vector<bool> for_good(model.nodes.size(), false);  // hidden by a node that no animation switches
    nodes.hidden.resize(model.nodes.size());
    walk(document, roots, [&](std::size_t node) {
        reached[node] = true;
        nodes.world[node] = local_matrix(document, node);
        nodes.mirrored[node] = mirrors(model.nodes[node]);
        nodes.hidden[node] = document.visible[node] == 0;
        for_good[node] = nodes.hidden[node] && !document.switched.contains(static_cast<int>(node));
        if (parents[node] != kNone) {
            const auto parent = static_cast<std::size_t>(parents[node]);
            nodes.world[node] = nodes.world[parent] * nodes.world[node];
            nodes.mirrored[node] = nodes.mirrored[parent] != nodes.mirrored[node];
            nodes.hidden[node] = nodes.hidden[node] || nodes.hidden[parent];
            for_good[node] = for_good[node] || for_good[parent];
        }
        if (within_float_range(nodes.world[node])) return;
        tolerate(document, node, [&] { document.fail(name(node), "its transform overflows"); });
        nodes.world[node] = dmat4(1);
    });
    // Every node has at most one parent, so a node that no root reaches belongs to a cycle.
    for (std::size_t i = 0; i < reached.size(); ++i) {
        if (reached[i]) continue;
        tolerate(document, i, [&] { document.fail(name(i), "is its own ancestor"); });
        nodes.parents[i] = kNone;
        nodes.world[i] = dmat4(1);
    }

    if (!model.scenes.empty()) {
        roots = model.scenes[static_cast<std::size_t>(std::max(model.defaultScene, 0))].nodes;
        for (const int root : roots) {
            if (parents[static_cast<std::size_t>(root)] != kNone)
                document.warnings.fault("is listed in a scene, but has a parent", name(static_cast<std::size_t>(root)));
        }
    }
    walk(document, roots, [&](std::size_t node) { nodes.all.push_back(static_cast<int>(node)); });
    std::ranges::copy_if(nodes.all, std::back_inserter(nodes.shown),
                         [&](int node) { return !for_good[static_cast<std::size_t>(node)]; });
    return nodes;
}

std::vector<Camera> convert_cameras(GltfDocument& document, const GltfNodes& nodes) {
    std::vector<Camera> cameras;
    Names names;
    for (const int node : nodes.all) {
        const auto n = static_cast<std::size_t>(node);
        const tinygltf::Node& from = document.model.nodes[n];
        if (from.camera == kNone) continue;
        Camera camera = convert_camera(document, static_cast<std::size_t>(from.camera));
        camera.camera_to_world = camera_frame(document, nodes, n);
        camera.name = names.pick(document.model.cameras[static_cast<std::size_t>(from.camera)].name, from.name,
                                 fmt::format("camera{}", cameras.size()));
        cameras.push_back(std::move(camera));
    }
    return cameras;
}

std::vector<PunctualLight> convert_lights(GltfDocument& document, const GltfNodes& nodes) {
    std::vector<PunctualLight> lights;
    for (const int node : nodes.shown) {
        const auto n = static_cast<std::size_t>(node);
        const tinygltf::Node& from = document.model.nodes[n];
        if (!is_light(from)) continue;
        const tinygltf::Value *profile = find_profile_light(from), *plain = find_light(from);
        const auto index = plain ? static_cast<std::size_t>(plain->Get("light").GetNumberAsInt()) : 0;
        PunctualLight light = profile ? convert_profile_light(document, *profile, n) : convert_light(document, index);
        if (profile && plain)
            document.warnings.add("is a light twice; that of EXT_lights_ies is used, not that of KHR_lights_punctual",
                                  name(n));
        if (nodes.hidden[n]) light.intensity = vec3(0);
        light.position = nodes.world[n][3];
        dmat3 frame(nodes.world[n]);
        if (glm::any(glm::isnan(glm::normalize(frame[2])))) frame = directions_of(document, nodes, n);
        const dvec3 direction = -glm::normalize(frame[2]);
        if (!glm::any(glm::isnan(direction))) light.direction = vec3(direction);
        set_profile_axes(light, frame);
        light.name = !from.name.empty() ? from.name
                     : profile          ? name_of_profile(document, *profile)
                                        : document.model.lights[index].name;
        lights.push_back(std::move(light));
    }
    return lights;
}

SceneTree convert_tree(const GltfDocument& document, const GltfNodes& nodes) {
    SceneTree tree;
    tree.nodes.reserve(document.model.nodes.size());
    for (std::size_t i = 0; i < document.model.nodes.size(); ++i)
        tree.nodes.push_back({document.model.nodes[i].name, nodes.parents[i], false, nodes.world[i]});
    for (const int node : nodes.all) tree.nodes[static_cast<std::size_t>(node)].in_scene = true;
    std::ranges::copy_if(nodes.shown, std::back_inserter(tree.light_nodes),
                         [&](int node) { return is_light(document.model.nodes[static_cast<std::size_t>(node)]); });
    return tree;
}

}  // namespace halflight
