#include "engine/io/gltf/gltf.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <new>
#include <optional>
#include <set>
#include <stdexcept>
#include <tuple>
#include <utility>

#include "engine/core/memory_ledger.h"
#include "engine/io/gltf/accessor.h"
#include "engine/io/gltf/animation.h"
#include "engine/io/gltf/driven.h"
#include "engine/io/gltf/instances.h"
#include "engine/io/gltf/material.h"
#include "engine/io/gltf/mesh.h"
#include "engine/io/gltf/nodes.h"
#include "engine/io/gltf/size.h"

namespace halflight {
namespace {

/// Returns the factor by which a transform scales lengths, the geometric mean over its axes; 1 if it is degenerate.
double scale_of(const dmat4& world) {
    const double scale = std::cbrt(std::abs(glm::determinant(dmat3(world))));
    return scale > 0 && std::isfinite(scale) ? scale : 1;
}

/// Opens a document. Points and lines get their radius from the first node that shows their mesh, at rest.
GltfDocument open_document(const std::filesystem::path& path, const GltfOptions& options) {
    GltfDocument document = open_gltf(path, options);
    if (!(options.line_width > 0)) return document;
    const GltfWarnings before = document.warnings;
    const GltfNodes nodes = resolve_nodes(document);
    document.warnings = before;
    const std::size_t meshes = document.model.meshes.size();
    document.stroke_radii.assign(std::max<std::size_t>(meshes, 1), static_cast<float>(options.line_width / 2));
    std::vector<bool> found(meshes, false);
    for (const int node : nodes.all) {
        const auto mesh = static_cast<std::size_t>(document.model.nodes[static_cast<std::size_t>(node)].mesh);
        if (mesh >= meshes || found[mesh]) continue;
        found[mesh] = true;
        document.stroke_radii[mesh] /= static_cast<float>(scale_of(nodes.world[static_cast<std::size_t>(node)]));
    }
    return document;
}

void warn_of_left_out(const SceneReport& report, GltfWarnings& warnings) {
    if (report.point_primitives_skipped > 0)
        warnings.add(fmt::format("{} primitives of points are left out (--line-width draws them)",
                                 report.point_primitives_skipped));
    if (report.line_primitives_skipped > 0)
        warnings.add(fmt::format("{} primitives of lines are left out (--line-width draws them)",
                                 report.line_primitives_skipped));
}

/// Hands warnings to a report. Throws Error for the first fault if the options are strict.
void write_warnings(const GltfDocument& document, GltfWarnings warnings, SceneReport& report) {
    for (const int accessor : document.decoded->disordered)
        warnings.fault("its sparse indices do not ascend", fmt::format("accessors[{}]", accessor));
    if (document.options.strict) warnings.refuse_faults(document.file);
    warnings.write_to(report);
}

/// Materials of one pose, and their images, which are equal in all poses.
struct MaterialSet {
    std::optional<std::vector<TextureImage>> images;  // empty once a scene has taken them
    std::vector<Material> materials;
    GltfWarnings warnings;  // warnings about the images
};

MaterialSet load_material_set(GltfDocument& document, std::vector<GltfMaterial>& materials) {
    MaterialSet material_set;
    material_set.images = load_images(document, materials, material_set.warnings);
    for (GltfMaterial& m : materials) material_set.materials.push_back(std::move(m.material));
    return material_set;
}

/// Returns a material of another pose, with the images of `known`.
Material with_images_of(const Material& known, const GltfMaterial& from) {
    Material material = from.material;
    if (from.glossiness && known.specular_color_texture) {  // load_images() does the same for the rest pose
        material.metallic_roughness_texture = material.specular_color_texture;
        material.roughness = 1;
    }
    std::vector<int> images;
    for_each_texture(known, [&](const TextureRef& t) { images.push_back(t.image); });
    auto image = images.begin();
    for_each_texture(material, [&](TextureRef& t) { t.image = *image++; });
    return material;
}

/// Adds the buffer views of a primitive's attributes and morph targets.
void add_views(const tinygltf::Model& model, const tinygltf::Primitive& primitive, std::set<int>& views) {
    const auto add = [&](const std::map<std::string, int>& attributes) {
        for (const auto& [name, accessor] : attributes) views.merge(views_of(model, accessor));
    };
    add(primitive.attributes);
    for (const auto& target : primitive.targets) add(target);
}

/// Frees decompressed buffer views, except those that are read again.
void free_views(GltfDocument& document, const std::set<int>& again) {
    std::erase_if(document.decoded->views, [&](const auto& view) { return !again.contains(view.first); });
}
/// Frees all but those of primitives that are read again for the next pose.
void free_views(GltfDocument& document, const GltfPrimitives& kept) {
    if (document.decoded->views.empty()) return;
    std::set<int> again;
    for (const auto& [key, primitive] : kept)
        add_views(document.model, document.model.meshes[key.mesh].primitives[key.primitive], again);
    free_views(document, again);
}

/// Converts the document. `material_set` is a cache of what images decide, filled by the first call, or null. `images`
/// tells whether the scene gets its images, which are read again from the second time on.
Scene convert(GltfDocument& document, const std::filesystem::path& path, GltfPoseCache& kept,
              std::optional<MaterialSet>* material_set = nullptr, bool images = true) {
    Scene scene;
    scene.name = path.string();
    const GltfNodes nodes = resolve_nodes(document);
    std::vector<GltfMaterial> materials = convert_materials(document);
    GltfMeshes meshes(document, materials, scene.report);
    const bool default_material = add_instances(document, nodes, meshes, kept, scene);
    if (material_set && (!*material_set || (images && !(*material_set)->images))) {
        std::vector<GltfMaterial> loaded = materials;
        *material_set = load_material_set(document, loaded);
    }
    if (material_set) {
        if (images) scene.images = *std::exchange((*material_set)->images, std::nullopt);
        document.warnings.add((*material_set)->warnings);
        for (std::size_t i = 0; i < materials.size(); ++i)
            scene.materials.push_back(with_images_of((*material_set)->materials[i], materials[i]));
    } else {
        MaterialSet loaded = load_material_set(document, materials);
        scene.images = std::move(*loaded.images);
        scene.materials = std::move(loaded.materials);
        document.warnings.add(loaded.warnings);
    }
    if (default_material || kept.still_in_pages) scene.materials.emplace_back().name = "default";
    scene.cameras = convert_cameras(document, nodes);
    scene.lights = convert_lights(document, nodes);
    scene.light_profiles = document.light_profiles;
    scene.environment = document.environment;
    warn_of_left_out(scene.report, document.warnings);
    write_warnings(document, document.warnings, scene.report);
    free_views(document, kept.primitives);
    return scene;
}

/// Calls f(). Turns a lack of memory into an Error that names the file.
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

void check(const Scene& scene, const std::filesystem::path& path) {
    try {
        validate(scene);
    } catch (const Error& e) {
        throw Error(path.string(), e.what());
    }
}

Scene validated(Scene scene, const std::filesystem::path& path) {
    check(scene, path);
    return scene;
}

}  // namespace

Scene load_gltf(const std::filesystem::path& path, const GltfOptions& options) {
    return guarded(path, [&] {
        GltfDocument document = open_document(path, options);
        GltfPoseCache nothing;
        return validated(convert(document, path, nothing), path);
    });
}

namespace {

/// Returns the objects that any of the animations moves.
GltfAnimatedObjects animated_by(const GltfDocument& document, std::span<const Animation> animations) {
    std::vector<AnimationChannel> channels;
    for (const Animation& animation : animations)
        channels.insert(channels.end(), animation.channels.begin(), animation.channels.end());
    return find_animated_objects(document, channels);
}

/// Returns what the meshes of a scene for pages are made with.
GltfPoseCache marks_for_pages(GltfDocument& document) {
    GltfPoseCache marks;
    marks.still_in_pages = true;
    if (document.animations.is_null()) return marks;
    const GltfWarnings before = document.warnings;
    MemoryLedger::Entry memory;  // the keyframes, of which the targets alone are kept
    marks.animated = animated_by(document, read_animations(document, memory));
    document.warnings = before;
    return marks;
}

}  // namespace

struct GltfScene::State {
    State(const std::filesystem::path& p, const GltfOptions& options) : path(p), document(open_document(p, options)) {}

