#include "tools/view/session.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "api/halflight/camera.h"
#include "api/halflight/loaded_scene.h"
#include "engine/io/environment.h"
#include "engine/io/gltf/parts.h"

namespace halflight::view {
namespace {

/// Returns the distance from a camera to the surface in the middle of its view, else to the scene's centre.
double distance_ahead(const Camera& camera, const Picker& picker, const Scene& scene) {
    const Ray ray = ray_through(camera, {0.5, 0.5}, {1, 1});
    if (const auto picked = picker.pick(ray)) return glm::length(picked->position - ray.origin);
    const WorldBounds box = world_bounds(scene);
    if (box.empty()) return 1;
    const double ahead = glm::dot(0.5 * box.lower + 0.5 * box.upper - ray.origin, ray.direction);
    return ahead > 0 ? ahead : std::max(glm::length(box.upper - box.lower), 1e-6);
}

/// Opens the scene's file and returns the timeline of its animations. Throws Error.
Timeline timeline_of(const PreviewArguments& a, const Console& console) {
    Timeline t;
    t.file = std::make_shared<SceneFile>(a.scene, gltf_options(a));
    t.animation = a.animation.value_or("none");
    try {
        t.animations = titles(t.file->gltf().animations());
    } catch (const Error& error) {
        if (t.animation != "none") throw;
        console.warn("{}", error.what());  // the scene at rest can still be shown
    }
    if (!t.animations.empty()) t.file->set_frame_rate(a.frame_rate, console);
    t.file->play(t.animation, console);
    t.rate = t.file->frame_rate();
    t.playing = t.file->playing();
    return t;
}

/// Moves the instances that the settings file moves, so that picking, bounds and motion agree with the picture. Panels
/// do not change these edits. RendererCache applies all edits later; it sets the same transforms again.
void take_transforms(const PreviewArguments& a, Scene& scene) {
    apply({.transforms = a.edits.transforms}, scene, a.edits_source);
}

/// Poses the reference at 0 s of the animation that plays. The new scene takes the images of `images`.
void take_reference(Session::Opened& o, const Scene& images, const Console& console) {
    Timeline& t = o.timeline;
    Scene scene = t.file->at(0, images.images);
    const bool chosen = !std::holds_alternative<std::monostate>(o.arguments.environment);
    if (chosen && o.reference)
        scene.environment = o.reference->environment, take_sun(scene, *o.reference);  // avoids reading its file again
    else if (chosen || !t.file->drives_light())
        set_environment(scene, o.arguments.environment, console);
    check_edits(o.arguments.edits, scene, o.arguments.edits_source);
    take_transforms(o.arguments, scene);
    o.reference = std::make_shared<const Scene>(std::move(scene));
    o.scene.reset();
    t.last = last_frame(t.file->end(), t.rate);
}

/// Poses scene and cameras at a frame. The scene is that of the reference if the animation drives cameras only.
void take_frame(Session::Opened& o, std::uint32_t frame) {
    Timeline& t = o.timeline;
    t.frame = frame;
    const auto before = o.scene;
    o.scene = o.reference;
    t.cameras = o.reference->cameras;
    if (frame > 0 && !t.playing.empty()) {
        const double seconds = t.rate.seconds(frame);
        t.cameras = t.file->cameras_at(seconds);
        if (t.file->surfaces_move()) {
            Scene scene = t.file->at(seconds, o.reference->images);
            scene.environment = o.reference->environment;
            take_sun(scene, *o.reference);
            take_transforms(o.arguments, scene);
            o.scene = std::make_shared<const Scene>(std::move(scene));
        }
    }
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
    take_frame(opened, a.settings.frame);
    if (timeline.animations.empty()) timeline.file.reset();
}

/// Loads a scene whose geometry is in pages. Nothing can be picked in it.
void load_pages(Session::Opened& opened, const Console& console) {
    SceneChoice choice = opened.arguments;
    choice.edits = {.transforms = choice.edits.transforms};  // RendererCache applies the others
    if (std::exchange(choice.animation, std::nullopt)) console.note("animations do not play with pages");
    const LoadedScene loaded(choice, opened.arguments, console);
    check_edits(opened.arguments.edits, loaded.scene(), opened.arguments.edits_source);
    opened.reference = opened.scene = std::make_shared<const Scene>(loaded.scene());
    opened.pages = loaded.pages();
    opened.picker = std::make_shared<const Picker>(opened.pages ? std::make_shared<const Scene>() : opened.scene);
    opened.timeline = {};
    opened.timeline.cameras = opened.reference->cameras;
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

std::uint32_t last_frame(double end, const FrameRate& rate) {
    constexpr double kRounding = 1e-3;  // tolerance, frames, since files store times as floats
    constexpr double kMost = 1e6;
    const double frames = std::floor(end * rate.numerator / rate.denominator + kRounding);
    return static_cast<std::uint32_t>(std::clamp(frames, 0.0, kMost));
}

Session::Session(const PreviewArguments& arguments, ColorConfig colors)
    : console_(arguments.quiet), colors_(std::move(colors)) {
    open(load(arguments, colors_, console_));
}

Session::Opened Session::load(const PreviewArguments& a, const ColorConfig& colors, const Console& console) {
    Opened opened;
    opened.arguments = a;
    colors.view(a.settings.view);  // throws for an unknown view transform
    load_whole_or_paged(
        a, [&] { load_whole(opened, console); }, [&] { load_pages(opened, console); });
    const Timeline& timeline = opened.timeline;
    ChosenCamera chosen = choose_camera(*opened.reference, a);  // equals the choice of LoadedScene
    if (chosen.index) chosen.camera = timeline.cameras[*chosen.index];
    const WorldBounds box = world_bounds(*opened.scene);
    opened.diagonal = box.empty() || box.lower == box.upper ? 1 : glm::length(box.upper - box.lower);
    const double ahead = distance_ahead(chosen.camera, *opened.picker, *opened.scene);
    opened.start = {a.pose && !chosen.index ? *a.pose : pose_of(chosen.camera, ahead), chosen.index};
    return opened;
}

std::function<Session::Opened()> Session::opening(const std::filesystem::path& path) const {
    if (has_extension(path, "glb") || has_extension(path, "gltf")) {
        PreviewArguments a;
        a.scene = path;
        a.allow_outside = arguments_.allow_outside;
        a.device = arguments_.device;
        a.quiet = arguments_.quiet;
        a.settings.samples = samples;
        a.settings.preview = modes.preview;
        a.settings.clamp = modes.clamp;
        return [a, colors = colors_, console = console_]() mutable {
            take_settings(a);
            return load(a, colors, console);
        };
    }
    if (has_extension(path, "exr") || has_extension(path, "hdr")) {
        Opened opened = now();
        opened.arguments.environment = path;
        return [opened, console = console_]() mutable {
            Scene other = *opened.reference;
            set_environment(other, opened.arguments.environment, console);
            opened.reference = std::make_shared<const Scene>(std::move(other));
            take_frame(opened, opened.timeline.frame);
            return opened;
        };
    }
    throw Error(path.string(), "is neither a scene (.glb, .gltf) nor an environment (.exr, .hdr)");
}

std::function<Session::Opened()> Session::posing(const std::string& animation, std::uint32_t frame) const {
    if (!timeline_.file) throw Error(file_.string(), "has no animations");
    return [opened = now(), animation, frame, console = console_]() mutable {
        Timeline& timeline = opened.timeline;
        const bool other = animation != timeline.animation;
        timeline.file->play(animation, other ? console : Log());  // a failed attempt may have selected another one
        if (other) {
            timeline.playing = timeline.file->playing();
            timeline.animation = animation;
            take_reference(opened, *opened.reference, Console(true));
        }
        take_frame(opened, frame);
        return opened;
    };
}

Session::Opened Session::now() const {
    return {arguments_, reference_, scene_, pages_, timeline_, picker_, diagonal_, {}};
}

void Session::open(Opened opened) {
    arguments_ = std::move(opened.arguments);
    file_ = arguments_.scene;
    reference_ = std::move(opened.reference), scene_ = std::move(opened.scene), picker_ = std::move(opened.picker);
    pages_ = std::move(opened.pages);
    timeline_ = std::move(opened.timeline);
    diagonal_ = opened.diagonal;
    if (!opened.start) return follow_camera();
    pose_ = first_pose_ = opened.start->pose;
    scene_camera_ = first_camera_ = opened.start->camera;
    transform = arguments_.settings.view;
    edits = arguments_.edits;
    bounces = arguments_.settings.bounces.value_or(default_bounces(*scene_));
    samples = arguments_.settings.samples;
    modes = {arguments_.settings.preview, arguments_.settings.clamp};
    bookmarks = arguments_.bookmarks;
    if (scene_camera_) take_lens(camera());
    with_lens(camera(), transform.camera.lens);  // throws for a lens that cannot be used
}

void Session::take_lens(const Camera& camera) {
    Lens& lens = transform.camera.lens;
    if (taken_lens_ && lens == *taken_lens_) lens = asked_lens_;  // nobody has edited that of another camera
    taken_lens_.reset();
    if (lens.focus.kind != Focus::Kind::open || !camera.lens.blurs()) return;
    asked_lens_ = lens;
    taken_lens_ = lens = with_lens(camera, lens).lens;
}

Camera Session::camera() const {
    return scene_camera_ ? timeline_.cameras[*scene_camera_] : camera_of(pose_);
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
    if (scene_camera_ && !timeline_.playing.empty()) pose_ = pose_of(camera(), glm::length(pose_.at - pose_.from));
}

void Session::move(const CameraPose& pose) {
    if (pose == pose_) return;
    camera_of(pose);  // throws for an invalid pose
    pose_ = pose;
    scene_camera_.reset();
}

void Session::take_camera(std::size_t index) {
    scene_camera_ = index;
    take_lens(camera());
    pose_ = pose_of(camera(), distance_ahead(camera(), *picker_, *scene_));
}

void Session::take_camera(const std::string& name_or_number) {
    take_camera(*choose_camera(*scene_, {.camera = name_or_number}).index);
}

void Session::reset_camera() {
    pose_ = first_pose_;
    scene_camera_ = first_camera_;
    follow_camera();
}

std::optional<PickResult> Session::pick(const dvec2& point, const ivec2& size) const {
    return picker_->pick(ray_through(camera(), point, size));
}

bool Session::focus(const dvec2& point, const ivec2& size) {
    const auto picked = pick(point, size);
    if (picked) move(look_at(pose_, picked->position));
    return picked.has_value();
}

void Session::focus_lens(const dvec2& point, const ivec2& size) {
    constexpr float kUsualFstop = 2.8f;
    constexpr double kUsualAperture = 10;  // mm, where there is no focal length
    Lens& lens = transform.camera.lens;
    Focus& focus = lens.focus;
    if (pages_) {
        focus = {.kind = Focus::Kind::point, .point = glm::clamp(point / dvec2(size), 0.0, 1.0)};
    } else {
        const auto picked = pick(point, size);
        const dmat4& m = camera().camera_to_world;
        focus = {.kind = Focus::Kind::distance, .distance = std::numeric_limits<double>::infinity()};
        if (picked) focus.distance = -glm::dot(picked->position - dvec3(m[3]), dvec3(m[2]));
    }
    if (camera().orthographic && lens.aperture == 0) lens.aperture = kUsualAperture;
    if (lens.fstop == 0 && lens.aperture == 0) lens.fstop = kUsualFstop;
}

bool Session::frame_object(const dvec2& point, const ivec2& size) {
    const auto picked = pick(point, size);
    if (picked) move(frame(pose_, picker_->bounds(picked->instance), double(size.x) / size.y));
    return picked.has_value();
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
    Request r{reference_,
              scene_,
              pages_,
              arguments_.settings.pool_bytes,
              edits,
              timeline_.frame,
              camera_with_lens(),
              size,
              bounces,
              required_aovs(layer_view),
              modes,
              culling,
              measure};
    if (estimate_error && std::ranges::find(r.aovs, "variance") == r.aovs.end()) r.aovs.emplace_back("variance");
    return r;
}

std::string Session::description() const {
    std::vector<std::string> words = {layer_view.layer};
    if (!timeline_.playing.empty())
        words.push_back(fmt::format("animation {}, frame {}", timeline_.animation, timeline_.frame));
    for (std::size_t i = 0; i < kComponents.size(); ++i)
        if (layer_view.is_sum() && !layer_view.components[i]) words.push_back(fmt::format("no {}", kComponents[i]));
    const auto factor = [&](const char* what, float value) {
        if (value != 1) words.push_back(fmt::format("{} x {:g}", what, value));
    };
    factor("environment", edits.environment_intensity);
    if (edits.environment_rotation != 0) words.push_back(fmt::format("turned by {:g} deg", edits.environment_rotation));
    if (edits.environment_tint != vec3(1)) words.emplace_back("tinted");
    factor("emission", edits.emission);
    for (std::size_t i = 0; i < edits.lights.size(); ++i) {
        factor(fmt::format("light {}", i).c_str(), edits.lights[i].factor);
        if (edits.lights[i].color) words.push_back(fmt::format("light {} coloured", i));
        if (edits.lights[i].position || edits.lights[i].direction) words.push_back(fmt::format("light {} moved", i));
    }
    if (edits.clay) words.emplace_back("clay");
    const auto count = [&](std::size_t number, const char* what, const char* how) {
        if (number > 0) words.push_back(fmt::format("{} {}{} {}", number, what, number == 1 ? "" : "s", how));
    };
    count(edits.materials.size(), "material", "edited");
    count(edits.transforms.size(), "instance", "moved");
    if (modes.preview.any()) words.push_back(fmt::format("preview {}", text(modes.preview)));
    if (modes.clamp > 0) words.push_back(fmt::format("clamped to {:g}", modes.clamp));
    words.push_back(fmt::format("{} bounces", bounces));
    return fmt::format("{}", fmt::join(words, ", "));
}

std::filesystem::path Session::settings_file() const {
    return arguments_.settings_file.value_or(settings_file_of(file_));
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
    if (size.x > 0 && size.y > 0) s.size = size;
    s.settings.samples = samples;
    s.settings.bounces = bounces;
    s.settings.preview = modes.preview;
    s.settings.clamp = modes.clamp;
    s.variant = arguments_.variant;
    s.line_width = arguments_.line_width;
    s.environment = arguments_.environment;
    s.edits = edits;
    if (!timeline_.playing.empty() || timeline_.frame > 0)
        s.moment = {{timeline_.animation, timeline_.frame, timeline_.rate}};
    s.bookmarks = bookmarks;
    return s;
}

void Session::save(const ivec2& size) const {
    write_settings(settings_file(), saved(size));
}

}  // namespace halflight::view
