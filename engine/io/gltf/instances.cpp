#include "engine/io/gltf/instances.h"

#include <cmath>
#include <utility>

#include "engine/io/gltf/accessor.h"
#include "engine/scene/geometry.h"
#include "engine/scene/mesh_source.h"

namespace halflight {
namespace {

using Attributes = tinygltf::Value::Object;  // indices of accessors, by semantic

/// Returns the attributes of EXT_mesh_gpu_instancing.
const Attributes& instance_attributes(const tinygltf::Value& extension) {
    return extension.Get("attributes").Get<Attributes>();
}

/// A requested mesh.
struct MeshRequest {
    GltfMeshKey key;
    GltfPose pose;
    bool deforms;          // animations deform the mesh
    bool flattened;        // the node's transform is applied to the vertices
    bool moves = false;    // some instance moves
    bool visible = false;  // the transform of some instance leaves an area
};

/// Builder of Scene::meshes and Scene::instances. It collects all requests first, so that all deforming meshes are
/// computed at once.
class Instances {
  public:
    Instances(GltfDocument& document, const GltfNodes& nodes, GltfMeshes& meshes, GltfPoseCache& kept, Scene& scene)
        : document_(document), accessors_(document), nodes_(nodes), meshes_(meshes), kept_(kept), scene_(scene) {}

    bool used_default_material() const { return used_default_material_; }

    void add(int node) {
        const tinygltf::Node& from = node_of(node);
        if (from.mesh == kNone) return;
        if (from.skin != kNone) {
            // Joints alone place a skinned mesh (glTF 2.0, section 3.7.3.3).
            return add(node, dmat4(1), {{}, true});
        }
        const Joint world{nodes_.world[static_cast<std::size_t>(node)], nodes_.side(static_cast<std::size_t>(node))};
        const tinygltf::Value* instancing = find_extension(from.extensions, "EXT_mesh_gpu_instancing");
        if (!instancing) return place(node, world);
        const std::string element = fmt::format("nodes[{}]", node);
        warn_of_attributes(*instancing, element);
        const std::size_t count = count_instances(document_, *instancing, element);
        for (const Joint& local : instance_transforms(document_, *instancing, element, 0, count)) {
            const Joint placed{world.matrix * local.matrix, world.side * local.side};
            if (!within_float_range(placed.matrix)) document_.fail(element, "an instance's transform overflows");
            place(node, placed);
        }
    }

    /// Builds the meshes, and removes instances of meshes without triangles. Animations hide surfaces with a scale of 0
    /// (glTF 2.0, section 3.5.2). These keep instances and names, so that edits find the same objects in all poses.
    /// Meshes that no instance shows are empty.
    void finish() {
        std::map<std::size_t, Mesh> deformed = deformed_meshes();
        std::vector<int> made(requests_.size(), kNone);
        for (std::size_t i = 0; i < requests_.size(); ++i) {
            const MeshRequest& request = requests_[i];
            if (kept_.still_in_pages && !request.deforms && !request.moves) {
                made[i] = static_cast<int>(scene_.meshes.size());
                scene_.meshes.emplace_back().name = mesh_name(i);
                continue;
            }
            const bool keeps = kept_.wanted && !request.deforms && !request.flattened && !turns_tangents(request);
            const Mesh* const still = keeps ? &static_mesh(request) : nullptr;
            Mesh mesh = deformed.contains(i) ? std::move(deformed[i]) : still ? Mesh() : made_of(request);
            if ((still ? *still : mesh).triangles.empty() && !request.deforms) continue;
            if (!request.visible)
                mesh = {};
            else if (still)
                mesh = *still;
            mesh.name = mesh_name(i);
            mesh.deforms = request.deforms;
            made[i] = static_cast<int>(scene_.meshes.size());
            scene_.meshes.push_back(std::move(mesh));
        }
        for (Instance& i : scene_.instances) {
            i.mesh = made[static_cast<std::size_t>(i.mesh)];
            if (i.mesh != kNone && i.name.empty()) i.name = scene_.meshes[static_cast<std::size_t>(i.mesh)].name;
        }
        std::erase_if(scene_.instances, [](const Instance& i) { return i.mesh == kNone; });
    }

