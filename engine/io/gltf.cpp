#include "engine/io/gltf.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <new>
#include <optional>
#include <stdexcept>
#include <tuple>
#include <utility>

#include "engine/io/gltf_accessor.h"
#include "engine/io/gltf_animation.h"
#include "engine/io/gltf_driven.h"
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

/// Materials and what they refer to, which are the same in every pose but for what take_factors() brings up to date.
struct Looks {
    std::vector<TextureImage> images;
    std::vector<Material> materials;
};

Looks load_looks(GltfDocument& document, std::vector<GltfMaterial>& materials) {
    Looks looks;
    looks.images = load_images(document, materials);
    for (GltfMaterial& m : materials) looks.materials.push_back(std::move(m.material));
    return looks;
}

/// What may be driven. Of those whose glossiness became a texture nothing of it was left to be driven.
void take_factors(Material& to, const GltfMaterial& from) {
    to.base_color = from.material.base_color;
    to.emission = from.material.emission;
    if (from.glossiness) return;
    to.metallic = from.material.metallic;
    to.roughness = from.material.roughness;
}

/// With `kept`, looks are taken from there but for what may be driven; those of the first time are left there.
Scene convert(GltfDocument& document, const std::filesystem::path& path, std::optional<Looks>* kept = nullptr) {
    Scene scene;
    scene.name = path.string();
    const GltfNodes nodes = resolve_nodes(document);
    std::vector<GltfMaterial> materials = convert_materials(document);
    GltfMeshes meshes(document, materials, scene.report);
    Instances instances(document, nodes, meshes, scene);
    for (const int node : nodes.shown) instances.add(node);
    if (kept && !*kept) {
        std::vector<GltfMaterial> loaded = materials;
        *kept = load_looks(document, loaded);
    }
    Looks looks = kept ? **kept : load_looks(document, materials);
    for (std::size_t i = 0; kept && i < materials.size(); ++i) take_factors(looks.materials[i], materials[i]);
    scene.images = std::move(looks.images);
    scene.materials = std::move(looks.materials);
    if (meshes.used_default_material()) scene.materials.emplace_back().name = "default";
    scene.cameras = convert_cameras(document, nodes);
    scene.lights = convert_lights(document, nodes);
    scene.environment = convert_environment(document);
    warn_of_left_out(scene.report, document.warnings);
    document.warnings.write_to(scene.report);
    return scene;
}

/// Calls f(); what goes wrong names the file.
template <class F>
decltype(auto) guarded(const std::filesystem::path& path, F f) {
    try {
        return f();
    } catch (const std::bad_alloc&) {
        throw Error(path.string(), "needs more memory than there is");
    } catch (const std::length_error&) {
        throw Error(path.string(), "needs more memory than there is");
    }
}

Scene validated(Scene scene, const std::filesystem::path& path) {
    try {
        validate(scene);
    } catch (const Error& e) {
        throw Error(path.string(), e.what());
    }
    return scene;
}

}  // namespace

Scene load_gltf(const std::filesystem::path& path, const GltfOptions& options) {
    return guarded(path, [&] {
        GltfDocument document = open_gltf(path, options);
        return validated(convert(document, path), path);
    });
}

struct GltfScene::State {
    State(const std::filesystem::path& p, const GltfOptions& options) : path(p), document(open_gltf(p, options)) {}

    const std::vector<Animation>& read_all() {
        if (!animations) {
            const GltfWarnings before = std::exchange(document.warnings, {});
            animations = read_animations(document);
            SceneReport report;
            document.warnings.write_to(report);
            animation_warnings = std::move(report.warnings);
            document.warnings = before;
        }
        return *animations;
    }

    /// Puts the model into the state that it has at that time.
    void pose(double seconds, Playing playing) {
        document.warnings = opening_warnings;
        for (const auto& [target, values] : at_rest) set_driven_values(document.model, target, values);
        for (const std::size_t index : playing) {
            const Animation& animation = read_all().at(index);
            for (const AnimationChannel& channel : animation.channels) drive(animation, channel, seconds);
        }
    }