    const std::vector<Animation>& read_all() {
        if (!animations) {
            GltfWarnings before = std::exchange(document.warnings, {});
            std::vector<Animation> all = read_animations(document, animation_memory);
            const GltfWarnings found = std::exchange(document.warnings, std::move(before));
            if (document.options.strict) found.refuse_faults(document.file);
            SceneReport report;
            found.write_to(report);
            animation_warnings = std::move(report.warnings);
            animations = std::move(all);
        }
        return *animations;
    }

    /// Changes the document to its state at a time.
    void pose(double seconds, Playing playing) {
        document.warnings = opening_warnings;
        for (const auto& [target, values] : at_rest) set_driven_values(document, target, values);
        document.posed = false;
        if (document.options.strict && !playing.empty() && !checked_rest) check_rest();
        document.posed = !playing.empty();
        for (const std::size_t index : playing) {
            const Animation& animation = read_all().at(index);
            if (animation.damage) throw *animation.damage;
            for (const AnimationChannel& channel : animation.channels) drive(animation, channel, seconds);
        }
    }

    /// Throws Error for the first fault among the values that animations may set.
    void check_rest() {
        const GltfNodes nodes = resolve_nodes(document);
        convert_materials(document);
        convert_cameras(document, nodes);
        convert_lights(document, nodes);
        document.warnings.refuse_faults(document.file);
        document.warnings = opening_warnings;
        checked_rest = true;
    }

