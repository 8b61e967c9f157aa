#include "tools/view/session.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "api/halflight/camera.h"
#include "api/halflight/loaded_scene.h"
#include "engine/io/environment.h"
#include "engine/io/gltf/parts.h"
#include "tools/cli/settings_parts.h"
#include "tools/view/stale_settings.h"

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

/// Returns the instances as edits move and hide them; unchanged ones where the edits do not suit the scene, which the
/// picture reports.
std::vector<Instance> moved_instances(const Scene& scene, const SceneTree& tree, const SceneEdits& edits) {
    Scene frame;  // a copy without meshes and images
    frame.instances = scene.instances;
    frame.lights = scene.lights;
    for (const Mesh& mesh : scene.meshes) frame.meshes.emplace_back().name = mesh.name;
    try {
        apply(surface_edits(edits), frame, tree);
    } catch (const Error&) {
        return scene.instances;
    }
    return std::move(frame.instances);
}

/// Poses the reference at 0 s of the animation that plays. The new scene takes the images of `images`.
void take_reference(Session::Opened& o, const Scene& images, const Console& console) {
    Timeline& t = o.timeline;
    Scene scene = t.file->at(0, images.images);
    o.own_environment = std::make_shared<const Environment>(scene.environment);
    const bool chosen = !std::holds_alternative<std::monostate>(o.arguments.environment);
    if (chosen && o.reference)
        scene.environment = o.reference->environment, take_sun(scene, *o.reference);  // avoids reading its file again
    else if (chosen || !t.file->drives_light())
        set_environment(scene, o.arguments.environment, console);
    o.reference_tree = std::make_shared<const SceneTree>(t.file->tree_at(0));
    check_edits(o.arguments.edits, scene, *o.reference_tree, o.arguments.edits_source);
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
    o.tree = o.reference_tree;
    t.cameras = o.reference->cameras;
    if (frame > 0 && !t.playing.empty()) {
        const double seconds = t.rate.seconds(frame);
        t.cameras = t.file->cameras_at(seconds);
        if (t.file->surfaces_move()) {
            Scene scene = t.file->at(seconds, o.reference->images);
            scene.environment = o.reference->environment;
            take_sun(scene, *o.reference);
            o.tree = std::make_shared<const SceneTree>(t.file->tree_at(seconds));
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
    opened.variants = timeline.file->gltf().variants();
    take_frame(opened, a.settings.frame);
    if (timeline.animations.empty()) timeline.file.reset();
}

/// Loads a scene whose geometry is in pages. Nothing can be picked in it.
void load_pages(Session::Opened& opened, const Console& console) {
    SceneChoice choice = opened.arguments;
    // RendererCache applies edits; pages refuse those that move surfaces.
    choice.edits = surface_edits(choice.edits);
    if (std::exchange(choice.animation, std::nullopt)) console.note("animations do not play with pages");
    const LoadedScene loaded(choice, opened.arguments, console);
    opened.reference_tree = opened.tree = std::make_shared<const SceneTree>(loaded.tree());
    check_edits(opened.arguments.edits, loaded.scene(), *opened.tree, opened.arguments.edits_source);
    opened.reference = opened.scene = std::make_shared<const Scene>(loaded.scene());
    opened.pages = loaded.pages();
    opened.own_environment = std::make_shared<const Environment>();
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

std::function<Session::Opened()> Session::starting(const PreviewArguments& arguments, const ColorConfig& colors) {
    return [arguments, colors] { return load_with_settings(arguments, colors, Console(arguments.log_level)); };
}

Session::Session(const PreviewArguments& arguments, ColorConfig colors, Opened opened)
    : console_(arguments.log_level), colors_(std::move(colors)) {
    open(std::move(opened));
}

Session::Session(const PreviewArguments& arguments, ColorConfig colors)
    : Session(arguments, colors, load_with_settings(arguments, colors, Console(arguments.log_level))) {}

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
    colors.view(a.settings.view);  // throws for an unknown view transform
    load_whole_or_paged(
        a, [&] { load_whole(opened, console); }, [&] { load_pages(opened, console); });
    const Timeline& timeline = opened.timeline;
    ChosenCamera chosen = choose_camera(*opened.reference, a);  // equals the choice of LoadedScene
    if (chosen.index) chosen.camera = timeline.cameras[*chosen.index];
    with_lens(chosen.camera, a.settings.view.camera.lens);  // throws for a lens that cannot be used
    const WorldBounds box = world_bounds(*opened.scene);
    opened.diagonal = box.empty() || box.lower == box.upper ? 1 : glm::length(box.upper - box.lower);
    const Picker moved = opened.pages
                             ? *opened.picker
                             : opened.picker->with_instances(moved_instances(*opened.scene, *opened.tree, a.edits));
    const double ahead = distance_ahead(chosen.camera, moved, *opened.scene);
    opened.start = {a.pose && !chosen.index ? *a.pose : pose_of(chosen.camera, ahead), chosen.index};
    return opened;
}

std::function<Session::Opened()> Session::opening(const std::filesystem::path& path) const {
    if (has_extension(path, "glb") || has_extension(path, "gltf")) {
        PreviewArguments a;
        a.scene = path;
        a.allow_outside = arguments_.allow_outside;
        a.device = arguments_.device;
        a.log_level = arguments_.log_level;
        a.settings.samples = samples;
        a.settings.preview = modes.preview;
        a.settings.clamp = modes.clamp;
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
    opened.arguments.environment = environment;
    return [opened, console = console_]() mutable {
        Scene other = *opened.reference;
        other.environment = *opened.own_environment;
        set_environment(other, opened.arguments.environment, console);
        opened.reference = std::make_shared<const Scene>(std::move(other));
        take_frame(opened, opened.timeline.frame);
        return opened;
    };
}

std::function<Session::Opened()> Session::dressing(const std::string& variant) const {
    PreviewArguments a = arguments_;
    a.variant = variant;
    a.edits = edits;
    a.edits_source.clear();
    a.animation = timeline_.animation;
    a.settings.frame = timeline_.frame;
    return [a, colors = colors_, console = console_] {
        Opened opened = load(a, colors, console);
        opened.start.reset();
        return opened;
    };
}

SavedSettings Session::document() const {
    SavedSettings document = saved({0, 0});
    document.camera = std::monostate();
    document.moment.reset();
    return document;
}

std::optional<std::function<Session::Opened()>> Session::restore(const SavedSettings& document) {
    edits = document.edits;
    transform = document.settings.view;
    samples = document.settings.samples;
    bounces = document.settings.bounces.value_or(bounces);
    modes = {document.settings.preview, document.settings.clamp};
    bookmarks = document.bookmarks;
    if (document.variant != arguments_.variant) {
        const EnvironmentChoice before = std::exchange(arguments_.environment, document.environment);
        auto opening = dressing(document.variant);  // with the environment of the document
        arguments_.environment = before;
        return opening;
    }
    if (!(document.environment == arguments_.environment)) return lighting(document.environment);
    return std::nullopt;
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
            take_reference(opened, *opened.reference, Console(LogLevel::error));
        }
        take_frame(opened, frame);
        return opened;
    };
}

Session::Opened Session::now() const {
    return {arguments_, reference_, scene_,    reference_tree_, tree_,     own_environment_,
            variants_,  pages_,     timeline_, picker_,         diagonal_, {}};
}

void Session::open(Opened opened) {
    arguments_ = std::move(opened.arguments);
    file_ = arguments_.scene;
    reference_ = std::move(opened.reference), scene_ = std::move(opened.scene), picker_ = std::move(opened.picker);
    reference_tree_ = std::move(opened.reference_tree), tree_ = std::move(opened.tree);
    own_environment_ = std::move(opened.own_environment);
    variants_ = std::move(opened.variants);
    edited_picker_.reset();
    pages_ = std::move(opened.pages);
    timeline_ = std::move(opened.timeline);
    diagonal_ = opened.diagonal;
    if (opened.start) edits = arguments_.edits, selection = {};
    find_references(opened.start.has_value());
    if (!opened.start) return follow_camera();
    warning_ = std::move(opened.warning);
    pose_ = first_pose_ = opened.start->pose;
    scene_camera_ = first_camera_ = opened.start->camera;
    transform = arguments_.settings.view;
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
    pose_ = pose_of(camera(), distance_ahead(camera(), picker(), *scene_));
}

void Session::take_camera(const std::string& name_or_number) {
    take_camera(*choose_camera(*scene_, {.camera = name_or_number}).index);
}

void Session::reset_camera() {
    pose_ = first_pose_;
    scene_camera_ = first_camera_;
    follow_camera();
}

void Session::edit(SceneEdits other) {
    check_edits(other, *scene_, *tree_);
    if (pages_ && change_surfaces(other)) throw Error(file_.string(), "nodes and surfaces cannot change with pages");
    edits = std::move(other);
}

const Picker& Session::picker() const {
    SceneEdits moves = surface_edits(edits);
    if (pages_ || moves == SceneEdits()) return *picker_;
    if (!edited_picker_ || moves != picked_edits_) {
        edited_picker_ = picker_->with_instances(moved_instances(*scene_, *tree_, moves));
        picked_edits_ = std::move(moves);
    }
    return *edited_picker_;
}

std::optional<PickResult> Session::pick(const dvec2& point, const ivec2& size) const {
    return picker().pick(ray_through(camera(), point, size));
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
    if (picked) move(frame(pose_, picker().bounds(picked->instance), double(size.x) / size.y));
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
    return {reference_, scene_,          reference_tree_,
            tree_,      pages_,          arguments_.settings.pool_bytes,
            edits,      timeline_.frame, camera_with_lens(),
            size,       bounces,         required_aovs(layer_view),
            modes,      culling,         measure};
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
    if (edits.clay) words.emplace_back("clay");
    const auto count = [&](std::size_t number, const char* what, const char* how) {
        if (number > 0) words.push_back(fmt::format("{} {}{} {}", number, what, number == 1 ? "" : "s", how));
    };
    for (const auto& [name, edit, source] : edits.lights)
        if (edit != LightEdit()) words.push_back(fmt::format("light {} edited", name));
    count(edits.materials.size(), "material", "edited");
    count(edits.transforms.size(), "instance", "moved");
    count(edits.nodes.size(), "node", "moved");
    count(edits.hidden.size(), "name", "hidden");
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
    s.settings.optics = arguments_.settings.optics;  // the viewer shows the camera itself
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