    std::size_t meshes() const { return requests_.size(); }
    bool deforms(std::size_t mesh) const { return requests_[mesh].deforms; }
    Mesh read(std::size_t mesh) {
        Mesh made = made_of(requests_[mesh]);
        made.deforms = deforms(mesh);
        return made;
    }
    Mesh all_parts(std::size_t mesh) { return GltfMeshes::all_parts(open(requests_[mesh])); }
    std::size_t file_mesh(std::size_t mesh) const { return static_cast<std::size_t>(std::get<0>(requests_[mesh].key)); }
    std::string mesh_name(std::size_t mesh) const { return meshes_.name(file_mesh(mesh)); }

  private:
    const tinygltf::Node& node_of(int node) const { return document_.model.nodes[static_cast<std::size_t>(node)]; }

    void place(int node, const Joint& world) {
        const GltfShape shape = shape_of(world.matrix);
        if (shape == GltfShape::solid || (shape == GltfShape::nothing && kept_.animated.move(node)))
            return add(node, world.matrix, {});
        if (shape == GltfShape::flat) return add(node, dmat4(1), {{world}, false});
        document_.warnings.add("its transform leaves no area, it is left out", fmt::format("nodes[{}]", node));
    }

    void warn_of_attributes(const tinygltf::Value& extension, const std::string& element) {
        for (const auto& [name, accessor] : instance_attributes(extension))
            // Names with an underscore are those of an application.
            if (!name.starts_with('_') && name != "TRANSLATION" && name != "ROTATION" && name != "SCALE")
                document_.warnings.add(fmt::format("instance attribute {} is not supported, it is ignored", name),
                                       element);
    }

    /// Adds an instance. Its mesh is the index of a request until finish() has built the meshes. The joints of a skin
    /// are added to its pose if they are needed.
    void add(int node, dmat4 object_to_world, GltfPose pose) {
        // The joints of a pose include the node's transform.
        const bool moves =
            kept_.animated.vanish(node) || (!pose.skin && pose.joints.empty() && kept_.animated.move(node));
        if (nodes_.hidden[static_cast<std::size_t>(node)])  // as if by a scale of 0
            for (int axis = 0; axis < 3; ++axis) object_to_world[axis] = dvec4(0);
        const int request = find_request(node, std::move(pose));
        requests_[static_cast<std::size_t>(request)].moves |= moves;
        requests_[static_cast<std::size_t>(request)].visible |= leaves_area(object_to_world);
        scene_.instances.push_back({node_of(node).name, request, object_to_world, node, moves});
    }

    bool turns_tangents(const MeshRequest& request) const {
        const auto mesh = static_cast<std::size_t>(std::get<0>(request.key));
        return kept_.animated.turn_tangents(document_.model.meshes[mesh]);
    }

    /// Returns whether animations change the vertices of a node's mesh.
    bool deforms(int node, const GltfPose& pose) const {
        const GltfAnimatedObjects& animated = kept_.animated;
        if (animated.morph(node)) return true;
        if (kept_.still_in_pages &&
            animated.turn_tangents(document_.model.meshes[static_cast<std::size_t>(node_of(node).mesh)]))
            return true;
        if (!pose.skin && pose.joints.empty()) return false;
        return pose.skin ? animated.bend(document_.model.skins[static_cast<std::size_t>(node_of(node).skin)])
                         : animated.move(node);
    }

    /// Returns the index of a request; equal requests share one.
    int find_request(int node, GltfPose pose) {
        const bool solid = !pose.skin && pose.joints.empty();
        if (solid && node == solid_node_) return solid_request_;  // a key holds all weights of the node
        const int request = find_by_key(node, std::move(pose));
        if (solid) solid_node_ = node, solid_request_ = request;
        return request;
    }

