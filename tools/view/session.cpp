#include "tools/view/session.h"
#include "tools/cli/installation.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "api/halflight/camera.h"
#include "api/scene/paged_edits.h"
#include "engine/io/files.h"
#include "engine/paging/page_file.h"
#include "engine/scene/material_lobes.h"
#include "tools/cli/settings_parts.h"

namespace halflight::view {

Session::Session(const PreviewArguments& arguments, ColorConfig colors, Opened opened)
    : console_(arguments.log.level), colors_(std::move(colors)) {
    open(std::move(opened));
}

Session::Session(const PreviewArguments& arguments, ColorConfig colors)
    : Session(arguments, colors, load_with_settings(arguments, colors, Console(arguments.log.level))) {}

SavedSettings Session::document() const {
    SavedSettings document = saved({0, 0});
    document.camera = std::monostate();
    document.moment.reset();
    document.settings.denoise = modes.denoise;
    return document;
}

SavedSettings Session::document(const PreviewArguments& a) const {
    SceneEdits first = a.choice.edits;
    apply_keys(a.choice.keys, 0, first);
    check_edits(first, *scene_, *tree_, a.choice.edits_source);
    SavedSettings other = document();
    other.edits = a.choice.edits;
    other.keys = a.choice.keys;
    other.settings.view = a.settings.view;
    other.settings.samples = a.settings.samples;
    if (a.settings.bounces) other.settings.bounces = a.settings.bounces;
    other.settings.preview = a.settings.preview;
    other.settings.clamp = a.settings.clamp;
    other.settings.backfaces = a.settings.backfaces;
    other.settings.denoise = a.settings.denoise;
    other.settings.show_lamps = a.settings.show_lamps;
    other.bookmarks = a.bookmarks;
    other.variant = a.choice.variant;
    other.environment = a.choice.environment;
    return other;
}

std::optional<std::function<Session::Opened()>> Session::restore(const SavedSettings& document) {
    const std::string selected = selection.kind == ObjectKind::light ? name_of(selection) : "";
    edits = document.edits;
    const bool posed = take_keys(document.keys);
    if (!selected.empty()) {  // other edits may add other lamps
        std::size_t i = 0;
        while (i < lights().size() && name_of({ObjectKind::light, i}) != selected) ++i;
        selection = i < lights().size() ? Selection{ObjectKind::light, i} : Selection();
    }
    transform = document.settings.view;
    samples = document.settings.samples;
    bounces = document.settings.bounces.value_or(bounces);
    modes = {document.settings.preview, document.settings.clamp, document.settings.backfaces, document.settings.denoise,
             document.settings.show_lamps};
    bookmarks = document.bookmarks;
    if (document.variant != arguments_.choice.variant) {
        const EnvironmentChoice before = std::exchange(arguments_.choice.environment, document.environment);
        auto opening = dressing(document.variant);  // with the environment of the document
        arguments_.choice.environment = before;
        return opening;
    }
    if (!(document.environment == arguments_.choice.environment)) return lighting(document.environment);
    if (!posed) return posing(timeline_.animation, timeline_.frame);
    return std::nullopt;
}

void Session::take_lens(const Camera& camera) {
    Lens& lens = transform.camera.lens;
    if (taken_lens_ && lens == *taken_lens_)
        lens = asked_lens_;  // the user has not edited the lens of the other camera
    taken_lens_.reset();
    if (lens.focus.kind != Focus::Kind::open || !camera.lens.blurs()) return;
    asked_lens_ = lens;
    taken_lens_ = lens = with_lens(camera, lens).lens;
}

Camera Session::camera() const {
    if (scene_camera_) return timeline_.cameras[*scene_camera_];
    if (const auto free = keyed_pose()) {
        try {
            return timeline_.with_keys(*free, *scene_);
        } catch (const Error&) {  // posing() and load() have reported it
        }
    }
    return camera_of(pose_);
}

std::optional<CameraPose> Session::keyed_pose() const {
    const bool moved = scene_camera_ || first_camera_ || pose_ != first_pose_;
    return timeline_.keyed && !moved ? std::optional(pose_) : std::nullopt;
}

Camera Session::camera_with_lens() const {
    try {
        return with_lens(camera(), transform.camera.lens);
    } catch (const Error&) {
        Camera pinhole = camera();  // the lens was made for another camera
        pinhole.lens = {};
        return pinhole;
    }
}

void Session::follow_camera() {
    if (scene_camera_ && timeline_.runs()) pose_ = pose_of(camera(), glm::length(pose_.at - pose_.from));
}

void Session::move(const CameraPose& pose) {
    if (pose == pose_) return;
    camera_of(pose);  // throws for an invalid pose
    pose_ = pose;
    scene_camera_.reset();
}

void Session::take_camera(std::size_t index) {
    scene_camera_ = first_camera_ = index;
    switched_off.lens = {};  // the lens belongs to another camera
    take_lens(camera());
    pose_ = first_pose_ = pose_of(camera(), orbit_distance(camera(), picker(), *scene_));
}

void Session::take_camera(const std::string& name_or_number) {
    const ChosenCamera chosen = choose_camera(*scene_, {.camera = name_or_number});
    if (chosen.index) return take_camera(*chosen.index);
    scene_camera_.reset(), first_camera_.reset();
    pose_ = first_pose_ = pose_of(chosen.camera, orbit_distance(chosen.camera, picker(), *scene_));
}

void Session::reset_camera() {
    take_view({first_pose_, first_camera_});
    if (!first_camera_) take_lens(camera());
}

void Session::take_view(const View& view) {
    pose_ = view.pose;
    scene_camera_ = view.camera;
    if (scene_camera_) take_lens(camera());  // a free camera keeps the lens that is in use
    follow_camera();
}

void Session::edit(SceneEdits other) {
    check_edits(other, *scene_, *tree_);
    if (pages_) check_paged_edits(other, *scene_, pages_->index(), file_.string());
    edits = std::move(other);
}

SceneEdits Session::edits_now() const {
    SceneEdits now = edits;
    try {
        apply_keys(arguments_.choice.keys, double(timeline_.frame), now);
    } catch (const Error&) {
        return edits;  // posing() has reported it
    }
    return now;
}

void Session::check_keyed(SceneEdits other, const EditKeys& keys) const {
    apply_keys(keys, double(timeline_.frame), other);
    check_edits(other, *scene_, *tree_);
}

bool Session::take_keys(EditKeys keys) {
    if (keys == arguments_.choice.keys) return true;
    arguments_.choice.keys = std::move(keys);
    try {
        timeline_.take_keys(arguments_, *reference_);
        if (const auto free = keyed_pose()) timeline_.with_keys(*free, *reference_);
    } catch (const Error&) {
        return false;
    }
    follow_camera();
    return true;
}

std::vector<Instance> Session::moved_instances(const Scene& scene, const SceneTree& tree, const SceneEdits& edits) {
    Scene frame;  // a copy without meshes and images
    frame.instances = scene.instances;
    frame.lights = scene.lights;
    for (const Mesh& mesh : scene.meshes) frame.meshes.emplace_back().name = mesh.name;
    try {
        SceneEdits moves = surface_edits(edits);
        moves.ground = false;  // nothing to pick
        apply(moves, frame, tree);
        remove_added(frame);  // area_lamp() finds them
    } catch (const Error&) {
        return scene.instances;
    }
    return std::move(frame.instances);
}

const Picker& Session::picker() const {
    SceneEdits moves = surface_edits(edits_now());
    if (pages_ || moves == SceneEdits()) return *picker_;
    if (!edited_picker_ || moves != picked_edits_) {
        edited_picker_ = picker_->with_instances(moved_instances(*scene_, *tree_, moves));
        picked_edits_ = std::move(moves);
    }
    return *edited_picker_;
}

std::optional<PickResult> Session::pick(const dvec2& point, const ivec2& size) const {
    std::vector<bool> one_sided;
    if (modes.backfaces != Backfaces::show) {
        SceneEdits of_materials;
        of_materials.materials = edits_now().materials;
        Scene edited;
        edited.name = scene_->name;
        edited.materials = scene_->materials;
        apply(of_materials, edited);
        for (const Material& material : edited.materials) one_sided.push_back(is_one_sided(material));
    }
    return picker().pick(ray_through(camera(), point, size), one_sided);
}

bool Session::focus(const dvec2& point, const ivec2& size) {
    const auto picked = pick(point, size);
    if (picked) move(look_at(pose_, picked->position));
    return picked.has_value();
}

void Session::focus_lens(const dvec2& point, const ivec2& size) {
    Focus focus;
    if (pages_) {
        focus = {.kind = Focus::Kind::point, .point = glm::clamp(point / dvec2(size), 0.0, 1.0)};
    } else {
        const auto picked = pick(point, size);
        const dmat4& m = camera().camera_to_world;
        focus = {.kind = Focus::Kind::distance, .distance = std::numeric_limits<double>::infinity()};
        if (picked) focus.distance = -glm::dot(picked->position - dvec3(m[3]), dvec3(m[2]));
    }
    choose_focus(focus, {});
}

void Session::choose_focus(const Focus& focus, const Lens& usual) {
    constexpr float kUsualFstop = 2.8f;
    constexpr double kUsualAperture = 10;  // mm, if there is no focal length
    PhysicalCamera& physical = transform.camera;
    Lens& lens = physical.lens;
    const bool exposes = physical.exposes();
    lens.focus = focus;
    if (lens.fstop == 0) lens.fstop = usual.fstop;
    if (lens.aperture == 0) lens.aperture = usual.aperture;
    if (camera().orthographic && lens.aperture == 0) lens.aperture = kUsualAperture;
    if (lens.fstop == 0 && lens.aperture == 0) lens.fstop = kUsualFstop;
    // An f-number alone exposes, but not beside a focus. The usual exposure time keeps the exposure.
    if (exposes && !physical.exposes()) physical.shutter_speed = {float(PhysicalCamera::kUsualSeconds)};
}

void Session::set_depth_of_field(bool on) {
    PhysicalCamera& physical = transform.camera;
    Lens& lens = physical.lens;
    if (!on) {
        switched_off.lens = lens;
        lens.focus = {.kind = Focus::Kind::none};
        lens.aperture = 0;
        // Without a focus, the f-number would decide the exposure.
        if (physical.iso == 0 && physical.shutter_speed.seconds == 0) lens.fstop = 0;
    } else if (const Lens& before = switched_off.lens; before.focus.chosen()) {
        choose_focus(before.focus, before);
    } else {
        focus_lens(dvec2(0.5), ivec2(1));
    }
}

const Constraint* Session::against(const std::function<void(RenderSettings&)>& change) const {
    RenderSettings settings;
    settings.camera = camera_with_lens();
    settings.denoise = modes.denoise, settings.preview = modes.preview;
    if (broken_constraint(settings)) return nullptr;
    change(settings);
    return broken_constraint(settings);
}

Denoising Session::denoising() const {
    return modes.denoise ? Denoising::always : modes.preview.filter ? Denoising::preview : Denoising::off;
}

void Session::set_denoising(Denoising denoising) {
    if (denoising == Denoising::always && !modes.denoise) switched_off.preview = std::exchange(modes.preview, {});
    if (denoising != Denoising::always && modes.denoise) modes.preview = switched_off.preview;
    modes.denoise = denoising == Denoising::always;
    modes.preview.filter = denoising == Denoising::preview;
}

void Session::set_physical_exposure(bool on) {
    PhysicalCamera& physical = transform.camera;
    if (on == physical.exposes()) return;
    if (on) {
        switched_off.exposure = std::exchange(transform.exposure, 0.0f);
        physical.iso = switched_off.iso;
        physical.shutter_speed = switched_off.shutter_speed;
        if (physical.lens.fstop == 0) physical.lens.fstop = switched_off.fstop;
        return;
    }
    switched_off.iso = physical.iso > 0 ? physical.iso : float(PhysicalCamera::kUsualIso);
    switched_off.shutter_speed = physical.shutter_speed;
    switched_off.fstop = physical.lens.fstop;
    transform.exposure = switched_off.exposure;
    physical.iso = 0, physical.shutter_speed = {};
    if (!physical.lens.blurs()) physical.lens.fstop = 0;
}

bool Session::frame_object(const dvec2& point, const ivec2& size) {
    const auto picked = pick(point, size);
    return picked && frame_bounds(picker().bounds(picked->instance), size);
}

bool Session::frame_selection(const ivec2& size) {
    return frame_bounds(selected_bounds(), size);
}

bool Session::frame_all(const ivec2& size) {
    WorldBounds all;
    for (std::size_t i = 0; i < picker().instances().size(); ++i) all = united(all, picker().bounds(i));
    return frame_bounds(pages_ ? world_bounds(*scene_) : all, size);
}

bool Session::frame_bounds(const WorldBounds& box, const ivec2& size) {
    if (box.empty()) return false;
    move(frame(pose_, box, double(size.x) / size.y));
    return true;
}

void Session::bookmark(const std::string& name) {
    const auto known = std::ranges::find(bookmarks, name, &Bookmark::name);
    if (known != bookmarks.end())
        known->pose = pose_;
    else
        bookmarks.push_back({name, pose_});
}

void Session::bookmark() {
    const auto known = [&](const std::string& name) {
        return std::ranges::find(bookmarks, name, &Bookmark::name) != bookmarks.end();
    };
    int number = 1;
    while (known(fmt::format("view {}", number))) ++number;
    bookmark(fmt::format("view {}", number));
}

void Session::recall(const std::string& name) {
    const auto known = std::ranges::find(bookmarks, name, &Bookmark::name);
    if (known == bookmarks.end()) throw Error("bookmarks", "there is no '{}'", name);
    move(known->pose);
}

Request Session::request(const ivec2& size) const {
    return {reference_,
            scene_,
            reference_tree_,
            tree_,
            pages_,
            arguments_.settings.pool_bytes,
            edits_now(),
            timeline_.frame,
            camera_with_lens(),
            size,
            region ? pixels_of(*region, size) : std::nullopt,
            bounces,
            required_aovs(layer_view),
            modes,
            culling,
            measure};
}

std::filesystem::path Session::settings_file() const {
    return arguments_.settings_file.value_or(settings_file_for(file_));
}

SavedSettings Session::saved(const ivec2& size) const {
    SavedSettings s;
    if (scene_camera_) {
        const std::string& name = scene_->cameras[*scene_camera_].name;
        const auto first = std::ranges::find(scene_->cameras, name, &Camera::name) - scene_->cameras.begin();
        const bool tells = !name.empty() && first == static_cast<std::ptrdiff_t>(*scene_camera_);
        s.camera = tells ? name : std::to_string(*scene_camera_);
    } else {
        s.camera = pose_;
    }
    s.given = saved_settings();
    s.settings.view = transform;
    s.settings.optics = arguments_.settings.optics;  // the viewer shows the camera itself
    if (size.x > 0 && size.y > 0) s.size = size;
    s.settings.samples = samples;
    s.settings.bounces = bounces;
    s.settings.preview = modes.preview;
    s.settings.clamp = modes.clamp;
    s.settings.denoise = modes.denoise && samples >= 2;  // `halflight render` needs two samples to denoise, too
    s.settings.backfaces = modes.backfaces;
    s.settings.show_lamps = modes.show_lamps;
    s.variant = arguments_.choice.variant;
    s.line_width = arguments_.choice.line_width;
    s.environment = arguments_.choice.environment;
    if (scene_->environment.name == halflight::name(SkyPreset::neutral))
        s.light_azimuth = arguments_.choice.light_azimuth;
    s.edits = edits;
    s.keys = arguments_.choice.keys;
    if (!timeline_.playing.empty() || timeline_.frame != 0)
        s.moment = {{timeline_.animation, timeline_.frame, timeline_.rate}};
    s.bookmarks = bookmarks;
    return s;
}

void Session::save(const ivec2& size) const {
    write_settings(settings_file(), saved(size));
}

bool Session::settings_changed() const {
    const VersionedFile now = versioned(settings_file());
    return now.version != VersionedFile().version && now.version != arguments_.settings_version.version;
}

void Session::note_saved(const std::filesystem::path& file) {
    if (file != settings_file()) arguments_.settings_file = file;
    arguments_.settings_version = versioned(file);
}

}  // namespace halflight::view