    void drive(const Animation& animation, const AnimationChannel& channel, double seconds) {
        const GltfTarget target{channel.property, channel.target};
        if (!at_rest.contains(target)) at_rest[target] = driven_values(document.model, target);
        const Keyframes& keys = animation.keyframes[channel.keyframes];
        std::vector<double> values(static_cast<std::size_t>(keys.components));
        sample(keys, seconds, values);
        set_driven_values(document.model, target, values);
    }

    /// Whether these nodes and those below them carry more than cameras.
    bool carry_surfaces(std::vector<int> todo) const {
        const auto& nodes = document.model.nodes;
        std::vector<bool> carries(nodes.size(), false), visited(nodes.size(), false);
        for (const tinygltf::Skin& skin : document.model.skins)
            for (const int joint : skin.joints) carries[static_cast<std::size_t>(joint)] = true;
        while (!todo.empty()) {
            const auto index = static_cast<std::size_t>(todo.back());
            todo.pop_back();
            if (visited[index]) continue;
            visited[index] = true;
            const tinygltf::Node& n = nodes[index];
            if (carries[index] || n.mesh != kNone || find_extension(n.extensions, "KHR_lights_punctual")) return true;
            todo.insert(todo.end(), n.children.begin(), n.children.end());
        }
        return false;
    }

    std::filesystem::path path;
    GltfDocument document;
    GltfWarnings opening_warnings = document.warnings;
    std::optional<std::vector<Animation>> animations;
    std::vector<std::string> animation_warnings;
    std::optional<Looks> looks;
    // What has been driven, as the file has it.
    std::map<GltfTarget, std::vector<double>> at_rest;
};

GltfScene::GltfScene(const std::filesystem::path& path, const GltfOptions& options)
    : state_(guarded(path, [&] { return std::make_unique<State>(path, options); })) {}

GltfScene::GltfScene(GltfScene&&) noexcept = default;
GltfScene& GltfScene::operator=(GltfScene&&) noexcept = default;
GltfScene::~GltfScene() = default;

const std::vector<Animation>& GltfScene::animations() {
    return guarded(
        state_->path, [&]() -> auto& { return state_->read_all(); });
}

const std::vector<std::string>& GltfScene::animation_warnings() {
    animations();
    return state_->animation_warnings;
}

GltfDeformers GltfScene::deformers() const {
    const tinygltf::Model& model = state_->document.model;
    GltfDeformers deformers;
    for (const tinygltf::Skin& skin : model.skins) deformers.skins.push_back({skin.name, skin.joints.size()});
    for (const tinygltf::Mesh& mesh : model.meshes) {
        std::size_t targets = 0;
        for (const auto& primitive : mesh.primitives) targets = std::max(targets, primitive.targets.size());
        if (targets > 0) deformers.morphed_meshes.push_back({mesh.name, targets});
    }
    return deformers;
}

Scene GltfScene::at(double seconds, Playing playing) {
    return guarded(state_->path, [&] {
        state_->pose(seconds, playing);
        return validated(convert(state_->document, state_->path, &state_->looks), state_->path);
    });
}

Scene GltfScene::at_rest() {
    return guarded(state_->path, [&] {
        state_->pose(0, {});
        return validated(convert(state_->document, state_->path, state_->looks ? &state_->looks : nullptr),
                         state_->path);
    });
}

std::vector<Camera> GltfScene::cameras_at(double seconds, Playing playing) {
    return guarded(state_->path, [&] {
        state_->pose(seconds, playing);
        return convert_cameras(state_->document, resolve_nodes(state_->document));
    });
}

bool GltfScene::surfaces_move(Playing playing) {
    std::vector<int> driven;
    for (const std::size_t index : playing) {
        for (const AnimationChannel& channel : animations().at(index).channels) {
            if (of_material(channel.property) || of_light(channel.property)) return true;
            if (of_node(channel.property)) driven.push_back(channel.target);
        }
    }
    return state_->carry_surfaces(std::move(driven));
}

const std::vector<std::filesystem::path>& GltfScene::files() const {
    return state_->document.files;
}

}  // namespace halflight