    void drive(const Animation& animation, const AnimationChannel& channel, double seconds) {
        const GltfTarget target{channel.field, channel.target};
        if (!at_rest.contains(target)) at_rest[target] = driven_values(document, target);
        const Keyframes& keys = animation.keyframes[channel.keyframes];
        std::vector<double> values(static_cast<std::size_t>(keys.components));
        sample(keys, seconds, values);
        set_driven_values(document, target, values);
    }

    GltfAnimatedObjects animated(Playing playing) {
        std::vector<AnimationChannel> channels;
        for (const std::size_t index : playing) {
            const std::vector<AnimationChannel>& more = read_all().at(index).channels;
            channels.insert(channels.end(), more.begin(), more.end());
        }
        return find_animated_objects(document, channels);
    }

    Scene posed(double seconds, Playing playing, bool images) {
        pose(seconds, playing);
        kept.wanted = true;
        kept.animated = kept.still_in_pages ? animated_by(document, read_all()) : animated(playing);
        return convert(document, path, kept, &material_set, images);
    }

    /// Returns whether the nodes, or nodes below them, carry more than cameras.
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
            if (carries[index] || n.mesh != kNone || is_light(n)) return true;
            todo.insert(todo.end(), n.children.begin(), n.children.end());
        }
        return false;
    }

    std::filesystem::path path;
    GltfDocument document;
    GltfWarnings opening_warnings = document.warnings;
    bool checked_rest = false;  // check_rest() has found no fault
    std::optional<std::vector<Animation>> animations;
    std::vector<std::string> animation_warnings;
    MemoryLedger::Entry animation_memory;
    std::optional<MaterialSet> material_set;
    GltfPoseCache kept;
    // Values of the file for every target that has been driven.
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

const std::optional<FrameRate>& GltfScene::frame_rate() const {
    return state_->document.frame_rate;
}

