#include <algorithm>
#include <array>
#include <cmath>

#include "engine/core/error.h"
#include "engine/scene/scene.h"

namespace halflight {
namespace {

bool finite(const dvec3& v) {
    return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

/// Scales a vector by a power of two, so that the square of its length neither underflows nor overflows. The direction
/// is kept bit for bit.
dvec3 of_moderate_length(const dvec3& v) {
    int exponent = 0;
    std::frexp(std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}), &exponent);
    return {std::ldexp(v.x, -exponent), std::ldexp(v.y, -exponent), std::ldexp(v.z, -exponent)};
}

}  // namespace

Camera look_at_camera(const dvec3& from, const dvec3& at, const dvec3& up, double vertical_fov) {
    if (!finite(from) || !finite(at) || !finite(up)) throw Error("camera", "from, at and up must be finite");
    if (!(vertical_fov > 0 && vertical_fov < kPi))
        throw Error("camera", "vertical field of view must be between 0 and 180 degrees");
    if (from == at) throw Error("camera", "from and at are the same point");
    const dvec3 back = glm::normalize(of_moderate_length(from - at));
    const dvec3 upwards = of_moderate_length(up);
    const dvec3 right = glm::cross(upwards, back);
    // Only the direction of `up` counts, so it is normalised before the test.
    const double sine = glm::length(right) / glm::length(upwards);
    if (!(sine > std::numeric_limits<float>::epsilon())) throw Error("camera", "up is zero or along the line of sight");
    const dvec3 x = glm::normalize(right);
    Camera camera;
    camera.camera_to_world = dmat4(dvec4(x, 0), dvec4(glm::cross(back, x), 0), dvec4(back, 0), dvec4(from, 1));
    camera.vertical_fov = vertical_fov;
    return camera;
}

std::string lens_problem(const Camera& camera) {
    const Lens& lens = camera.lens;
    const auto good = [](double value) { return value >= 0 && std::isfinite(value); };
    if (!good(double{lens.fstop}) || !good(lens.aperture) || !good(lens.sensor) || !std::isfinite(lens.rotation))
        return "f-number, aperture, sensor and rotation must be finite and not negative";
    if (lens.blades < 0 || lens.blades == 1 || lens.blades == 2) return "an aperture has no blades, or at least three";
    if (lens.focus.kind == Focus::Kind::distance && !(lens.focus.distance > 0))
        return "the focus must be at a positive distance";
    const dvec2& p = lens.focus.point;
    if (!(p.x >= 0 && p.x <= 1 && p.y >= 0 && p.y <= 1)) return "the focus must be at a point of the picture";
    if (camera.orthographic && lens.blurs() && lens.aperture == 0)
        return "an orthographic camera has no focal length, so its lens needs an aperture instead of an f-number";
    return "";
}

double aperture_radius(const Camera& camera, double aspect) {
    constexpr double kMillimetre = 1e-3;
    const Lens& lens = camera.lens;
    const double sensor = lens.sensor > 0 ? lens.sensor : Lens::kUsualSensor;
    const double half_side = std::tan(camera.vertical_fov / 2) * std::max(aspect, 1.0);  // longer side at distance 1
    const double focal_length = sensor / (2 * half_side);
    return 0.5 * kMillimetre * (lens.aperture > 0 ? lens.aperture : focal_length / double{lens.fstop});
}

Camera framing_camera(const Scene& scene, double aspect, bool turns) {
    constexpr double kFov = kPi / 4;
    WorldBounds bounds = world_bounds(scene);
    if (bounds.empty()) bounds = {dvec3(-1), dvec3(1)};
    const dvec3 centre = 0.5 * bounds.lower + 0.5 * bounds.upper;
    const dvec3 half = 0.5 * (bounds.upper - bounds.lower);
    // An azimuth of 30 degrees and an elevation of 20 show three sides of a box, most of all the front.
    const double azimuth = kPi / 6, elevation = kPi / 9;
    const dvec3 back(std::sin(azimuth) * std::cos(elevation), std::sin(elevation),
                     std::cos(azimuth) * std::cos(elevation));
    Camera camera = look_at_camera(back, dvec3(0), dvec3(0, 1, 0), kFov);
    // Finds the nearest position from which all corners lie within the view pyramid, with a margin of a tenth.
    const double slope = 0.9 * std::tan(kFov / 2);
    double distance = 0;
    const int angles = turns ? 90 : 1;
    for (int i = 0; i < 8 * angles; ++i) {
        const dvec3 corner = half * dvec3(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1);
        const double angle = 2 * kPi * (i / 8) / angles, c = std::cos(angle), s = std::sin(angle);
        const dvec3 p = glm::transpose(dmat3(camera.camera_to_world)) *
                        dvec3(c * corner.x + s * corner.z, corner.y, c * corner.z - s * corner.x);
        distance = std::max(distance, p.z + std::max(std::abs(p.x) / aspect, std::abs(p.y)) / slope);
    }
    if (distance == 0) distance = 1;  // the scene is a single point
    camera.name = "framing";
    camera.camera_to_world[3] = dvec4(centre + distance * back, 1);
    return camera;
}

}  // namespace halflight
