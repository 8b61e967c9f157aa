#include "engine/io/gltf.h"

#include <cmath>
#include <limits>
#include <map>
#include <new>
#include <stdexcept>
#include <tuple>

#include "engine/io/gltf_accessor.h"
#include "engine/io/gltf_material.h"
#include "engine/io/gltf_mesh.h"
#include "engine/io/gltf_nodes.h"
#include "engine/io/gltf_value.h"

namespace halflight {
namespace {

/// Fills Scene::meshes and Scene::instances.
class Instances {
  public:
    Instances(GltfDocument& document, const GltfNodes& nodes, GltfMeshes& meshes, Scene& scene)
        : document_(document), accessors_(document), nodes_(nodes), meshes_(meshes), scene_(scene) {}

    void add(int node) {
        const tinygltf::Node& from = node_of(node);
        if (from.mesh == kNone) return;
        if (from.skin != kNone) {
            // The joints alone say where a skinned mesh is (glTF 2.0, section 3.7.3.3).
            add(node, dmat4(1), {skin_joints(static_cast<std::size_t>(from.skin)), true});
            return;
        }
        const dmat4& world = nodes_.world[static_cast<std::size_t>(node)];
        const tinygltf::Value* instancing = find_extension(from.extensions, "EXT_mesh_gpu_instancing");
        if (!instancing) return place(node, world);
        const std::string element = fmt::format("nodes[{}]", node);
        for (const dmat4& local : instance_transforms(*instancing, element)) {
            if (!within_float_range(world * local)) document_.fail(element, "an instance's transform overflows");
            place(node, world * local);
        }
    }

  private:
    const tinygltf::Node& node_of(int node) const { return document_.model.nodes[static_cast<std::size_t>(node)]; }

    /// Nothing later could invert a flat transform, so what it makes is a mesh of its own.
    void place(int node, const dmat4& world) {
        const dmat3 m(world);
        const double determinant = glm::determinant(m);
        if (determinant != 0 && std::isfinite(determinant)) return add(node, world, {});
        const bool has_area = glm::cross(m[0], m[1]) != dvec3(0) || glm::cross(m[1], m[2]) != dvec3(0) ||
                              glm::cross(m[2], m[0]) != dvec3(0);
        if (has_area) return add(node, dmat4(1), {{world}, false});
        document_.warnings.add("is scaled to nothing, it is left out", fmt::format("nodes[{}]", node));
    }

    void add(int node, const dmat4& object_to_world, const GltfPose& pose) {
        const tinygltf::Node& from = node_of(node);
        const int mesh = find_mesh(node, pose);
        if (mesh == kNone) return;
        const std::string& mesh_name = scene_.meshes[static_cast<std::size_t>(mesh)].name;
        scene_.instances.push_back({from.name.empty() ? mesh_name : from.name, mesh, object_to_world, node});
    }

    /// Nodes share a mesh where nothing that goes into it differs.
    int find_mesh(int node, const GltfPose& pose) {
        const tinygltf::Node& from = node_of(node);
        const auto& default_weights = document_.model.meshes[static_cast<std::size_t>(from.mesh)].weights;
        const std::vector<double>& weights = from.weights.empty() ? default_weights : from.weights;
        const bool flattened = !pose.skin && !pose.joints.empty();
        const auto [it, is_new] = found_.try_emplace({from.mesh, from.skin, flattened ? node : kNone, weights}, kNone);
        if (!is_new && !flattened) return it->second;
        Mesh mesh = meshes_.convert(static_cast<std::size_t>(from.mesh), weights, pose);
        it->second = kNone;
        if (!mesh.triangles.empty()) {
            it->second = static_cast<int>(scene_.meshes.size());
            scene_.meshes.push_back(std::move(mesh));
        }
        return it->second;
    }

    std::vector<dmat4> skin_joints(std::size_t index) const {
        const tinygltf::Skin& skin = document_.model.skins[index];
        const std::string element = fmt::format("skins[{}]", index);
        std::vector<dmat4> joints;
        for (const int joint : skin.joints) joints.push_back(nodes_.world[static_cast<std::size_t>(joint)]);
        if (joints.empty()) document_.fail(element, "has no joints");
        if (skin.inverseBindMatrices == kNone) return joints;
        const auto inverse = accessors_.read<mat4>(skin.inverseBindMatrices, element + ".inverseBindMatrices");
        if (inverse.size() < joints.size())
            document_.fail(element, "{} inverse bind matrices for {} joints", inverse.size(), joints.size());
        for (std::size_t i = 0; i < joints.size(); ++i) joints[i] = joints[i] * dmat4(inverse[i]);
        return joints;
    }

