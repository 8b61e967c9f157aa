#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "engine/core/error.h"
#include "engine/scene/focal_length.h"
#include "engine/scene/framing.h"
#include "engine/scene/geometry.h"

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

constexpr int kTurns = 90;  // number of positions of a turning scene that its framing takes into account

/// Returns how far the scene reaches from a point along directions of any length: the largest dot product with each of
/// them. Without a scene, and beyond kMost vertices, the corners of the bounds stand for it.
std::array<double, 4> reach_of(const Scene* scene, const WorldBounds& bounds, const dvec3& from,
                               const std::array<dvec3, 4>& directions) {
    constexpr std::size_t kMost = std::size_t{1} << 24;
    std::array<double, 4> reach;
    reach.fill(-std::numeric_limits<double>::infinity());
    const auto extend = [&](const dmat4& to_world, const auto& points) {
        for (std::size_t i = 0; i < reach.size(); ++i) {
            const dvec3 direction = glm::transpose(dmat3(to_world)) * directions[i];
            double most = -std::numeric_limits<double>::infinity();
            for (const auto& p : points) most = std::max(most, glm::dot(direction, dvec3(p)));
            reach[i] = std::max(reach[i], most + glm::dot(directions[i], dvec3(to_world[3]) - from));
        }
    };
    std::size_t vertices = 0;
    if (scene && !scene->paged_bounds)
        for (const Instance& instance : scene->instances)
            vertices += scene->meshes[static_cast<std::size_t>(instance.mesh)].positions.size();
    if (vertices > 0 && vertices <= kMost) {
        for (const Instance& instance : scene->instances)
            if (leaves_area(instance.object_to_world))
                extend(instance.object_to_world, scene->meshes[static_cast<std::size_t>(instance.mesh)].positions);
    } else {
        std::array<dvec3, 8> corners;
        for (int i = 0; i < 8; ++i)
            corners[static_cast<std::size_t>(i)] =
                glm::mix(bounds.lower, bounds.upper, dvec3(i & 1 ? 1 : 0, i & 2 ? 1 : 0, i & 4 ? 1 : 0));
        extend(dmat4(1), corners);
    }
    return reach;
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

std::string optics_problem(const Camera& camera) {
    const Optics& optics = camera.optics;
    if (!(optics.fisheye_fov > 0 && optics.fisheye_fov <= 360))
        return "a fisheye sees more than 0 and up to 360 degrees";
    if (!(optics.eye_distance > 0 && std::isfinite(optics.eye_distance)))
        return "the distance between the eyes must be positive and finite";
    const double meet = optics.convergence;
    if (meet != 0 && !(meet > optics.eye_distance && std::isfinite(meet)))
        return "the eyes must converge farther away than they are apart";
    if (optics.projection != Projection::camera && camera.lens.blurs())
        return fmt::format("depth of field needs a perspective or orthographic camera, not the projection {}",
                           name(optics.projection));
    if (optics.projection == Projection::camera && optics.stereo != Stereo::none && camera.orthographic)
        return "stereo needs a perspective camera, a panorama or a fisheye; the camera is orthographic";
    return "";
}

double focal_length(const Camera& camera, double aspect) {
    const double sensor = camera.lens.sensor > 0 ? camera.lens.sensor : Lens::kUsualSensor;
    const double half_side = std::tan(camera.vertical_fov / 2) * std::max(aspect, 1.0);  // longer side at distance 1
    return sensor / (2 * half_side);
}

double aperture_radius(const Camera& camera, double aspect) {
    constexpr double kMillimetre = 1e-3;
    const Lens& lens = camera.lens;
    return 0.5 * kMillimetre * (lens.aperture > 0 ? lens.aperture : focal_length(camera, aspect) / double{lens.fstop});
}

namespace {

Camera framing_camera(const Scene* scene, const WorldBounds& bounds, double aspect, bool turns) {
    constexpr double kFov = kPi / 6;  // from so far away, the top of a cube is in view
    // An azimuth of 30 degrees and an elevation of 20 show three sides of a box, most of all the front.
    const double azimuth = kPi / 6, elevation = kPi / 9;
    const dvec3 back(std::sin(azimuth) * std::cos(elevation), std::sin(elevation),
                     std::cos(azimuth) * std::cos(elevation));
    Camera camera = look_at_camera(back, dvec3(0), dvec3(0, 1, 0), kFov);
    camera.name = "framing";
    const dvec3 centre = 0.5 * bounds.lower + 0.5 * bounds.upper, half = 0.5 * (bounds.upper - bounds.lower);
    const dmat3 axes(camera.camera_to_world);
    const double slope_y = 0.9 * std::tan(kFov / 2), slope_x = slope_y * aspect;  // with a margin of a tenth
    dvec3 from(0, 0, 0);  // in axes of the camera, from the centre
    if (turns) {
        for (int i = 0; i < 8 * kTurns; ++i) {
            const dvec3 corner = half * dvec3(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1);
            const double angle = 2 * kPi * (i / 8) / kTurns, c = std::cos(angle), s = std::sin(angle);
            const dvec3 p =
                glm::transpose(axes) * dvec3(c * corner.x + s * corner.z, corner.y, c * corner.z - s * corner.x);
            from.z = std::max(from.z, p.z + std::max(std::abs(p.x) / slope_x, std::abs(p.y) / slope_y));
        }
    } else {
        // Every side of the view pyramid touches the scene where the camera is nearest; the narrower pair decides.
        const std::array<double, 4> reach = reach_of(
            scene, bounds, centre,
            {axes[0] + slope_x * back, -axes[0] + slope_x * back, axes[1] + slope_y * back, -axes[1] + slope_y * back});
        from = {0.5 * (reach[0] - reach[1]), 0.5 * (reach[2] - reach[3]),
                std::max((reach[0] + reach[1]) / (2 * slope_x), (reach[2] + reach[3]) / (2 * slope_y))};
    }
    if (bounds.lower == bounds.upper) from = {0, 0, 1};  // the scene is a single point
    camera.camera_to_world[3] = dvec4(centre + axes * from, 1);
    return camera;
}

}  // namespace

Camera framing_camera(const Scene& scene, double aspect, bool turns) {
    const WorldBounds bounds = world_bounds(scene);
    return framing_camera(&scene, bounds.empty() ? WorldBounds{dvec3(-1), dvec3(1)} : bounds, aspect, turns);
}

Camera framing_camera(const WorldBounds& box, double aspect, bool turns) {
    return framing_camera(nullptr, box, aspect, turns);
}

}  // namespace halflight