    int find_by_key(int node, GltfPose pose) {
        const tinygltf::Node& from = node_of(node);
        const auto& default_weights = document_.model.meshes[static_cast<std::size_t>(from.mesh)].weights;
        const std::vector<double>& weights = from.weights.empty() ? default_weights : from.weights;
        const bool flattened = !pose.skin && !pose.joints.empty();
        const bool deforms = this->deforms(node, pose);
        const GltfMeshKey key{from.mesh, from.skin, flattened ? node : kNone, weights};
        const bool apart = kept_.still_in_pages && deforms;
        const auto [known, is_new] = found_.try_emplace({key, apart}, static_cast<int>(requests_.size()));
        if (!is_new && !flattened) {
            requests_[static_cast<std::size_t>(known->second)].deforms |= deforms;
            return known->second;
        }
        if (pose.skin) pose.joints = skin_joints(static_cast<std::size_t>(from.skin));
        // Each flattened instance of a node has a mesh of its own.
        requests_.push_back({key, std::move(pose), deforms, flattened});
        return static_cast<int>(requests_.size()) - 1;
    }

    GltfUnposedMesh open(const MeshRequest& request) {
        const auto& [mesh, skin, node, weights] = request.key;
        const bool again = kept_.wanted && request.deforms;
        return meshes_.open(static_cast<std::size_t>(mesh), weights, request.pose, again ? &kept_.primitives : nullptr);
    }

    /// Returns the deformed vertices of all animated meshes, by index of the request.
    std::map<std::size_t, Mesh> deformed_meshes() {
        std::vector<std::pair<std::size_t, GltfUnposedMesh>> unposed;
        std::vector<Deformation> deformations;
        for (std::size_t i = 0; i < requests_.size(); ++i) {
            if (!requests_[i].deforms) continue;
            unposed.emplace_back(i, open(requests_[i]));
            for (const auto& part : unposed.back().second.parts) deformations.push_back(part.deformation);
        }
        std::vector<VertexArrays> moved;
        if (kept_.deformer && !deformations.empty()) moved = kept_.deformer->deform(deformations);
        std::span<VertexArrays> rest(moved);
        std::map<std::size_t, Mesh> meshes;
        for (auto& [place, mesh] : unposed) {
            const auto own = rest.first(std::min(rest.size(), mesh.parts.size()));
            rest = rest.subspan(own.size());
            meshes[place] = finish(std::move(mesh), own);
        }
        return meshes;
    }

    Mesh finish(GltfUnposedMesh unposed, std::span<VertexArrays> moved = {}) {
        used_default_material_ |= unposed.uses_default_material;
        return meshes_.finish(std::move(unposed), moved);
    }

    Mesh made_of(const MeshRequest& request) {
        GltfUnposedMesh unposed = open(request);
        const bool has_triangles = !unposed.parts.empty();
        Mesh mesh = finish(std::move(unposed));
        if (has_triangles) warn_of_collapse(request, mesh);
        return mesh;
    }

    /// Warns of a mesh that has no triangle left because of its joints. Animations hide meshes so.
    void warn_of_collapse(const MeshRequest& request, const Mesh& mesh) {
        if (mesh.triangles.empty() && request.pose.skin && !request.deforms)
            document_.warnings.add("its joints leave no area, it is left out",
                                   fmt::format("meshes[{}]", std::get<0>(request.key)));
    }

    const Mesh& static_mesh(const MeshRequest& request) {
        auto known = kept_.meshes.find(request.key);
        if (known == kept_.meshes.end()) {
            // Every pose repeats the report and the warnings of the mesh.
            GltfWarnings warnings = std::exchange(document_.warnings, {});
            SceneReport report = std::exchange(scene_.report, {});
            GltfStaticMesh made;
            GltfUnposedMesh unposed = open(request);
            made.used_default_material = unposed.uses_default_material;
            const bool has_triangles = !unposed.parts.empty();
            made.mesh = meshes_.finish(std::move(unposed));
            if (has_triangles) warn_of_collapse(request, made.mesh);
            made.warnings = std::exchange(document_.warnings, std::move(warnings));
            made.report = std::exchange(scene_.report, std::move(report));
            known = kept_.meshes.emplace(request.key, std::move(made)).first;
        }
        const GltfStaticMesh& still = known->second;
        used_default_material_ |= still.used_default_material;
        document_.warnings.add(still.warnings);
        add_report(scene_.report, still.report);
        return still.mesh;
    }