    std::vector<dmat4> instance_transforms(const tinygltf::Value& extension, const std::string& element) const {
        const tinygltf::Value& attributes = extension.Get("attributes");
        const auto accessor = [&](const char* name) {
            return attributes.IsObject() ? integer(attributes, name, kNone) : kNone;
        };
        const int translation = accessor("TRANSLATION"), rotation = accessor("ROTATION"), scale = accessor("SCALE");
        std::size_t count = 0;
        for (const int a : {translation, rotation, scale}) {
            if (a == kNone) continue;
            if (count != 0 && accessors_.count(a) != count)
                document_.fail(element, "instance attributes differ in number: {} and {}", count, accessors_.count(a));
            count = accessors_.count(a);
        }
        const auto read = [&]<class V>(int a, const V& otherwise, const char* name, bool normalize) {
            return a == kNone ? std::vector<V>(count, otherwise) : accessors_.read<V>(a, 0, count, name, normalize);
        };
        const auto translations = read(translation, vec3(0), "TRANSLATION", false);
        const auto rotations = read(rotation, vec4(0, 0, 0, 1), "ROTATION", true);
        const auto scales = read(scale, vec3(1), "SCALE", false);
        std::vector<dmat4> transforms;
        for (std::size_t i = 0; i < count; ++i) {
            const bool finite = all_finite(translations[i]) && all_finite(vec3(rotations[i])) &&
                                std::isfinite(rotations[i].w) && all_finite(scales[i]);
            if (!finite) document_.fail(element, "instance {} is not finite", i);
            transforms.push_back(compose(translations[i], rotations[i], scales[i]));
        }
        return transforms;
    }

    using MeshKey = std::tuple<int, int, int, std::vector<double>>;  // mesh, skin, flattened node, weights

    GltfDocument& document_;
    const GltfAccessors accessors_;
    const GltfNodes& nodes_;
    GltfMeshes& meshes_;
    Scene& scene_;
    std::map<MeshKey, int> found_;
};

Environment convert_environment(const GltfDocument& document) {
    Environment environment;
    const tinygltf::Value* extension = find_extension(document.model.extensions, "HALFLIGHT_environment");
    if (!extension) return environment;
    environment.name = "HALFLIGHT_environment";
    environment.color = vec3(vector(*extension, "color", dvec3(0)));
    if (!all_finite(environment.color) || glm::any(glm::lessThan(environment.color, vec3(0))))
        document.fail("extensions.HALFLIGHT_environment", "color is negative or not finite");
    return environment;
}

void warn_of_left_out(const SceneReport& report, GltfWarnings& warnings) {
    if (report.point_primitives_skipped > 0)
        warnings.add(fmt::format("{} primitives of points are left out", report.point_primitives_skipped));
    if (report.line_primitives_skipped > 0)
        warnings.add(fmt::format("{} primitives of lines are left out", report.line_primitives_skipped));
}

Scene convert(GltfDocument& document, const std::filesystem::path& path) {
    Scene scene;
    scene.name = path.string();
    const GltfNodes nodes = resolve_nodes(document);
    std::vector<GltfMaterial> materials = convert_materials(document);
    GltfMeshes meshes(document, materials, scene.report);
    Instances instances(document, nodes, meshes, scene);
    for (const int node : nodes.shown) instances.add(node);
    scene.images = load_images(document, materials);
    for (GltfMaterial& m : materials) scene.materials.push_back(std::move(m.material));
    if (meshes.used_default_material()) scene.materials.emplace_back().name = "default";
    scene.cameras = convert_cameras(document, nodes);
    scene.lights = convert_lights(document, nodes);
    scene.environment = convert_environment(document);
    warn_of_left_out(scene.report, document.warnings);
    document.warnings.write_to(scene.report);
    return scene;
}

}  // namespace

Scene load_gltf(const std::filesystem::path& path, const GltfOptions& options) {
    try {
        GltfDocument document = open_gltf(path, options);
        Scene scene = convert(document, path);
        try {
            validate(scene);
        } catch (const Error& e) {
            throw Error(path.string(), e.what());
        }
        return scene;
    } catch (const std::bad_alloc&) {
        throw Error(path.string(), "needs more memory than there is");
    } catch (const std::length_error&) {
        throw Error(path.string(), "needs more memory than there is");
    }
}

}  // namespace halflight
