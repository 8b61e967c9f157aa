#include "renderer/focus.h"

#include <cmath>
#include <limits>

#include "renderer/render.h"
#include "shaders/shared/aov_record.h"

namespace halflight {
namespace {

/// Returns a pinhole camera that sees the point at the centre of its picture, as the eye does whose half of the picture
/// has the point. `along`: distance along its line of sight per distance along that of `camera`.
Camera camera_through(const Camera& camera, double aspect, double& along) {
    const Optics& optics = camera.optics;
    const dvec2 eyes = eyes_in_picture(optics), place = eyes * camera.lens.focus.point;
    const dvec2 number = glm::min(glm::floor(place), eyes - 1.0), at = 2.0 * (place - number) - 1.0;
    // Pictures of one eye have the focus of the camera, so that both have the same.
    const double eye = eyes == dvec2(1) ? 0 : (number.x + number.y > 0 ? 0.5 : -0.5) * optics.eye_distance;
    const double toe_in = optics.convergence > 0 ? 1 / optics.convergence : 0;
    const double half = camera.orthographic ? 0.5 * camera.ortho_height : std::tan(0.5 * camera.vertical_fov);
    const dvec3 offset(at.x * half * aspect, -at.y * half, 0);
    const dmat3 axes(camera.camera_to_world);
    Camera through = camera;
    through.lens = {};
    through.optics = {};
    through.camera_to_world[3] += dvec4(axes * dvec3(eye, 0, 0), 0);
    along = 1;
    if (camera.orthographic) {
        through.camera_to_world[3] += dvec4(axes * offset, 0);
        return through;
    }
    const dvec3 back = dvec3(toe_in * eye, 0, 1) - offset;
    along = glm::length(back);
    const dvec3 z = back / along, x = glm::normalize(glm::cross(dvec3(0, 1, 0), z));
    const dmat3 turned = axes * dmat3(x, glm::cross(z, x), z);
    for (int i = 0; i < 3; ++i) through.camera_to_world[i] = dvec4(turned[i], 0);
    through.vertical_fov = 1e-3;
    through.near_plane *= along;
    through.far_plane *= along;
    return through;
}

}  // namespace

double find_focus(PreparedScene& scene, const ColorConfig& colors, const RenderSettings& settings,
                  const Camera& camera) {
    double along = 1;
    RenderSettings s;
    s.camera = camera_through(camera, eye_aspect(camera.optics, {settings.width, settings.height}), along);
    s.width = s.height = 1;
    s.samples = 1;
    s.bounces = 0;
    s.primary = PrimaryVisibility::traced;
    s.backfaces = settings.backfaces;
    s.culling = rays::Culling::off;
    s.aovs = {"depth"};
    s.kept = scene.kept();
    s.pictures = 1;
    const float depth = *Renderer(scene, colors, s).render().aovs.at(0).image.at(0, 0);
    return depth == shared::kNoDepth ? std::numeric_limits<double>::infinity() : double{depth} / along;
}

}  // namespace halflight
