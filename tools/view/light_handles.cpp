#include "tools/view/light_handles.h"

#include <algorithm>
#include <cmath>

#include "engine/scene/light_types.h"

namespace halflight::view {
namespace {

constexpr double kAim = 1.3;       // distance of the square that aims a lamp, lengths of handles
constexpr float kLeastGap = 0.1f;  // degrees between the inner and the outer cone

/// Returns the place of the ray of a pixel on a plane; none if the plane is seen from its side.
std::optional<dvec3> on_plane(const Camera& camera, const ivec2& size, const dvec2& pixel, const dvec3& through,
                              const dvec3& normal) {
    const Ray ray = ray_through(camera, pixel, size);
    const double slope = glm::dot(ray.direction, normal);
    if (std::abs(slope) < 1e-6) return std::nullopt;
    return ray.origin + glm::dot(through - ray.origin, normal) / slope * ray.direction;
}

/// Returns the place on a line that is nearest to the ray of a pixel. axis: unit.
double along(const Camera& camera, const ivec2& size, const dvec2& pixel, const dvec3& origin, const dvec3& axis) {
    const Ray ray = ray_through(camera, pixel, size);
    const dvec3 to = origin - ray.origin;
    const double ab = glm::dot(axis, ray.direction), determinant = 1 - ab * ab;
    if (determinant < 1e-9) return 0;  // seen from its end
    return (ab * glm::dot(to, ray.direction) - glm::dot(to, axis)) / determinant;
}

/// Returns the angle from the direction of a spot at which a pixel lies, degrees. The inner cone is dragged on the side
/// opposite to the outer one.
std::optional<double> angle_at(const LightShape& l, LightHandle handle, const Camera& camera, const ivec2& size,
                               const dvec2& pixel) {
    const bool inner = handle == LightHandle::inner;
    const dvec3 side = inner ? -l.across : l.across;
    if (!l.end_on) {
        const auto p = on_plane(camera, size, pixel, l.place, glm::cross(l.direction, l.across));
        if (!p) return std::nullopt;
        return glm::degrees(std::atan2(glm::dot(*p - l.place, side), glm::dot(*p - l.place, l.direction)));
    }
    const double ahead = l.reach * std::max(std::cos(glm::radians(inner ? l.inner : l.outer)), 0.05);
    const auto p = on_plane(camera, size, pixel, l.place + ahead * l.direction, l.direction);
    if (!p) return std::nullopt;
    return glm::degrees(std::atan2(glm::dot(*p - l.place, side), ahead));
}

dvec3 tip(const LightShape& l) {
    return l.place + (l.sun ? 1.0 : kAim) * l.reach * l.direction;
}

}  // namespace

void add_square(const dvec2& middle, double half, std::vector<PictureLine>& lines) {
    const dvec2 corners[] = {{-half, -half}, {half, -half}, {half, half}, {-half, half}};
    for (int i = 0; i < 4; ++i) lines.push_back({middle + corners[i], middle + corners[(i + 1) % 4]});
}

std::vector<dvec3> circle(const dvec3& centre, const dvec3& u, const dvec3& v) {
    std::vector<dvec3> points;
    for (int i = 0; i <= kRingSteps; ++i) {
        const double angle = 2 * kPi * i / kRingSteps;
        points.push_back(centre + std::cos(angle) * u + std::sin(angle) * v);
    }
    return points;
}

std::optional<LightShape> selected_light(const Session& session, const ivec2& size, double length) {
    if (session.selection.kind != ObjectKind::light) return std::nullopt;
    const std::size_t index = session.selection.index;
    const Scene values = session.edited_values();
    const PunctualLight& light = values.lights.at(index);
    const LightTypeRow& type = row_of(light.type);
    LightShape l;
    l.sun = !type.has_position;
    l.spot = light.type == LightType::spot;
    l.aims = type.has_direction || light.profile != kNone;
    l.area = session.area_lamp(index);
    if (l.area) l.spot = false;
    l.place = l.sun ? session.pose().at : light.position;
    l.direction = (l.sun ? -1.0 : 1.0) * glm::normalize(dvec3(light.direction));
    l.inner = glm::degrees(double{light.inner_cone}), l.outer = glm::degrees(double{light.outer_cone});
    const Camera camera = session.camera();
    const auto scale = Projection(camera, size).pixels_per_unit(l.place);
    if (!scale) return std::nullopt;
    l.reach = length / *scale;
    const dmat4& m = camera.camera_to_world;
    const dvec3 ahead = camera.orthographic ? -dvec3(m[2]) : glm::normalize(l.place - dvec3(m[3]));
    l.across = glm::cross(l.direction, ahead);
    l.end_on = !(glm::length(l.across) > kEdgeOn);
    if (l.end_on) l.across = glm::cross(l.direction, dvec3(m[1]));
    l.across = glm::normalize(l.across) * (glm::dot(l.across, dvec3(m[0])) < 0 ? -1.0 : 1.0);
    return l;
}

std::vector<LightGrip> light_grips(const LightShape& l, const Camera& camera, const ivec2& size, double length) {
    std::vector<LightGrip> grips;
    const Projection projection(camera, size);
    const auto add_line = [&](const dvec3& from, const dvec3& to, std::vector<PictureLine>& lines) {
        projection.add_line(projection.to_camera(from), projection.to_camera(to), lines);
    };
    const auto add_grip = [&](LightHandle handle, const dvec3& knob, std::vector<PictureLine> lines) {
        const auto pixel = projection.pixel(knob);
        if (!pixel) return;
        add_square(*pixel, kKnob * length, lines);
        grips.push_back({handle, std::move(lines)});
    };
    const auto ring = [&](const std::vector<dvec3>& points) {
        std::vector<PictureLine> lines;
        for (std::size_t i = 1; i < points.size(); ++i) add_line(points[i - 1], points[i], lines);
        return lines;
    };
    if (l.aims) {
        std::vector<PictureLine> axis;
        add_line(l.place, tip(l), axis);
        add_grip(LightHandle::aim, tip(l), std::move(axis));
    }
    if (l.spot) {
        const dvec3 other = glm::cross(l.direction, l.across);
        const auto cone = [&](double degrees, LightHandle handle, const dvec3& side) {
            const double angle = glm::radians(degrees);
            const dvec3 centre = l.place + l.reach * std::cos(angle) * l.direction;
            const double radius = l.reach * std::sin(angle);
            std::vector<PictureLine> lines = ring(circle(centre, radius * l.across, radius * other));
            for (const dvec3& edge : {l.across, -l.across})
                if (handle == LightHandle::outer) add_line(l.place, centre + radius * edge, lines);
            add_grip(handle, centre + radius * side, std::move(lines));
        };
        cone(l.outer, LightHandle::outer, l.across);
        cone(l.inner, LightHandle::inner, -l.across);
    }
    if (l.area) {
        const dmat4 m = transform_of(*l.area);
        const dvec3 x = 0.5 * dvec3(m[0]), y = 0.5 * dvec3(m[1]);
        if (l.area->disc) {
            add_grip(LightHandle::width, l.place + x, ring(circle(l.place, x, y)));
        } else {
            add_grip(LightHandle::width, l.place + x,
                     ring({l.place - x - y, l.place + x - y, l.place + x + y, l.place - x + y, l.place - x - y}));
            add_grip(LightHandle::height, l.place + y, {});
        }
    }
    return grips;
}

void drag_light(const LightShape& l, LightHandle handle, const Camera& camera, const ivec2& size, const dvec2& from,
                const dvec2& to, LightEdit& edit) {
    if (handle == LightHandle::aim) {
        const dvec3 ahead = -dvec3(camera.camera_to_world[2]);
        const auto a = on_plane(camera, size, from, tip(l), ahead), b = on_plane(camera, size, to, tip(l), ahead);
        if (!a || !b) return;
        const auto direction = unit_direction((l.sun ? -1.0 : 1.0) * (tip(l) + *b - *a - l.place));
        if (direction) edit.direction = direction;
        return;
    }
    if (handle == LightHandle::inner || handle == LightHandle::outer) {
        const auto a = angle_at(l, handle, camera, size, from), b = angle_at(l, handle, camera, size, to);
        if (!a || !b) return;
        const bool is_inner = handle == LightHandle::inner;
        const auto most = static_cast<float>(kEditCone.upper);
        const auto angle = static_cast<float>((is_inner ? l.inner : l.outer) + *b - *a);
        const auto inner = static_cast<float>(l.inner), outer = static_cast<float>(l.outer);
        // The angles push each other, so that the inner one stays the smaller.
        edit.inner = is_inner ? std::clamp(angle, 0.0f, most - kLeastGap) : inner;
        edit.outer = is_inner ? std::min(outer, most) : std::clamp(angle, kLeastGap, most);
        if (is_inner && *edit.inner > *edit.outer - kLeastGap) edit.outer = *edit.inner + kLeastGap;
        if (!is_inner && *edit.inner > *edit.outer - kLeastGap) edit.inner = std::max(*edit.outer - kLeastGap, 0.0f);
        return;
    }
    const dmat4 m = transform_of(*l.area);
    const int side = handle == LightHandle::width ? 0 : 1;
    const dvec3 axis = glm::normalize(dvec3(m[side]));
    const double moved = along(camera, size, to, l.place, axis) - along(camera, size, from, l.place, axis);
    const double length = std::clamp(double{l.area->size[side]} + 2 * moved, 1e-3 * l.reach, kEditSize.upper);
    vec2 sides = l.area->size;
    sides[side] = static_cast<float>(std::max(length, kEditSize.lower));
    edit.size = l.area->disc ? vec2(sides[side]) : sides;
}

}  // namespace halflight::view
