// Loading of scenes, environments, variants and poses, which Session::open() takes.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "api/halflight/camera.h"
#include "api/halflight/loaded_scene.h"
#include "engine/io/environment.h"
#include "engine/io/gltf/parts.h"
#include "tools/cli/settings_parts.h"
#include "tools/view/session.h"
#include "tools/view/stale_settings.h"

namespace halflight::view {
namespace {

/// Returns the environment map of the arguments as it is now; without one, a file without a path.
VersionedFile environment_file(const PreviewArguments& a) {
    const auto* map = std::get_if<std::filesystem::path>(&a.choice.environment);
    return map ? versioned(*map) : VersionedFile();
}

/// Opens the scene's file and returns the timeline of its animations. Throws Error.
Timeline timeline_of(const PreviewArguments& a, const Console& console) {
    Timeline t;
    t.file = std::make_shared<SceneFile>(a.choice.scene, gltf_options(a.choice));
    t.animation = a.choice.animation.value_or("none");
    try {
        t.animations = titles(t.file->gltf().animations());
    } catch (const Error& error) {
        if (t.animation != "none") throw;
        console.warn("{}", error.what());  // the scene at rest can still be shown
    }
    if (!t.animations.empty() || !a.choice.keys.empty()) t.file->set_frame_rate(a.choice.frame_rate, console);
    t.file->play(t.animation, console);
    t.rate = t.file->frame_rate();
    t.playing = t.file->playing();
    return t;
}

/// Lets the neutral light keep the azimuth of the first camera.
void fix_light(PreviewArguments& a, const Scene& scene) {
    if (!a.choice.light_azimuth) a.choice.light_azimuth = azimuth_of_light(scene, a.view);
}

/// Poses the reference at 0 s of the animation that plays. The new scene takes the images of `images`.
void take_reference(Session::Opened& o, const Scene& images, const Console& console) {
    Timeline& t = o.timeline;
    Scene scene = t.file->at(0, images.images);
    o.own_environment = std::make_shared<const Environment>(scene.environment);
    o.lit_elsewhere = t.file->drives_light();
    fix_light(o.arguments, scene);
    const bool chosen = !std::holds_alternative<std::monostate>(o.arguments.choice.environment);
    if (chosen && o.reference)
        scene.environment = o.reference->environment, take_sun(scene, *o.reference);  // avoids reading its file again
    else
        set_environment(scene, o.arguments.choice.environment, console,
                        {.lit_elsewhere = o.lit_elsewhere,
                         .lamps = o.arguments.choice.lamps,
                         .camera = free_camera(scene, o.arguments.view),
                         .azimuth = *o.arguments.choice.light_azimuth,
                         .straight_glass = o.arguments.choice.edits.straight_glass});
    o.reference_tree = std::make_shared<const SceneTree>(t.file->tree_at(0));
    check_edits(edits_at(o.arguments, 0), scene, *o.reference_tree, o.arguments.choice.edits_source);
    o.reference = std::make_shared<const Scene>(std::move(scene));
    o.scene.reset();
    t.last_posed = last_frame(t.file->end(), t.rate);
}

/// Poses scene and cameras at a frame. The scene is that of the reference if the animation drives cameras only.
void take_frame(Session::Opened& o, FrameNumber frame) {
    Timeline& t = o.timeline;
    t.frame = frame;
    const auto before = o.scene;
    o.scene = o.reference;
    o.tree = o.reference_tree;
    t.own_cameras = o.reference->cameras;
    if (frame != 0 && !t.playing.empty()) {
        const double seconds = t.rate.seconds(frame);
        t.own_cameras = t.file->cameras_at(seconds);
        if (t.file->surfaces_move()) {
            Scene scene = t.file->at(seconds, o.reference->images);
            scene.environment = o.reference->environment;
            take_sun(scene, *o.reference);
            o.tree = std::make_shared<const SceneTree>(t.file->tree_at(seconds));
            o.scene = std::make_shared<const Scene>(std::move(scene));
        }
    }
    t.take_keys(o.arguments, *o.reference);
    if (o.scene != before) o.picker = std::make_shared<const Picker>(o.scene);
}

/// Loads a scene into memory.
void load_whole(Session::Opened& opened, const Console& console) {
    const PreviewArguments& a = opened.arguments;
    opened.timeline = timeline_of(a, console);
    Timeline& timeline = opened.timeline;
    const Scene rest = timeline.file->gltf().at_rest();
    for (const std::string& warning : rest.report.warnings) console.warn("{}", warning);
    take_reference(opened, rest, console);
    opened.variants = timeline.file->gltf().variants();
    opened.files = timeline.file->gltf().files();
    take_frame(opened, a.settings.frame);
    if (timeline.animations.empty()) timeline.file.reset();
}

/// Loads a scene whose geometry is in pages. Nothing can be picked in it.
void load_pages(Session::Opened& opened, const Console& console) {
    SceneChoice choice = opened.arguments.choice;
    // RendererCache applies edits; pages refuse those that move surfaces.
    const bool straight_glass = choice.edits.straight_glass;
    choice.edits = surface_edits(choice.edits);
    choice.keys = {};
    choice.edits.straight_glass = straight_glass;
    if (std::exchange(choice.animation, std::nullopt)) console.note("animations do not play with pages");
    const LoadedScene loaded(choice, opened.arguments.view, console);
    opened.reference_tree = opened.tree = std::make_shared<const SceneTree>(loaded.tree());
    check_edits(edits_at(opened.arguments, 0), loaded.scene(), *opened.tree, opened.arguments.choice.edits_source);
    opened.reference = opened.scene = std::make_shared<const Scene>(loaded.scene());
    fix_light(opened.arguments, *opened.reference);
    opened.pages = loaded.pages();
    opened.files = loaded.files();
    opened.own_environment = loaded.own_environment();
    opened.lit_elsewhere = loaded.lit_elsewhere();
    opened.picker = std::make_shared<const Picker>(opened.pages ? std::make_shared<const Scene>() : opened.scene);
    opened.timeline = {};
    opened.timeline.own_cameras = opened.reference->cameras;
    opened.timeline.take_keys(opened.arguments, *opened.reference);
}

}  // namespace

std::vector<std::string> titles(const std::vector<Animation>& animations) {
    std::vector<std::string> all;
    for (const Animation& animation : animations) {
        const std::string& name = animation.name;
        const bool tells =
            !name.empty() && name != "all" && name != "none" && std::ranges::find(all, name) == all.end();
        all.push_back(tells ? name : std::to_string(all.size()));
    }
    return all;
}

FrameNumber last_frame(double end, const FrameRate& rate) {
    constexpr double kRounding = 1e-3;  // tolerance, frames, since files store times as floats
    constexpr double kMost = 1e6;
    const double frames = std::floor(end * rate.numerator / rate.denominator + kRounding);
    return static_cast<FrameNumber>(std::clamp(frames, 0.0, kMost));
}

SceneEdits edits_at(const PreviewArguments& a, FrameNumber frame) {
    SceneEdits edits = a.choice.edits;
    apply_keys(a.choice.keys, double(frame), edits);
    return edits;
}

void Timeline::take_keys(const PreviewArguments& a, const Scene& scene) {
    const EditKeys& all = a.choice.keys;
    keyed = !all.empty();
    last = last_posed;
    if (const auto key = last_key(all)) last = std::max(last, static_cast<FrameNumber>(std::ceil(*key)));
    cameras = own_cameras;
    keys = {};
    for (const EditTrack& track : all.tracks)
        if (track.of == EditTrack::Of::camera && track.key == "camera")
            for (const EditTrack::Key& key : track.keys)
                if (!key.value.empty()) find_camera(scene, key.value, track.source);
    edits_at(a, frame);
    if (!all.has({EditTrack::Of::camera})) return;
    const KeyedCamera now = keyed_camera(all, double(frame));
    if (const auto index = choose_camera(scene, a.view).index) {
        const std::size_t shown = now.camera ? find_camera(scene, *now.camera, "") : *index;
        try {
            cameras.at(*index) = halflight::with_keys(own_cameras.at(shown), now, std::nullopt);
        } catch (const Error& error) {
            throw Error(scene.name, "keys.camera: frame {}: {}", frame, error.reason());
        }
    }
    keys = now;
}

Camera Timeline::with_keys(const CameraPose& free, const Scene& scene) const {
    try {
        if (keys.camera)
            return halflight::with_keys(own_cameras.at(find_camera(scene, *keys.camera, "")), keys, std::nullopt);
        return halflight::with_keys(camera_of(free), keys, free);
    } catch (const Error& error) {
        throw Error(scene.name, "keys.camera: frame {}: {}", frame, error.reason());
    }
}

std::function<Session::Opened()> Session::starting(const PreviewArguments& arguments, const ColorConfig& colors) {
    return [arguments, colors] { return load_with_settings(arguments, colors, Console(arguments.log.level)); };
}

Session::Opened Session::load_with_settings(PreviewArguments a, const ColorConfig& colors, const Console& console) {
    std::vector<std::string> problems;
    if (a.settings_source) problems = a.settings_source->left_out;
    Opened opened;
    try {
        opened = load(a, colors, console);
    } catch (const Error&) {
        const std::size_t before = problems.size();
        leave_out_stale(a, colors, problems);
        if (problems.size() == before) throw;
        opened = load(a, colors, console);
    }
    if (problems.empty()) return opened;
    opened.warning = left_out_warning(a.settings_source->path, problems);
    console.warn("{}", opened.warning);
    return opened;
}

Session::Opened Session::load(const PreviewArguments& a, const ColorConfig& colors, const Console& console) {
    Opened opened;
    opened.arguments = a;
    opened.environment_file = environment_file(a);
    colors.view(a.settings.view);  // throws for an unknown view transform
    load_whole_or_paged(
        a.choice, [&] { load_whole(opened, console); }, [&] { load_pages(opened, console); });
    if (a.settings.optics.traced()) {
        opened.warning = fmt::format("the viewer shows the camera itself, not {}", text(a.settings.optics));
        console.note("{}", opened.warning);
    }
    const Timeline& timeline = opened.timeline;
    CameraChoice choice = a.view;
    choice.replace_blind = !a.view.camera;
    ChosenCamera chosen = choose_camera(*opened.reference, choice);
    if (!chosen.warning.empty()) console.warn("{}", chosen.warning);
    if (chosen.index) chosen.camera = timeline.cameras[*chosen.index];
    if (chosen.index && a.view.override_fov) {
        chosen.camera.vertical_fov = glm::radians(*a.view.override_fov);
        chosen.index.reset();  // a free camera at its place
    }
    with_lens(chosen.camera, a.settings.view.camera.lens);  // throws for a lens that cannot be used
    const WorldBounds box = world_bounds(*opened.scene);
    opened.diagonal = box.empty() || box.lower == box.upper ? 1 : glm::length(box.upper - box.lower);
    const Picker moved =
        opened.pages ? *opened.picker
                     : opened.picker->with_instances(moved_instances(*opened.scene, *opened.tree, a.choice.edits));
    const double ahead = orbit_distance(chosen.camera, moved, *opened.scene);
    opened.start = {a.view.pose && !chosen.index ? *a.view.pose : pose_of(chosen.camera, ahead), chosen.index};
    if (timeline.keyed && !chosen.index) {
        try {
            timeline.with_keys(opened.start->pose, *opened.reference);
        } catch (const Error& error) {  // the user can choose another frame
            opened.warning = error.what();
            console.warn("{}", opened.warning);
        }
    }
    return opened;
}

std::function<Session::Opened()> Session::opening(const std::filesystem::path& path) const {
    if (has_extension(path, "glb") || has_extension(path, "gltf")) {
        PreviewArguments a;
        a.choice.scene = path;
        a.choice.allow_outside = arguments_.choice.allow_outside;
        a.device = arguments_.device;
        a.log.level = arguments_.log.level;
        a.settings.samples = samples;
        a.settings.preview = modes.preview;
        a.settings.clamp = modes.clamp;
        a.settings.denoise = modes.denoise;
        a.settings.backfaces = modes.backfaces;
        a.settings.show_lamps = modes.show_lamps;
        return [a, colors = colors_, console = console_]() mutable {
            take_settings(a);
            return load_with_settings(a, colors, console);
        };
    }
    if (has_extension(path, "exr") || has_extension(path, "hdr")) return lighting(path);
    throw Error(path.string(), "is neither a scene (.glb, .gltf) nor an environment (.exr, .hdr)");
}

std::function<Session::Opened()> Session::lighting(const EnvironmentChoice& environment) const {
    Opened opened = now();
    opened.arguments.choice.environment = environment;
    opened.environment_file = environment_file(opened.arguments);
    return [opened, console = console_]() mutable {
        Timeline& timeline = opened.timeline;
        if (timeline.file) timeline.file->play(timeline.animation, Log());  // posing() may have failed for another one
        Scene other = *opened.reference;
        other.environment = *opened.own_environment;
        set_environment(other, opened.arguments.choice.environment, console,
                        {.lit_elsewhere = opened.lit_elsewhere,
                         .lamps = opened.arguments.choice.lamps,
                         .camera = free_camera(other, opened.arguments.view),
                         .azimuth = *opened.arguments.choice.light_azimuth});
        opened.reference = std::make_shared<const Scene>(std::move(other));
        take_frame(opened, opened.timeline.frame);
        return opened;
    };
}

std::function<Session::Opened()> Session::dressing(const std::string& variant) const {
    PreviewArguments a = arguments_;
    a.choice.variant = variant;
    a.choice.edits = edits;
    a.choice.edits_source.clear();
    a.choice.animation = timeline_.animation;
    a.settings.frame = timeline_.frame;
    return [a, colors = colors_, console = console_] {
        Opened opened = load(a, colors, console);
        opened.start.reset();
        return opened;
    };
}

std::function<Session::Opened()> Session::reloading() const {
    PreviewArguments a = now().arguments;
    a.choice.animation = timeline_.animation;
    a.settings.frame = timeline_.frame;
    a.view = {};
    a.view.pose = pose_;
    a.settings.view.camera.lens = {};  // the session keeps its own
    // What does not suit the new scene is left out as if it came from a settings file.
    auto source = std::make_shared<PreviewArguments::Source>();
    source->path = file_;
    source->text = settings_text(saved({0, 0}), settings_file().parent_path());
    source->with = [a](const SavedSettings& settings) {
        PreviewArguments with = a;
        with.choice.edits = settings.edits;
        with.choice.keys = settings.keys;
        with.choice.variant = settings.variant;
        with.choice.environment = settings.environment;
        with.choice.animation = settings.moment ? settings.moment->animation : "none";
        return with;
    };
    a.settings_source = std::move(source);
    return [a, colors = colors_, console = console_] {
        Opened opened = load_with_settings(a, colors, console);
        opened.start.reset();
        opened.again = true;
        return opened;
    };
}

std::vector<VersionedFile> Session::files() const {
    std::vector<VersionedFile> all = files_;
    if (!environment_file_.path.empty()) all.push_back(environment_file_);
    return all;
}

std::function<Session::Opened()> Session::posing(const std::string& animation, FrameNumber frame) const {
    if (!timeline_.file && !timeline_.keyed) throw Error(file_.string(), "has no animations");
    return [opened = now(), free = keyed_pose(), animation, frame, console = console_]() mutable {
        Timeline& timeline = opened.timeline;
        const bool other = timeline.file && animation != timeline.animation;
        if (timeline.file)
            timeline.file->play(animation, other ? console : Log());  // a failed attempt may have selected another one
        if (other) {
            timeline.playing = timeline.file->playing();
            timeline.animation = animation;
            take_reference(opened, *opened.reference, Console(LogLevel::error));
        }
        take_frame(opened, frame);
        if (free) timeline.with_keys(*free, *opened.reference);  // throws if they define no view
        return opened;
    };
}

Session::Opened Session::now() const {
    PreviewArguments arguments = arguments_;
    arguments.choice.edits = edits;
    arguments.choice.edits_source.clear();
    return {std::move(arguments),
            reference_,
            scene_,
            reference_tree_,
            tree_,
            own_environment_,
            lit_elsewhere_,
            variants_,
            pages_,
            timeline_,
            picker_,
            diagonal_,
            {},
            {},
            files_,
            environment_file_};
}

void Session::open(Opened opened) {
    if (!opened.start) {  // the settings may have been saved meanwhile
        opened.arguments.settings_file = arguments_.settings_file;
        opened.arguments.settings_version = arguments_.settings_version;
        opened.arguments.settings_source = arguments_.settings_source;
    }
    const bool left_out = opened.again && !opened.warning.empty();
    const ObjectReferences before = opened.again ? references_ : ObjectReferences();
    arguments_ = std::move(opened.arguments);
    file_ = arguments_.choice.scene;
    reference_ = std::move(opened.reference), scene_ = std::move(opened.scene), picker_ = std::move(opened.picker);
    reference_tree_ = std::move(opened.reference_tree), tree_ = std::move(opened.tree);
    own_environment_ = std::move(opened.own_environment);
    lit_elsewhere_ = opened.lit_elsewhere;
    variants_ = std::move(opened.variants);
    edited_picker_.reset(), centre_.reset();
    pages_ = std::move(opened.pages);
    timeline_ = std::move(opened.timeline);
    diagonal_ = opened.diagonal;
    files_ = std::move(opened.files), environment_file_ = std::move(opened.environment_file);
    if (opened.start || left_out) edits = arguments_.choice.edits;
    if (opened.start) selection = {}, region.reset(), switched_off = {};
    find_references(opened.start || opened.again);
    if (opened.again) find_again(before);
    if (opened.start || opened.again) warning_ = std::move(opened.warning);
    if (!opened.start) return follow_camera();
    pose_ = first_pose_ = opened.start->pose;
    scene_camera_ = first_camera_ = opened.start->camera;
    transform = arguments_.settings.view;
    bounces = arguments_.settings.bounces.value_or(default_bounces(*scene_));
    samples = arguments_.settings.samples;
    modes = {arguments_.settings.preview, arguments_.settings.clamp, arguments_.settings.backfaces,
             arguments_.settings.denoise, arguments_.settings.show_lamps};
    bookmarks = arguments_.bookmarks;
    if (scene_camera_) take_lens(camera());
    with_lens(camera(), transform.camera.lens);  // throws for a lens that cannot be used
}

}  // namespace halflight::view