const std::vector<std::string>& GltfScene::variants() const {
    return state_->document.variants;
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

SceneSize GltfScene::size() {
    return guarded(state_->path, [&] {
        if (!state_->kept.still_in_pages) return measure_gltf(state_->document);
        const GltfAnimatedObjects moving = animated_by(state_->document, state_->read_all());
        return measure_gltf(state_->document, &moving);
    });
}

void GltfScene::leave_out_still() {
    state_->kept.still_in_pages = true;
}

std::vector<bool> GltfScene::driven_materials() {
    std::vector<bool> driven;
    for (const Animation& animation : animations()) {
        for (const AnimationChannel& channel : animation.channels) {
            const AnimatedProperty p = channel.property;
            if (p != AnimatedProperty::emission && p != AnimatedProperty::normal_map && p != AnimatedProperty::surface)
                continue;
            driven.resize(state_->document.materials.size(), false);
            driven[static_cast<std::size_t>(channel.target)] = true;
        }
    }
    return driven;
}

void GltfScene::put_textures_into(std::shared_ptr<TextureStore> store) {
    state_->document.options.textures = std::move(store);
}

Scene GltfScene::at(double seconds, Playing playing) {
    return guarded(state_->path, [&] { return validated(state_->posed(seconds, playing, true), state_->path); });
}

void GltfScene::pose(Scene& scene, double seconds, Playing playing) {
    guarded(state_->path, [&] {
        Scene posed = state_->posed(seconds, playing, false);
        std::swap(posed.images, scene.images);
        try {
            check(posed, state_->path);
        } catch (...) {
            std::swap(posed.images, scene.images);
            throw;
        }
        scene = std::move(posed);
    });
}

void GltfScene::deform_by(Deformer* deformer) {
    state_->kept.deformer = deformer;
}

Scene GltfScene::at_rest() {
    return guarded(state_->path, [&] {
        state_->pose(0, {});
        GltfPoseCache nothing;
        return validated(convert(state_->document, state_->path, nothing, &state_->material_set), state_->path);
    });
}

std::vector<Camera> GltfScene::cameras_at(double seconds, Playing playing) {
    return guarded(state_->path, [&] {
        state_->pose(seconds, playing);
        return convert_cameras(state_->document, resolve_nodes(state_->document));
    });
}

bool GltfScene::parts_come_and_go(Playing playing) {
    for (const std::size_t index : playing) {
        const Animation& animation = animations().at(index);
        for (const AnimationChannel& channel : animation.channels) {
            const AnimatedProperty p = channel.property;
            if (p == AnimatedProperty::visibility || (p >= AnimatedProperty::emission && p != AnimatedProperty::camera))
                return true;
            if (channel.property != AnimatedProperty::scale) continue;
            const std::vector<float>& scales = animation.keyframes[channel.keyframes].values;
            const auto [least, most] = std::ranges::minmax(scales);
            if (least <= 0 && most >= 0) return true;  // tangents of splines count as well
        }
    }
    return false;
}

std::vector<float> GltfScene::camera_cuts(std::size_t camera, Playing playing) {
    const auto& nodes = state_->document.model.nodes;
    const GltfNodes resolved = resolve_nodes(state_->document);
    std::vector<bool> above(nodes.size(), false);
    std::size_t number = 0;
    for (const int node : resolved.all)
        if (nodes[static_cast<std::size_t>(node)].camera != kNone && number++ == camera)
            for (int n = node; n != kNone; n = resolved.parents[static_cast<std::size_t>(n)])
                above[static_cast<std::size_t>(n)] = true;
    std::set<float> cuts;
    for (const std::size_t index : playing) {
        const Animation& animation = animations().at(index);
        for (const AnimationChannel& channel : animation.channels) {
            if (channel.property > AnimatedProperty::scale || !above[static_cast<std::size_t>(channel.target)])
                continue;
            const Keyframes& keys = animation.keyframes[channel.keyframes];
            const std::size_t each = keys.values.size() / keys.times.size();
            for (std::size_t i = 1; i < keys.times.size(); ++i) {
                const float* const value = &keys.values[i * each];
                const bool jumps = keys.interpolation == Interpolation::step || keys.times[i] == keys.times[i - 1];
                if (jumps && !std::equal(value, value + each, value - each)) cuts.insert(keys.times[i]);
            }
        }
    }
    return {cuts.begin(), cuts.end()};
}

SceneTree GltfScene::tree_at(double seconds, Playing playing) {
    return guarded(state_->path, [&] {
        state_->pose(seconds, playing);
        return convert_tree(state_->document, resolve_nodes(state_->document));
    });
}

bool GltfScene::surfaces_move(Playing playing) {
    std::vector<int> driven;
    for (const std::size_t index : playing) {
        for (const AnimationChannel& channel : animations().at(index).channels) {
            if (of_node(channel.property))
                driven.push_back(channel.target);
            else if (channel.property != AnimatedProperty::camera)
                return true;
        }
    }
    return state_->carry_surfaces(std::move(driven));
}

const std::vector<VersionedFile>& GltfScene::files() const {
    return state_->document.files;
}

struct GltfMeshSource::State {
    State(const std::filesystem::path& p, const GltfOptions& options)
        : path(p),
          document(open_document(p, options)),
          nodes(resolve_nodes(document)),
          materials(convert_materials(document)),
          marks(marks_for_pages(document)),
          stream(document, nodes, meshes, marks, scene),
          read_once(stream.meshes(), false) {
        scene.name = path.string();
        for (std::size_t i = 0; i < stream.meshes(); ++i) {
            Mesh& mesh = scene.meshes.emplace_back();
            mesh.name = stream.name(i);
            mesh.deforms = stream.deforms(i);
        }
        std::vector<GltfMaterial> loaded = materials;  // meshes need the texture references of the file
        MaterialSet material_set = load_material_set(document, loaded);
        scene.images = std::move(*material_set.images);
        scene.materials = std::move(material_set.materials);
        scene.materials.emplace_back().name = "default";
        document.warnings.add(material_set.warnings);
        scene.cameras = convert_cameras(document, nodes);
        scene.lights = convert_lights(document, nodes);
        scene.light_profiles = document.light_profiles;
        scene.environment = document.environment;
        check(scene, path);
        report();
    }

    SceneReport report() const {
        SceneReport all = counts;
        GltfWarnings warnings = document.warnings;
        warn_of_left_out(all, warnings);
        write_warnings(document, std::move(warnings), all);
        return all;
    }

    Mesh read(std::size_t index) {
        const bool again = read_once[index];  // the report already includes the mesh
        const SceneReport known = counts;
        GltfWarnings warnings = again ? std::exchange(document.warnings, {}) : GltfWarnings();
        free_views(document, views_of_mesh(index));
        Mesh mesh = stream.read(index);
        // Meshes that are read one after the other often share views, and each would decompress them again.
        free_views(document, views_of_mesh(index + 1));
        if (again) counts = known, document.warnings = std::move(warnings);
        read_once[index] = true;
        if (document.options.strict) report();
        try {
            validate(mesh, index, scene.materials.size());
        } catch (const Error& e) {
            throw Error(path.string(), e.what());
        }
        return mesh;
    }

    Mesh all_parts(std::size_t index) {
        const SceneReport known = counts;
        const GltfWarnings warnings = document.warnings;
        Mesh mesh = stream.all_parts(index);
        free_views(document, views_of_mesh(index + 1));
        counts = known, document.warnings = warnings;
        return mesh;
    }

    /// Returns the buffer views of a mesh; none if there is no such mesh, or if no view is compressed.
    std::set<int> views_of_mesh(std::size_t index) const {
        std::set<int> views;
        if (index >= stream.meshes() || document.compressed_views.empty()) return views;
        for (const tinygltf::Primitive& primitive : document.model.meshes[stream.file_mesh(index)].primitives) {
            add_views(document.model, primitive, views);
            if (primitive.indices != kNone) views.merge(views_of(document.model, primitive.indices));
        }
        return views;
    }

    std::filesystem::path path;
    GltfDocument document;
    GltfNodes nodes;
    std::vector<GltfMaterial> materials;
    Scene scene;
    SceneReport counts;  // what has been read, without warnings, which the document has
    GltfMeshes meshes{document, materials, counts};
    GltfPoseCache marks;
    GltfMeshStream stream;
    std::vector<bool> read_once;  // per mesh: the mesh has been read
};

GltfMeshSource::GltfMeshSource(const std::filesystem::path& path, const GltfOptions& options)
    : state_(guarded(path, [&] { return std::make_unique<State>(path, options); })) {}
GltfMeshSource::GltfMeshSource(GltfMeshSource&&) noexcept = default;
GltfMeshSource::~GltfMeshSource() = default;

const Scene& GltfMeshSource::scene() const {
    return state_->scene;
}

SceneReport GltfMeshSource::report() const {
    return state_->report();
}

std::vector<VersionedFile> GltfMeshSource::files() const {
    return state_->document.files;
}

Mesh GltfMeshSource::read(std::size_t mesh) {
    return guarded(state_->path, [&] { return state_->read(mesh); });
}

Mesh GltfMeshSource::all_parts(std::size_t mesh) {
    return guarded(state_->path, [&] { return state_->all_parts(mesh); });
}

}  // namespace halflight
