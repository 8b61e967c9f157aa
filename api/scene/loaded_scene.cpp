#include "api/halflight/loaded_scene.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <utility>

#include "api/first_picture/default_camera.h"
#include "api/scene/added_surfaces.h"
#include "api/scene/blocked_light.h"
#include "api/scene/light_groups.h"
#include "api/scene/node_edits.h"
#include "api/scene/paged_edits.h"
#include "api/scene/scene_cache.h"
#include "engine/core/cache_folder.h"
#include "engine/core/error.h"
#include "engine/core/release.h"
#include "engine/io/gltf/parts.h"
#include "engine/io/texture_store.h"
#include "engine/paging/moving_pages.h"
#include "engine/paging/page_file.h"
#include "engine/scene/framing.h"
#include "engine/scene/material_lobes.h"
#include "engine/tables/table_rows.h"
#include "renderer/memory.h"
#include "shaders/shared/texture_rows.h"

namespace halflight {

/// State of the scene before any edit.
struct LoadedScene::Unedited {
    std::vector<Material> materials;
    std::vector<PunctualLight> lights;
    std::vector<Instance> instances;
    Environment environment;
    void take_surfaces(const Scene& scene) {
        materials = scene.materials;
        lights = scene.lights;
        instances = scene.instances;
    }
    void give_surfaces(Scene& scene) const {
        scene.materials = materials;
        scene.lights = lights;
        scene.instances = instances;
    }
};

GltfOptions gltf_options(const SceneChoice& choice) {
    GltfOptions options;
    options.allow_outside_folder = choice.allow_outside;
    options.strict = choice.strict_scene;
    options.variant = choice.variant;
    options.line_width = choice.line_width;
    options.mip_levels = choice.mip_levels;
    return options;
}

namespace {

std::set<double> key_frames(const EditKeys& keys) {
    std::set<double> frames;
    for (const EditTrack& track : keys.tracks)
        for (const EditTrack::Key& key : track.keys) frames.insert(key.frame);
    return frames;
}

/// Returns whether edits change surfaces, by themselves or at a key.
bool change_surfaces_ever(const SceneChoice& choice) {
    const auto at_key = [&](double frame) {
        SceneEdits edits = choice.edits;
        apply_keys(choice.keys, frame, edits);
        return change_surfaces(edits);
    };
    return change_surfaces(choice.edits) || std::ranges::any_of(key_frames(choice.keys), at_key);
}

}  // namespace

void load_whole_or_paged(const SceneChoice& choice, const std::function<void()>& whole,
                         const std::function<void()>& paged) {
    const bool list = is_part_list(choice.scene);
    if (list && choice.in_memory) throw Error(choice.scene.string(), "is a list of files, which needs a page file");
    if (list || !choice.pages.empty()) return paged();
    try {
        whole();
    } catch (const BudgetError&) {
        if (choice.in_memory || !choice.variant.empty() || choice.line_width > 0 || change_surfaces_ever(choice)) throw;
        paged();
    }
}

void check_fits(const SceneSize& size, const std::filesystem::path& file, std::size_t picture_bytes) {
    const std::size_t scene = scene_bytes(size), rest = scene - size.contents();
    const bool decoding = size.decoding_bytes > 0 && rest == size.decoding_bytes;
    MemoryLedger::process().check(
        scene + picture_bytes, file.string(),
        fmt::format("geometry {}, textures {}, {} {}, picture {}{}",
                    text_of_bytes(size.geometry_bytes + size.instance_bytes),
                    text_of_bytes(size.texture_bytes + size.tile_bytes),
                    decoding ? "decoding them" : "their tables and buffers", text_of_bytes(rest),
                    picture_bytes > 0 ? "at least " : "", text_of_bytes(picture_bytes)));
}

void check_tables(const SceneSize& size, const std::filesystem::path& file) {
    // Texture buffers of Mesa's llvmpipe and of NVIDIA's driver end at 2^27 texels. Hierarchies in memory end at 2^25
    // pairs of triangles (engine/rays/packed_bvh.cpp), and a triangle may have no partner.
    constexpr std::size_t kMostTexels = std::size_t{1} << 27, kMostTriangles = std::size_t{1} << 25;
    if (size.vertex_texels > kMostTexels || size.stored > kMostTriangles)
        throw BudgetError(file.string(),
                          "has {} triangles and {} texels of vertex attributes; tables without pages hold {} and {}",
                          size.stored, size.vertex_texels, kMostTriangles, kMostTexels);
}

std::shared_ptr<TextureStore> tile_textures(std::span<GltfScene> files, SceneSize& size, std::size_t picture_bytes,
                                            bool always) {
    // Pools in memory end at so many texels of a kind (engine/device/scene_buffers.h).
    constexpr std::size_t kMostBytes = std::size_t{4} * (std::size_t{shared::kMostBanks} << shared::kMostBankShift);
    const bool fit = scene_bytes(size) + picture_bytes <= MemoryLedger::process().free();
    if (size.texture_bytes == 0 || (fit && size.texture_bytes <= kMostBytes && !always)) return nullptr;
    const auto store = std::make_shared<TextureStore>(scratch_folder(), cache_folder("textures"));
    for (GltfScene& file : files) file.put_textures_into(store);
    size = with_tiles(size);
    return store;
}

void take_sun(Scene& pose, const Scene& from) {
    std::ranges::copy_if(from.lights, std::back_inserter(pose.lights), &PunctualLight::of_environment);
}

namespace {

/// Returns whether some triangle in pages emits light.
bool emits(const paging::PageIndex& index, const Scene& scene) {
    const std::vector<bool>& used = index.geometry.used_materials;
    for (std::size_t i = 0; i < std::min(used.size(), scene.materials.size()); ++i)
        if (used[i] && has_emission(scene.materials[i])) return true;
    return false;
}

std::size_t bytes_of(const SceneTree& tree) {
    std::size_t bytes = tree.nodes.size() * sizeof(SceneNode) + tree.light_nodes.size() * sizeof(int);
    for (const SceneNode& node : tree.nodes) bytes += node.name.size();
    return bytes;
}

}  // namespace

LoadedScene::LoadedScene(SceneChoice choice, const CameraChoice& camera, const Log& log)
    : choice_(std::move(choice)), camera_choice_(camera) {
    load_whole_or_paged(
        choice_, [&] { lit_elsewhere_ = load_whole(log); }, [&] { lit_elsewhere_ = load_pages(log); });
    for (const std::string& warning : scene_.report.warnings) log.warn("{}", warning);
    if (scene_.instances.empty()) log.warn("the scene has no surfaces to show");
    if (pages_) lit_elsewhere_ = lit_elsewhere_ || has_light(scene_) || emits(pages_->index(), scene_);
    own_environment_ = std::make_shared<const Environment>(scene_.environment);
    if (const auto* map = std::get_if<std::filesystem::path>(&choice_.environment)) environment_file_ = versioned(*map);
    rays::LazyProbe probe(scene_);
    unkeyed_camera_ = camera_ = choose_camera(scene_, camera, &probe);
    set_environment(scene_, choice_.environment, log,
                    {.lit_elsewhere = lit_elsewhere_,
                     .lamps = choice_.lamps,
                     .camera = camera_.index ? std::nullopt : std::optional(camera_.camera),
                     .azimuth = light_azimuth(),
                     .probe = &probe,
                     .straight_glass = choice_.edits.straight_glass});
    std::ranges::copy_if(scene_.lights, std::back_inserter(suns_), &PunctualLight::of_environment);
    size_ = size_of(scene_);  // with surfaces that edits hide, which later edits may show
    take_keys();
    apply_edits();
    for (const LightProfile& profile : scene_.light_profiles)
        if (profile.candela == 0 && !profile.path.empty())
            log.warn("{}: has no light: all its intensities are 0", profile.path);
    if (!pages_)
        for (const std::string& name : dark_light_groups(scene_, driven_emission_))
            log.warn("light group '{}' has no light", name);
    if (surface_edits(edits_at(0)) != SceneEdits()) probe.reset();
    choose(&probe);
    if (!camera_.warning.empty()) log.warn("{}", camera_.warning);
    if (!camera_.options.empty()) log.note("default camera: {}", camera_.options);
    constexpr std::size_t kMostAsked = 1000000;  // triangles of meshes for which a probe is made
    std::size_t triangles = 0;
    for (const Mesh& mesh : scene_.meshes) triangles += mesh.triangles.size();
    if (!pages_ && (probe.made() || triangles <= kMostAsked))
        for (const std::string& line : blocked_lights(probe, scene_, {camera_.camera})) log.warn("{}", line);
    memory_ = {MemoryLedger::process(), MemoryPart::scene, size_.contents() + bytes_of(tree_)};
    choice_.packing = {};  // it may refer to what the caller drops
}

bool LoadedScene::load_whole(const Log& log) {
    const GltfOptions options = gltf_options(choice_);
    if (choice_.animation)
        return take_file(SceneFile(choice_.scene, options, choice_.picture_bytes, true, choice_.tile_textures), log);
    frame_rate_ = choice_.frame_rate.value_or(FrameRate());
    SceneFile file(choice_.scene, options, choice_.picture_bytes, false, choice_.tile_textures);
    scene_ = file.gltf().at_rest();
    if (scene_.instances.empty() && !file.gltf().animations().empty())
        scene_.report.warnings.emplace_back(
            "no surface is there at rest; an animation may show some (--animation, --frame)");
    tree_ = file.tree_at(0);
    files_ = file.gltf().files();
    variants_ = file.gltf().variants();
    return false;
}

bool LoadedScene::take_file(SceneFile file, const Log& log) {
    file_.emplace(std::move(file));
    if (choice_.animation) {
        file_->set_frame_rate(choice_.frame_rate, log);
        file_->play(*choice_.animation, log);
        frame_rate_ = file_->frame_rate();
    } else {
        frame_rate_ = choice_.frame_rate.value_or(FrameRate());
    }
    playing_ = file_->playing();
    const bool lit_later = file_->drives_light();
    driven_emission_ = file_->driven_emission();
    surfaces_move_ = file_moves_ = file_->surfaces_move();
    scene_ = file_->at(0);
    tree_ = file_->tree_at(0);
    files_ = file_->gltf().files();
    variants_ = file_->gltf().variants();
    if (playing_.empty()) file_.reset();
    return lit_later;
}

/// Drops instances that have no pages, since a scene in memory does not have them either.
void LoadedScene::drop_empty_instances() {
    if (!pages_) return;
    const std::vector<std::uint32_t>& empty = pages_->index().empty;
    auto next = empty.begin();
    std::uint32_t still = 0;
    std::erase_if(scene_.instances, [&](const Instance& instance) {
        if (paging::is_moving(scene_, instance) || next == empty.end() || *next != still++) return false;
        ++next;
        return true;
    });
}

bool LoadedScene::load_pages(const Log& log, bool again) {
    if (!choice_.variant.empty())
        throw Error(choice_.scene.string(), "variant '{}' cannot be chosen: pages hold the file's own materials",
                    choice_.variant);
    if (choice_.line_width > 0) throw Error(choice_.scene.string(), "pages hold no points and lines (--line-width)");
    check_no_moved_surfaces(choice_.edits, choice_.scene.string());
    GltfOptions options = gltf_options(choice_);
    frame_rate_ = choice_.frame_rate.value_or(FrameRate());
    std::vector<GltfScene> parts = open_files(choice_.scene, options);
    const bool list = is_part_list(choice_.scene);
    const bool some = std::ranges::any_of(parts, [](GltfScene& part) { return !part.animations().empty(); });
    if (list && choice_.animation && *choice_.animation != "none" && (some || *choice_.animation != "all"))
        throw Error(choice_.scene.string(), "is a list of files, whose animations cannot play");
    const bool posed = !list && !parts[0].animations().empty();
    if (posed) {
        parts[0].leave_out_still();
        driven_materials_ = parts[0].driven_materials();
    }
    SceneSize size = size_of_parts(parts);
    size.drawn = 0;  // pages take what the budget leaves
    if (posed) {
        const SceneSize moving = parts[0].size();
        size.geometry_bytes = moving.geometry_bytes;
        size.stored = moving.stored;
        size.drawn = moving.drawn;
        size.moves = true;
    }
    options.textures = tile_textures(parts, size, choice_.picture_bytes, choice_.tile_textures);
    check_fits(size, choice_.scene, choice_.picture_bytes);
    const bool cached = choice_.pages.empty();
    const auto file =
        cached ? cached_pages(
                     choice_.scene, parts,
                     {choice_.allow_outside, choice_.strict_scene, choice_.edits.straight_glass, choice_.packing}, log)
               : std::make_shared<paging::PageFile>(choice_.pages);
    pages_ = file;
    const paging::PageIndex& index = file->index();
    bool same = have_contents(parts, index.files);
    bool lit_later = false;
    if (same && posed) {
        lit_later = take_file(SceneFile(choice_.scene, std::move(parts[0])), log);
    } else if (same) {
        if (!list) tree_ = parts[0].tree_at(0, {});
        parts.clear();
        const std::unique_ptr<MeshSource> source = open_parts(choice_.scene, options);
        scene_ = source->scene();
        scene_.report = source->report();
        files_ = source->files();
        if (list) tree_ = tree_of(scene_);
    }
    same = same && TriangleWords(scene_).alpha_tests() == index.alpha_tests;
    const std::filesystem::path& pages = file->path();
    if (!same && cached && !again) {  // an image has changed
        std::filesystem::remove(pages);
        return load_pages(log, true);
    }
    if (!same)
        throw Error(pages.string(), "was not made of {}, or the scene has changed; halflight pack makes it anew",
                    choice_.scene.string());
    drop_empty_instances();
    files_.push_back(versioned(pages));
    if (!index.bounds.empty())
        scene_.paged_bounds = {index.origin + dvec3(index.bounds.lower), index.origin + dvec3(index.bounds.upper)};
    return lit_later;
}

LoadedScene::LoadedScene(LoadedScene&&) noexcept = default;
LoadedScene& LoadedScene::operator=(LoadedScene&&) noexcept = default;
LoadedScene::~LoadedScene() = default;

namespace {

/// Returns whether edits over frames change more than cameras.
bool change_scene(const EditKeys& keys) {
    using enum EditTrack::Of;
    return keys.has({scene, environment, lights, materials, nodes, hide});
}

/// Returns how far the frame of a time may be rounded, frames.
double rounding_of(double frame) {
    return 1e-9 * std::max(1.0, std::abs(frame));
}

}  // namespace

double LoadedScene::frame_at(double seconds) const {
    const double frame = seconds * frame_rate_.numerator / frame_rate_.denominator, whole = std::round(frame);
    return choice_.frame_offset + (std::abs(frame - whole) < rounding_of(frame) ? whole : frame);
}

bool LoadedScene::same_environment(FrameNumber a, FrameNumber b) const {
    if (!choice_.keys.has({EditTrack::Of::environment})) return true;
    const SceneEdits x = edits_at(time_of(double(a))), y = edits_at(time_of(double(b)));
    return x.environment_rotation == y.environment_rotation && x.environment_intensity == y.environment_intensity &&
           x.environment_tint == y.environment_tint;
}

SceneEdits LoadedScene::edits_at(double seconds) const {
    SceneEdits edits = choice_.edits;
    apply_keys(choice_.keys, frame_at(seconds), edits);
    return edits;
}

void LoadedScene::mark_moved(Scene& scene, const SceneTree& tree) const {
    std::vector<std::string> nodes, hidden;
    for (const EditTrack& track : choice_.keys.tracks) {
        if (track.of == EditTrack::Of::nodes) nodes.push_back(track.name);
        if (track.of == EditTrack::Of::hide) hidden.push_back(track.name);
    }
    if (nodes.empty() && hidden.empty()) return;
    const std::vector<bool> moved = instances_below(nodes, hidden, scene, tree);
    for (std::size_t i = 0; i < moved.size(); ++i) scene.instances[i].moves = scene.instances[i].moves || moved[i];
}

void LoadedScene::take_keys() {
    surfaces_move_ = file_moves_ || change_scene(choice_.keys);
    size_.moves = surfaces_move_;
    if (!pages_) return mark_moved(scene_, tree_);
    for (const double frame : key_frames(choice_.keys)) check_pages(edits_at(time_of(frame)));
}

void LoadedScene::check_pages(const SceneEdits& edits) const {
    if (pages_)
        check_paged_edits(edits, scene_, pages_->index(), choice_.scene.string(), choice_.edits_source,
                          driven_materials_);
}

void LoadedScene::set_keys(EditKeys keys) {
    if (keys == choice_.keys) return;
    const auto take = [&](EditKeys taken) {
        posed_at_.reset();
        restore_unedited();
        for (Instance& instance : scene_.instances) instance.moves = instance.moves && file_moves_;
        choice_.keys = std::move(taken);
        take_keys();
        keep_unedited();
        unedited_->instances = scene_.instances;
        if (file_moves_) pose(0);  // of the file; it leaves the environment, which may be without edits now
        restore_unedited();
        posed_at_ = 0;
        apply_edits();
    };
    check_surfaces();
    EditKeys earlier = choice_.keys;
    try {
        take(std::move(keys));
    } catch (...) {
        take(std::move(earlier));
        throw;
    }
    choose();
    ++revision_, ++choice_revision_, ++transform_revision_;
    framed_ = transform_revision_;
}

void LoadedScene::keep_unedited() {
    if (unedited_) return;
    unedited_ = std::make_unique<Unedited>();
    unedited_->take_surfaces(scene_);
    unedited_->environment = scene_.environment;
}

void LoadedScene::apply_edits() {
    const SceneEdits edits = edits_at(posed_at_.value_or(0));
    check_pages(edits);
    if (!unedited_ && edits == SceneEdits() && choice_.keys.empty()) return;
    keep_unedited();
    apply(edits, scene_, tree_, choice_.edits_source);
    separate_.reset();
    if (!choice_.edits.each_light) return;
    separate_ = std::make_unique<SeparateLights>(separate_lights(scene_, driven_emission_, scene_.name));
    set_light_groups(*separate_, scene_);
}

void LoadedScene::restore_unedited() {
    remove_added(scene_);
    if (!unedited_) return;
    unedited_->give_surfaces(scene_);
    scene_.environment = unedited_->environment;
}

void LoadedScene::edit(SceneEdits edits) {
    if (edits == choice_.edits) return;
    SceneEdits earlier = std::exchange(choice_.edits, std::move(edits));
    std::string earlier_source = std::exchange(choice_.edits_source, {});
    restore_unedited();
    try {
        apply_edits();
    } catch (...) {
        choice_.edits = std::move(earlier);
        choice_.edits_source = std::move(earlier_source);
        restore_unedited();
        apply_edits();
        throw;
    }
    ++revision_, ++choice_revision_;
    if (surface_edits(choice_.edits) != surface_edits(earlier)) ++transform_revision_;
}

double LoadedScene::light_azimuth() const {
    return choice_.light_azimuth.value_or(view_azimuth(camera_.camera));
}

void LoadedScene::turn_light() {
    Environment& environment = unedited_ ? unedited_->environment : scene_.environment;
    const bool map = std::holds_alternative<std::filesystem::path>(choice_.environment);
    if (map || environment.name != name(SkyPreset::neutral)) return;
    Environment turned = preset_sky(SkyPreset::neutral, light_azimuth()).environment;
    if (turned.map.pixels == environment.map.pixels) return;
    turned.light_group = environment.light_group;
    environment = std::move(turned);
    ++revision_;
    if (!unedited_) return;
    restore_unedited();
    apply_edits();
}

const std::vector<Instance>& LoadedScene::unedited_instances() const {
    return unedited_ ? unedited_->instances : scene_.instances;
}

void LoadedScene::set_camera(const CameraChoice& camera) {
    check_surfaces();  // a default camera frames them
    pose(0);
    choose_camera(scene_, camera);  // throws before anything changes
    camera_choice_ = camera;
    choose();
    ++choice_revision_;
}

void LoadedScene::choose(const rays::LazyProbe* probe) {
    {
        const WithoutAdded seen(scene_);
        unkeyed_camera_ = choose_camera(scene_, camera_choice_, probe);
    }
    frame_motion();
    camera_ = keyed(unkeyed_camera_, 0);
    turn_light();
    framed_ = transform_revision_;
}

namespace {

/// Empties a value during its lifetime.
template <class T>
class Aside {
  public:
    explicit Aside(T& value) : value_(value), kept_(std::exchange(value, {})) {}
    Aside(const Aside&) = delete;
    Aside& operator=(const Aside&) = delete;
    ~Aside() { value_ = std::move(kept_); }

