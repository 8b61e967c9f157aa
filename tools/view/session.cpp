#include "tools/view/session.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "engine/io/environment.h"
#include "tools/halflight/camera.h"
#include "tools/halflight/loading.h"

namespace halflight::view {
namespace {

/// How far ahead of a camera is what it looks at: the surface in the middle of its view, else the scene's centre.
double distance_ahead(const Camera& camera, const Picker& picker, const Scene& scene) {
    const Ray ray = ray_through(camera, {0.5, 0.5}, {1, 1});
    if (const auto picked = picker.pick(ray)) return glm::length(picked->position - ray.origin);
    const WorldBounds box = world_bounds(scene);
    if (box.empty()) return 1;
    const double ahead = glm::dot(0.5 * box.lower + 0.5 * box.upper - ray.origin, ray.direction);
    return ahead > 0 ? ahead : std::max(glm::length(box.upper - box.lower), 1e-6);
}

}  // namespace

Session::Session(const PreviewArguments& arguments, ColorConfig colors)
    : console_(arguments.quiet), colors_(std::move(colors)) {
    load(arguments);
}

void Session::load(const PreviewArguments& a) {
    Scene loaded = load_scene(a.scene, a.allow_outside, console_);
    set_environment(loaded, a.environment, console_);
    const ChosenCamera chosen = choose_camera(loaded, a);
    const auto scene = std::make_shared<const Scene>(std::move(loaded));
    const auto picker = std::make_shared<const Picker>(scene);
    const CameraPose pose =
        a.pose && !chosen.index ? *a.pose : pose_of(chosen.camera, distance_ahead(chosen.camera, *picker, *scene));
    const WorldBounds box = world_bounds(*scene);
    colors_.view(a.view);  // throws where it is unknown
    // Nothing fails any more.
    arguments_ = a;
    file_ = a.scene;
    scene_ = scene, picker_ = picker;
    diagonal_ = box.empty() || box.lower == box.upper ? 1 : glm::length(box.upper - box.lower);
    pose_ = first_pose_ = pose;
    scene_camera_ = first_camera_ = chosen.index;
    transform = a.view;
    edits = a.edits;
    bounces = a.bounces;
    samples = a.samples.value_or(samples);
    bookmarks = a.bookmarks;
}

void Session::open(const std::filesystem::path& path) {
    if (has_extension(path, "glb") || has_extension(path, "gltf")) {
        PreviewArguments a;
        a.scene = path;
        a.allow_outside = arguments_.allow_outside;
        a.device = arguments_.device;
        a.quiet = arguments_.quiet;
        take_settings(a);
        load(a);
    } else if (has_extension(path, "exr") || has_extension(path, "hdr")) {
        Scene other = *scene_;
        set_environment(other, path, console_);
        arguments_.environment = path;
        scene_ = std::make_shared<const Scene>(std::move(other));
        picker_ = std::make_shared<const Picker>(scene_);
    } else {
        throw Error(path.string(), "is neither a scene (.glb, .gltf) nor an environment (.exr, .hdr)");
    }
}

Camera Session::camera() const {
    return scene_camera_ ? scene_->cameras[*scene_camera_] : camera_of(pose_);
}

void Session::move(const CameraPose& pose) {
    if (pose == pose_) return;
    camera_of(pose);  // throws where it makes none
    pose_ = pose;
    scene_camera_.reset();
}

void Session::take_camera(std::size_t index) {
    scene_camera_ = index;
    pose_ = pose_of(camera(), distance_ahead(camera(), *picker_, *scene_));
}

void Session::take_camera(const std::string& name_or_number) {
    ViewArguments a;
    a.camera = name_or_number;
    take_camera(*choose_camera(*scene_, a).index);
}

void Session::reset_camera() {
    pose_ = first_pose_;
    scene_camera_ = first_camera_;
}

std::optional<Picked> Session::pick(const dvec2& point, const ivec2& size) const {
    return picker_->pick(ray_through(camera(), point, size));
}

bool Session::focus(const dvec2& point, const ivec2& size) {
    const auto picked = pick(point, size);
    if (picked) move(look_at(pose_, picked->position));
    return picked.has_value();
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

Wanted Session::wanted(const ivec2& size) const {
    return {scene_, edits, pose_, scene_camera_, size, bounces, aovs_of(view), measure};
}

Request Session::request(const Wanted& w) const {
    return {w.scene, w.edits, camera(), w.size, w.bounces, w.aovs, w.measure};
}

std::filesystem::path Session::settings_file() const {
    return arguments_.settings.value_or(settings_file_of(file_));
}

SavedSettings Session::saved() const {
    SavedSettings s;
    if (scene_camera_) {
        const std::string& name = scene_->cameras[*scene_camera_].name;
        const auto first = std::ranges::find(scene_->cameras, name, &Camera::name) - scene_->cameras.begin();
        const bool tells = !name.empty() && first == static_cast<std::ptrdiff_t>(*scene_camera_);
        s.camera = tells ? name : std::to_string(*scene_camera_);
    } else {
        s.camera = pose_;
    }
    s.view = transform;
    s.samples = samples;
    s.bounces = bounces;
    s.environment = arguments_.environment;
    s.edits = edits;
    s.bookmarks = bookmarks;
    return s;
}

void Session::save() const {
    write_settings(settings_file(), saved());
}

}  // namespace halflight::view