    std::vector<Joint> skin_joints(std::size_t index) const {
        const tinygltf::Skin& skin = document_.model.skins[index];
        const std::string element = fmt::format("skins[{}]", index);
        std::vector<Joint> joints;
        for (const int joint : skin.joints) {
            const auto node = static_cast<std::size_t>(joint);
            joints.push_back({nodes_.world[node], nodes_.side(node)});
        }
        if (joints.empty()) document_.fail(element, "has no joints");
        if (skin.inverseBindMatrices == kNone) return joints;
        const auto inverse = accessors_.read<mat4>(skin.inverseBindMatrices, element + ".inverseBindMatrices");
        if (inverse.size() < joints.size())
            document_.fail(element, "{} inverse bind matrices for {} joints", inverse.size(), joints.size());
        for (std::size_t i = 0; i < joints.size(); ++i) {
            const dmat4 m(inverse[i]);
            joints[i] = {joints[i].matrix * m, determinant_of(m) < 0 ? -joints[i].side : joints[i].side};
        }
        return joints;
    }

    GltfDocument& document_;
    const GltfAccessors accessors_;
    const GltfNodes& nodes_;
    GltfMeshes& meshes_;
    GltfPoseCache& kept_;
    Scene& scene_;
    std::vector<MeshRequest> requests_;
    // Index of the request of each key; those that deform are apart from others if those are in pages.
    std::map<std::pair<GltfMeshKey, bool>, int> found_;
    int solid_node_ = kNone, solid_request_ = kNone;  // last node that was neither skinned nor flattened
    bool used_default_material_ = false;
};

}  // namespace

GltfAnimatedObjects find_animated_objects(const GltfDocument& document, std::span<const AnimationChannel> channels) {
    const tinygltf::Model& model = document.model;
    const std::vector<bool> none(model.nodes.size(), false);
    GltfAnimatedObjects animated{none, none, none, std::vector<bool>(document.materials.size(), false)};
    std::vector<bool> weighted(model.meshes.size(), false);  // meshes whose default weights are driven
    std::vector<int> todo, vanishing;
    for (const AnimationChannel& channel : channels) {
        const auto target = static_cast<std::size_t>(channel.target);
        if (channel.property == AnimatedProperty::weights)
            animated.weights[target] = true;
        else if (channel.property == AnimatedProperty::mesh_weights)
            weighted[target] = true;
        else if (channel.property == AnimatedProperty::normal_map)
            animated.normal_maps[target] = true;
        else if (of_node(channel.property))
            (channel.property == AnimatedProperty::visibility ? vanishing : todo).push_back(channel.target);
    }
    for (std::size_t i = 0; i < model.nodes.size(); ++i) {
        const tinygltf::Node& node = model.nodes[i];
        if (node.mesh != kNone && node.weights.empty() && weighted[static_cast<std::size_t>(node.mesh)])
            animated.weights[i] = true;
    }
    todo.insert(todo.end(), vanishing.begin(), vanishing.end());
    for (const auto& [marks, start] : {std::pair(&animated.nodes, &todo), std::pair(&animated.switched, &vanishing)}) {
        while (!start->empty()) {
            const auto node = static_cast<std::size_t>(start->back());
            start->pop_back();
            if ((*marks)[node]) continue;
            (*marks)[node] = true;
            start->insert(start->end(), model.nodes[node].children.begin(), model.nodes[node].children.end());
        }
    }
    return animated;
}

GltfShape shape_of(const dmat4& object_to_world) {
    const double determinant = determinant_of(object_to_world);
    if (determinant != 0 && std::isfinite(determinant)) return GltfShape::solid;
    return leaves_area(object_to_world) ? GltfShape::flat : GltfShape::nothing;
}

std::vector<Joint> instance_transforms(const GltfDocument& document, const tinygltf::Value& extension,
                                       const std::string& element, std::size_t first, std::size_t count) {
    const GltfAccessors accessors(document);
    const Attributes& attributes = instance_attributes(extension);
    const auto read = [&]<class V>(const V& otherwise, const char* name, bool normalize) {
        const auto found = attributes.find(name);
        return found == attributes.end()
                   ? std::vector<V>(count, otherwise)
                   : accessors.read<V>(found->second.GetNumberAsInt(), first, count, name, normalize);
    };
    const auto translations = read(vec3(0), "TRANSLATION", false);
    const auto rotations = read(vec4(0, 0, 0, 1), "ROTATION", true);
    const auto scales = read(vec3(1), "SCALE", false);
    std::vector<Joint> transforms;
    transforms.reserve(count);
    for (std::size_t i = 0; i < count; ++i) {
        const bool finite = all_finite(translations[i]) && all_finite(vec3(rotations[i])) &&
                            std::isfinite(rotations[i].w) && all_finite(scales[i]);
        if (!finite) document.fail(element, "instance {} is not finite", first + i);
        const bool mirrors = ((scales[i].x < 0) != (scales[i].y < 0)) != (scales[i].z < 0);
        transforms.push_back({compose(translations[i], rotations[i], scales[i]), mirrors ? -1.0 : 1.0});
    }
    return transforms;
}

std::size_t count_instances(const GltfDocument& document, const tinygltf::Value& extension,
                            const std::string& element) {
    const GltfAccessors accessors(document);
    std::optional<std::size_t> count;
    for (const auto& [name, value] : instance_attributes(extension)) {
        const int accessor = value.GetNumberAsInt();
        accessors.check_data(accessor);
        if (!count) count = accessors.count(accessor);
        if (*count != accessors.count(accessor))
            document.fail(element, "instance attributes differ in number: {} and {}", *count,
                          accessors.count(accessor));
    }
    return count.value_or(0);
}

bool add_instances(GltfDocument& document, const GltfNodes& nodes, GltfMeshes& meshes, GltfPoseCache& kept,
                   Scene& scene) {
    Instances instances(document, nodes, meshes, kept, scene);
    for (const int node : nodes.shown) instances.add(node);
    instances.finish();
    return instances.used_default_material();
}

struct GltfMeshStream::State {
    Instances instances;
};

GltfMeshStream::GltfMeshStream(GltfDocument& document, const GltfNodes& nodes, GltfMeshes& meshes, GltfPoseCache& kept,
                               Scene& scene)
    : state_(std::make_unique<State>(State{Instances(document, nodes, meshes, kept, scene)})) {
    for (const int node : nodes.shown) state_->instances.add(node);
    for (Instance& instance : scene.instances)
        if (instance.name.empty()) instance.name = name(static_cast<std::size_t>(instance.mesh));
}
GltfMeshStream::~GltfMeshStream() = default;

std::size_t GltfMeshStream::meshes() const {
    return state_->instances.meshes();
}

std::string GltfMeshStream::name(std::size_t mesh) const {
    return state_->instances.mesh_name(mesh);
}

std::size_t GltfMeshStream::file_mesh(std::size_t mesh) const {
    return state_->instances.file_mesh(mesh);
}

bool GltfMeshStream::deforms(std::size_t mesh) const {
    return state_->instances.deforms(mesh);
}

Mesh GltfMeshStream::read(std::size_t mesh) {
    return state_->instances.read(mesh);
}

Mesh GltfMeshStream::all_parts(std::size_t mesh) {
    return state_->instances.all_parts(mesh);
}

}  // namespace halflight