  private:
    T& value_;
    T kept_;
};

}  // namespace

void LoadedScene::frame_for(double aspect) {
    const CameraChoice& c = camera_choice_;
    const double now = c.aspect > 0 ? c.aspect : kUsualAspect;
    const bool framed = aspect == now && framed_ == transform_revision_;
    if (unkeyed_camera_.options.empty() || c.look_from || c.pose || framed || freed_) return;
    pose(0);
    camera_choice_.aspect = aspect;
    choose();
}

/// Lets a default camera outside frame the surfaces in all poses of the animation that plays. Edits over frames do not
/// count, so that frames do not depend on keys of others.
void LoadedScene::frame_motion() {
    constexpr int kPoses = 8;
    ChosenCamera& chosen = unkeyed_camera_;
    if (chosen.options.empty() || chosen.camera.name == kInsideCamera || camera_choice_.turntable > 0 || pages_ ||
        !file_moves_)
        return;
    const WorldBounds first = world_bounds(scene_);
    WorldBounds all = first;
    {
        const Aside keys(choice_.keys);
        for (int i = 1; i <= kPoses; ++i) {
            try {
                pose(file_->end() * i / kPoses);
            } catch (const Error&) {
                continue;  // a frame that cannot be made need not be framed
            }
            const WorldBounds now = world_bounds(scene_);
            all = {glm::min(all.lower, now.lower), glm::max(all.upper, now.upper)};
        }
    }
    pose(0);
    if (all.empty() || (all.lower == first.lower && all.upper == first.upper)) return;
    const double aspect = camera_choice_.aspect > 0 ? camera_choice_.aspect : kUsualAspect;
    chosen.camera = framing_camera(all, aspect, false);
    chosen.origin = "that frames all poses of the scene";
    chosen.options = camera_options(chosen.camera, 0.5 * all.lower + 0.5 * all.upper);
}

void LoadedScene::pose(double seconds) {
    if (!surfaces_move_ || seconds == posed_at_) return;
    posed_at_.reset();  // an edit may not suit the pose; the next call poses again
    remove_added(scene_);
    if (file_moves_) {
        file_->pose(scene_, seconds);
        drop_empty_instances();
        scene_.lights.insert(scene_.lights.end(), suns_.begin(), suns_.end());
        tree_ = file_->tree_at(seconds);
        if (!pages_) mark_moved(scene_, tree_);
        if (unedited_) unedited_->take_surfaces(scene_);
    } else {
        unedited_->give_surfaces(scene_);
    }
    const bool turns = choice_.keys.has({EditTrack::Of::environment});
    Environment edited = std::exchange(scene_.environment, turns ? unedited_->environment : Environment());
    try {
        const SceneEdits edits = edits_at(seconds);
        if (!choice_.keys.empty()) check_pages(edits);
        apply(edits, scene_, tree_, choice_.edits_source);
    } catch (...) {
        scene_.environment = std::move(edited);
        throw;
    }
    if (!turns) {
        edited.links = scene_.environment.links;  // classes of objects may differ from pose to pose
        scene_.environment = std::move(edited);
    }
    if (separate_) set_light_groups(*separate_, scene_);
    posed_at_ = seconds;
    ++revision_;
}

std::vector<bool> LoadedScene::used_materials() const {
    if (freed_) return used_materials_;
    std::vector<bool> used(scene_.materials.size());
    if (pages_) used = pages_->index().geometry.used_materials;
    used.resize(scene_.materials.size());
    std::vector<bool> shown(scene_.meshes.size());
    for (const Instance& instance : scene_.instances) shown[static_cast<std::size_t>(instance.mesh)] = true;
    for (std::size_t mesh = 0; mesh < shown.size(); ++mesh)
        if (shown[mesh])
            for (const std::uint32_t material : scene_.meshes[mesh].triangle_material) used[material] = true;
    return used;
}

void LoadedScene::free_surfaces() {
    assert(!surfaces_move_);
    used_materials_ = used_materials();
    for (Mesh& mesh : scene_.meshes) {
        Mesh empty;
        empty.name = std::move(mesh.name);
        mesh = std::move(empty);
    }
    for (TextureImage& image : scene_.images) {
        image.rgba = {};
        for (auto* levels : {&image.color_levels, &image.data_levels})
            for (TextureImage& level : *levels) level.rgba = {};
    }
    trim_memory();
    memory_ = {MemoryLedger::process(), MemoryPart::scene,
               size_.instance_bytes + size_.environment_bytes + bytes_of(tree_)};
    freed_ = true;
}

void LoadedScene::check_surfaces() const {
    if (freed_) throw Error(choice_.scene.string(), "its meshes were freed after their upload; load it again");
}

void LoadedScene::deform_by(Deformer* deformer) {
    if (!file_ || deformer == deformer_) return;  // edits alone deform nothing
    deformer_ = deformer;
    file_->gltf().deform_by(deformer);
    posed_at_.reset();
}

Scene LoadedScene::posed(double seconds) {
    Scene posed;
    if (file_moves_) {
        posed = file_->at(seconds, scene_.images);
        posed.light_profiles = scene_.light_profiles;
        posed.lights.insert(posed.lights.end(), suns_.begin(), suns_.end());  // edits may name them
        mark_moved(posed, file_->tree_at(seconds));
    } else {
        {
            const Aside environment(scene_.environment);
            posed = scene_;
        }
        remove_added(posed);
        unedited_->give_surfaces(posed);
    }
    apply(edits_at(seconds), posed, file_moves_ ? file_->tree_at(seconds) : tree_, choice_.edits_source);
    if (separate_) set_light_groups(*separate_, posed);
    return posed;
}

ChosenCamera LoadedScene::keyed(ChosenCamera chosen, double seconds) {
    if (!choice_.keys.has({EditTrack::Of::camera})) return chosen;
    const KeyedCamera keys = keyed_camera(choice_.keys, frame_at(seconds));
    if (keys.camera) {
        const std::size_t index = find_camera(scene_, *keys.camera, choice_.edits_source);
        chosen.camera = playing_.empty() ? scene_.cameras[index] : file_->cameras_at(seconds).at(index);
        chosen.index = index;
    }
    std::optional<CameraPose> free;
    const CameraChoice& c = camera_choice_;
    if (!keys.camera && c.look_from)
        free = CameraPose{.from = *c.look_from, .at = *c.look_at, .up = c.up};
    else if (!keys.camera)
        free = c.pose;
    try {
        chosen.camera = with_keys(std::move(chosen.camera), keys, free);
    } catch (const Error& error) {
        throw Error(choice_.edits_source, "keys.camera: frame {:g}: {}", frame_at(seconds), error.reason());
    }
    chosen.keyed_lens = keys.lens;
    return chosen;
}

ChosenCamera LoadedScene::camera(double seconds) {
    ChosenCamera chosen = unkeyed_camera_;
    if (chosen.index && !playing_.empty()) chosen.camera = file_->cameras_at(seconds).at(*chosen.index);
    if (const auto fov = camera_choice_.override_fov; fov && !camera_choice_.look_from)
        chosen.camera.vertical_fov = glm::radians(*fov);
    chosen = keyed(std::move(chosen), seconds);
    if (const int frames = camera_choice_.turntable; frames > 0) {
        const double frame = seconds * frame_rate_.numerator / frame_rate_.denominator;
        chosen.camera = turned(chosen.camera, chosen.pivot, 2 * kPi * frame / frames);
    }
    return chosen;
}

std::optional<double> LoadedScene::animation_end() {
    return playing_.empty() ? std::nullopt : std::optional(file_->end());
}

std::pair<double, double> LoadedScene::shot(double seconds) {
    constexpr double kEver = std::numeric_limits<double>::infinity();
    std::pair<double, double> shot{-kEver, kEver};
    const auto cut = [&](bool later, double last, double first) {
        later ? shot.second = std::min(shot.second, last) : shot.first = std::max(shot.first, first);
    };
    const double frame = frame_at(seconds);
    for (const double key : camera_cuts(choice_.keys)) {
        const double away = 2 * rounding_of(key - choice_.frame_offset), first = time_of(key);
        cut(frame < key, time_of(key - away), frame_at(first) < key ? time_of(key + away) : first);
    }
    if (!camera_.index || playing_.empty()) return shot;
    const float own = static_cast<float>(seconds);  // keys of files are compared as floats (keyframes.h)
    for (const float key : file_->camera_cuts(*camera_.index))
        cut(own < key, double{std::nextafter(key, own)}, double{key});
    return shot;
}

bool LoadedScene::parts_come_and_go() {
    return change_scene(choice_.keys) || (file_moves_ && file_->parts_come_and_go());
}

PoseWarnings::PoseWarnings(const LoadedScene& scene)
    : told_(scene.scene().report.warnings.begin(), scene.scene().report.warnings.end()) {}

void PoseWarnings::tell(const LoadedScene& scene, const Log& log) {
    for (const std::string& warning : scene.scene().report.warnings)
        if (told_.insert(warning).second) log.warn("{}", warning);
}

}  // namespace halflight
