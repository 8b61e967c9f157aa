#include "api/halflight/camera.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>

#include "api/first_picture/default_camera.h"
#include "engine/core/error.h"
#include "engine/core/suggestion.h"
#include "engine/scene/skies.h"
#include "engine/settings/render_settings.h"

namespace halflight {
namespace {

std::string list_of_cameras(const Scene& scene) {
    std::string list;
    for (std::size_t i = 0; i < scene.cameras.size(); ++i)
        list += fmt::format("{}{} '{}'", i == 0 ? "" : ", ", i, scene.cameras[i].name);
    return list.empty() ? "it has none" : "its cameras: " + list;
}

}  // namespace

std::size_t find_camera(const Scene& scene, const std::string& wanted, const std::string& source) {
    // Names come before numbers, since a name may be a number.
    const auto named = std::ranges::find(scene.cameras, wanted, &Camera::name);
    if (named != scene.cameras.end()) return static_cast<std::size_t>(named - scene.cameras.begin());
    std::size_t index = 0;
    const auto [end, error] = std::from_chars(wanted.data(), wanted.data() + wanted.size(), index);
    if (error == std::errc() && end == wanted.data() + wanted.size() && index < scene.cameras.size()) return index;
    const std::string subject = source.empty() ? scene.name : fmt::format("{}: {}", source, scene.name);
    std::vector<std::string> names;
    for (const Camera& camera : scene.cameras) names.push_back(camera.name);
    throw Error(subject, "no camera '{}': {}{}", wanted, list_of_cameras(scene), did_you_mean(wanted, names));
}

namespace {

ChosenCamera chosen_default(const Scene& scene, const CameraChoice& c, const rays::LazyProbe& probe,
                            View view = View::automatic) {
    const double aspect = c.aspect > 0 ? c.aspect : kUsualAspect;
    const WorldBounds box = world_bounds(scene);
    DefaultCamera made{framing_camera(scene, aspect, c.turntable > 0), 0.5 * box.lower + 0.5 * box.upper};
    if (!scene.paged_bounds && !box.empty()) made = default_camera(probe.get(), aspect, view, c.turntable > 0);
    if (view == View::inside && !made.inside)
        throw Error("camera 'inside'", scene.paged_bounds ? "scenes in pages are seen from outside"
                                                          : "no place in the scene is enclosed and wide enough");
    ChosenCamera chosen{made.camera, std::nullopt,
                        made.inside     ? "inside the scene"
                        : made.left_out ? "that frames most of the scene, but not its outliers"
                                        : "that frames the scene"};
    chosen.pivot = box.empty() ? dvec3(made.camera.camera_to_world[3]) : made.centre;
    chosen.options = camera_options(made.camera, box.empty() ? dvec3(0) : made.centre);
    return chosen;
}

/// Returns whether a camera shows no surface at all: neither a vertex nor a ray's hit is in its picture.
bool is_blind(const Scene& scene, const Camera& camera, const rays::LazyProbe& probe) {
    constexpr int kColumns = 64;
    constexpr std::size_t kMostVertices = 4096;  // vertices of each mesh that are tested
    const double aspect = camera.aspect > 0 ? camera.aspect : kUsualAspect;
    const double half = camera.orthographic ? camera.ortho_height / 2 : std::tan(camera.vertical_fov / 2);
    const dmat4 to_camera = glm::inverse(camera.camera_to_world);
    for (const Instance& instance : scene.instances) {
        const std::vector<vec3>& positions = scene.meshes[static_cast<std::size_t>(instance.mesh)].positions;
        for (std::size_t i = 0; i < positions.size(); i += positions.size() / kMostVertices + 1) {
            const dvec3 p(to_camera * (instance.object_to_world * dvec4(positions[i], 1)));
            const double reach = half * (camera.orthographic ? 1 : -p.z);
            if (p.z < 0 && std::abs(p.y) <= reach && std::abs(p.x) <= reach * aspect) return false;
        }
    }
    return !scene.instances.empty() && glimpse(probe.get(), camera, aspect, kColumns).seen == 0;
}

ChosenCamera camera_of_choice(const Scene& scene, const CameraChoice& c, const rays::LazyProbe& probe) {
    if (c.look_from) {
        if (!c.look_at) throw Error("camera", "look_from needs look_at");
        return {look_at_camera(*c.look_from, *c.look_at, c.up, glm::radians(c.vertical_fov)), std::nullopt,
                "of the command line"};
    }
    if (c.pose) return {camera_of(*c.pose), std::nullopt, "of the settings"};
    if (c.camera && (c.camera == kInsideCamera || c.camera == kOutsideCamera) &&
        std::ranges::find(scene.cameras, *c.camera, &Camera::name) == scene.cameras.end())
        return chosen_default(scene, c, probe, c.camera == kInsideCamera ? View::inside : View::outside);
    if (c.camera) {
        const std::size_t index = find_camera(scene, *c.camera, c.source);
        const Camera& camera = scene.cameras[index];
        return {camera, index, fmt::format("'{}' of the scene", camera.name)};
    }
    if (scene.cameras.empty()) return chosen_default(scene, c, probe);
    const bool asks = c.replace_blind || c.warn_of_blind;
    const bool blind = asks && !scene.paged_bounds && is_blind(scene, scene.cameras[0], probe);
    ChosenCamera chosen{scene.cameras[0], 0, fmt::format("'{}', the scene's first", scene.cameras[0].name)};
    if (blind && c.replace_blind) chosen = chosen_default(scene, c, probe);
    if (blind)
        chosen.warning = fmt::format("camera '{}' sees no surface{}", scene.cameras[0].name,
                                     c.replace_blind ? ", so a default camera replaces it (--camera 0 keeps it)"
                                                     : " (--camera outside shows the scene)");
    return chosen;
}

}  // namespace

std::string camera_options(const Camera& camera, const dvec3& at) {
    const dmat4& m = camera.camera_to_world;
    const dvec3 from(m[3]);
    const double distance = std::max(glm::dot(from - at, dvec3(m[2])), 1e-3 * glm::length(from));
    const dvec3 target = from - dvec3(m[2]) * (distance > 0 ? distance : 1);
    const auto point = [](const dvec3& p) { return fmt::format("{},{},{}", p.x, p.y, p.z); };
    return fmt::format("--look-from={} --look-at={} --vfov={:.9g}", point(from), point(target),
                       glm::degrees(camera.vertical_fov));
}

ChosenCamera choose_camera(const Scene& scene, const CameraChoice& c, const rays::LazyProbe* probe) {
    const rays::LazyProbe own(scene);
    ChosenCamera chosen = camera_of_choice(scene, c, probe ? *probe : own);
    if (c.override_fov && chosen.camera.orthographic)
        throw Error("camera '" + chosen.camera.name + "'", "is orthographic, and has no field of view (--vfov)");
    if (c.override_fov && !c.look_from) {
        chosen.camera.vertical_fov = glm::radians(*c.override_fov);
        chosen.options.clear();  // the camera no longer fits the scene
    }
    if (c.turntable == 0 || !chosen.options.empty()) return chosen;
    const WorldBounds box = world_bounds(scene);
    if (c.look_from)
        chosen.pivot = *c.look_at;
    else if (c.pose)
        chosen.pivot = c.pose->at;
    else if (box.empty())
        chosen.pivot = dvec3(chosen.camera.camera_to_world[3]);
    else
        chosen.pivot = 0.5 * box.lower + 0.5 * box.upper;
    return chosen;
}

std::optional<Camera> free_camera(const Scene& scene, const CameraChoice& c) {
    ChosenCamera chosen = choose_camera(scene, c);
    return chosen.index ? std::nullopt : std::optional(std::move(chosen.camera));
}

double azimuth_of_light(const Scene& scene, const CameraChoice& c) {
    return view_azimuth(choose_camera(scene, c).camera);
}

Lens merged(Lens lens, const Lens& wanted) {
    if (wanted.fstop > 0) lens.fstop = wanted.fstop, lens.aperture = 0;
    if (wanted.aperture > 0) lens.aperture = wanted.aperture;
    if (wanted.sensor > 0) lens.sensor = wanted.sensor;
    if (wanted.blades > 0) lens.blades = wanted.blades;
    if (wanted.rotation != 0) lens.rotation = wanted.rotation;
    if (wanted.focus.kind != Focus::Kind::open) lens.focus = wanted.focus;
    return lens;
}

Camera with_lens(Camera camera, const Lens& wanted) {
    camera.lens = merged(camera.lens, wanted);
    Lens& lens = camera.lens;
    if (wanted.aperture > 0 && lens.focus.kind == Focus::Kind::open)
        throw Error("aperture", "blurs nothing without a focus (--focus)");
    if (lens.focus.chosen() && !lens.blurs())
        throw Error("focus", "needs an f-number (--fstop) or an aperture (--aperture)");
    if (const std::string problem = lens_problem(camera); !problem.empty()) throw Error("lens", problem);
    if (!lens.blurs()) lens = {};
    return camera;
}

Optics effective(Optics optics) {
    constexpr Optics kUsual;
    if (!optics.is_fisheye()) optics.fisheye_fov = kUsual.fisheye_fov;
    if (optics.stereo == Stereo::none)
        optics.eye_distance = kUsual.eye_distance, optics.convergence = kUsual.convergence;
    return optics;
}

Camera with_optics(Camera camera, const Optics& wanted) {
    camera.optics = wanted;
    if (wanted.projection != Projection::camera) {
        camera.orthographic = false;
        camera.aspect = wanted.projection == Projection::panorama ? 2 : 1;
    }
    if (const std::string problem = optics_problem(camera); !problem.empty()) throw Error("render settings", problem);
    camera.optics = effective(wanted);
    const dvec2 eyes = eyes_in_picture(wanted);
    if (eyes != dvec2(1)) camera.aspect = (camera.aspect > 0 ? camera.aspect : kUsualAspect) * eyes.x / eyes.y;
    return camera;
}

ivec2 picture_size(std::optional<int> width, std::optional<int> height, int default_width, const Camera& camera) {
    const double aspect = camera.aspect > 0 ? camera.aspect : kUsualAspect;
    const dvec2 eyes = eyes_in_picture(camera.optics);  // each has whole pixels
    const auto pixels = [](double x, double n) {
        return static_cast<int>(n * std::clamp(std::round(x / n), 1.0, kMaxSide / n));
    };
    if (width) return {*width, height ? *height : pixels(*width / aspect, eyes.y)};
    if (height) return {pixels(*height * aspect, eyes.x), *height};
    return {default_width, pixels(default_width / aspect, eyes.y)};
}

dmat4 standard_clip(const Camera& camera, double aspect) {
    // Readers of the attribute use x, y and w; any range of depth will do if the camera sets none.
    const double near_plane = camera.near_plane > 0 ? camera.near_plane : 1;
    const bool bounded = camera.far_plane > near_plane;
    dmat4 projection;
    if (camera.orthographic) {
        const double y = camera.ortho_height / 2, x = y * aspect;
        projection = glm::ortho(-x, x, -y, y, near_plane, bounded ? camera.far_plane : 2 * near_plane);
    } else if (bounded) {
        projection = glm::perspective(camera.vertical_fov, aspect, near_plane, camera.far_plane);
    } else {
        projection = glm::infinitePerspective(camera.vertical_fov, aspect, near_plane);
    }
    return projection * glm::inverse(camera.camera_to_world);
}

}  // namespace halflight
