#include "tools/view/gizmo.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>

#include "api/halflight/edit_text.h"
#include "engine/scene/light_types.h"
#include "tools/view/outliner.h"

namespace halflight::view {
namespace {

constexpr std::array kNames = {"none", "move", "rotate", "scale"};
constexpr double kMiddle = 0.12;      // half size of the handle in the middle, lengths of handles
constexpr double kGap = 0.2;          // distance of the other handles from the origin, lengths of handles
constexpr double kLeastScale = 1e-6;  // least factor of a scale
constexpr double kShort = 0.25;       // length below which a handle is not shown, lengths of handles
constexpr double kLeastFactor = 0.01, kMostFactor = 100;  // factors on a scale by one drag
constexpr double kKnobAway = 0.28;  // its distance from the outline of the light, lengths of handles
constexpr double kWidest = 180;     // angle of a light whose square is a length away, degrees

NodeEdit own_edit(const SceneEdits& edits, const std::string& name) {
    const auto found = std::ranges::find(edits.nodes, name, &NamedEdit<NodeEdit>::name);
    return found == edits.nodes.end() ? NodeEdit() : found->edit;
}

dmat3 rotation(int axis, double degrees) {
    dvec3 around(0);
    around[axis] = 1;
    return dmat3(glm::rotate(dmat4(1), glm::radians(degrees), around));
}

/// Returns scaling and rotation of an edit.
dmat3 linear(const NodeEdit& edit) {
    dmat3 m = rotation(2, edit.rotate.z) * rotation(1, edit.rotate.y) * rotation(0, edit.rotate.x);
    for (int i = 0; i < 3; ++i) m[i] *= edit.scale[i];
    return m;
}

double distance(const dvec2& p, const PictureLine& line) {
    const dvec2 d = line[1] - line[0];
    const double length = glm::dot(d, d);
    const double t = length > 0 ? std::clamp(glm::dot(p - line[0], d) / length, 0.0, 1.0) : 0;
    return glm::length(p - line[0] - t * d);
}

}  // namespace

void keep_pivot(const NodeFrame& frame, const NodeEdit& before, NodeEdit& edit) {
    constexpr double kRounding = 1e-12;  // share of the distance between pivot and origin
    const dvec3 arm = frame.pivot - frame.origin, shift = (linear(before) - linear(edit)) * arm;
    for (int i = 0; i < 3; ++i)
        if (std::abs(shift[i]) > kRounding * glm::length(arm)) edit.translate[i] += shift[i];
}

const char* name(GizmoMode mode) {
    return kNames[static_cast<std::size_t>(mode)];
}

GizmoMode gizmo_mode(const std::string& name) {
    const auto known = std::ranges::find(kNames, name);
    if (known == kNames.end())
        throw Error("handles", "unknown handles '{}'; valid are {}", name, fmt::join(kNames, ", "));
    return static_cast<GizmoMode>(known - kNames.begin());
}

std::optional<Gizmo::Axes> Gizmo::axes(const Session& session) const {
    const Selection& s = session.selection;
    Axes a;
    if (s.kind == ObjectKind::light && mode == GizmoMode::move) {
        const PunctualLight light = session.edited_values().lights.at(s.index);
        if (!row_of(light.type).has_position) return std::nullopt;
        a.origin = light.position;
        a.is_light = true;
        for (int i = 0; i < 3; ++i) a.axes[i] = dmat3(1)[i];
        return a;
    }
    if (s.kind != ObjectKind::node || mode == GizmoMode::none || session.in_pages()) return std::nullopt;
    const NodeFrame frame = a.frame = session.node_frame(s.index);
    const NodeEdit edit = own_edit(session.edits, session.references().nodes.at(s.index));
    const dvec3 place = frame.origin + edit.translate + linear(edit) * (frame.pivot - frame.origin);
    a.origin = dvec3(frame.above * dvec4(place, 1));
    a.to_world = dmat3(frame.above);
    const dmat3 z = rotation(2, edit.rotate.z), zy = z * rotation(1, edit.rotate.y);
    const dmat3 turned = mode == GizmoMode::scale ? zy * rotation(0, edit.rotate.x) : dmat3(1);
    for (int i = 0; i < 3; ++i) a.axes[i] = a.to_world * turned[i];
    if (mode == GizmoMode::rotate) {  // rotations about X come first, so the later ones turn its axis
        a.axes[0] = a.to_world * zy[0];
        a.axes[1] = a.to_world * z[1];
    }
    for (const dvec3& axis : a.axes)
        if (!(glm::length(axis) > 0) || !std::isfinite(glm::length(axis))) return std::nullopt;
    return a;
}

bool Gizmo::can_move(const Session& session) {
    Gizmo moving;
    moving.mode = GizmoMode::move;
    return moving.axes(session).has_value();
}

std::optional<Gizmo::LightSize> Gizmo::light_size(const Session& session, const ivec2& size, double length) {
    if (session.selection.kind != ObjectKind::light || session.area_lamp(session.selection.index)) return std::nullopt;
    const PunctualLight light = session.edited_values().lights.at(session.selection.index);
    if (row_of(light.type).has_position) return LightSize{false, double{light.radius}, light.position};
    // The cone stands on the point about which the camera turns, which is in the picture.
    const dmat4& camera = session.camera().camera_to_world;
    LightSize s{true, glm::degrees(double{light.angle}), session.pose().at};
    const auto scale = Projection(session.camera(), size).pixels_per_unit(s.place);
    if (!scale) return std::nullopt;
    const dvec3 towards = -glm::normalize(dvec3(light.direction));
    s.axis = length / *scale * towards;
    const dvec3 ahead = session.camera().orthographic ? -dvec3(camera[2]) : glm::normalize(s.place - dvec3(camera[3]));
    s.across = glm::cross(towards, ahead);
    if (!(glm::length(s.across) > kEdgeOn)) s.across = glm::cross(towards, dvec3(camera[1]));
    s.across *= (glm::dot(s.across, dvec3(camera[0])) < 0 ? -1 : 1) * glm::length(s.axis) / glm::length(s.across);
    return s;
}

std::optional<Gizmo::Handle> Gizmo::size_handle(const Session& session, const ivec2& size, double length) {
    const auto s = light_size(session, size, length);
    const Projection projection(session.camera(), size);
    const auto middle = s ? projection.pixel(s->place) : std::nullopt;
    if (!middle) return std::nullopt;
    Handle handle{kSize, {}};
    const auto add = [&](const dvec3& from, const dvec3& to) {
        projection.add_line(projection.to_camera(from), projection.to_camera(to), handle.lines);
    };
    std::vector<dvec3> ring;
    dvec2 knob = *middle + length * kKnobAway * std::sqrt(0.5);
    if (s->is_cone) {
        const double half = glm::radians(s->value / 2);
        const dvec3 other = glm::cross(s->axis, s->across) / glm::length(s->axis);
        ring = circle(s->place + std::cos(half) * s->axis, std::sin(half) * s->across, std::sin(half) * other);
        for (int i = 0; i < kRingSteps; i += kRingSteps / 4) add(s->place, ring[static_cast<std::size_t>(i)]);
        const auto end = projection.pixel(s->place + s->axis + (kKnobAway + std::sqrt(s->value / kWidest)) * s->across);
        if (end) knob = *end;
    } else if (s->value > 0) {
        // The outline of a ball is the circle in which the rays of the camera touch it.
        const dmat4& camera = session.camera().camera_to_world;
        const dvec3 back = session.camera().orthographic ? dvec3(camera[2]) : dvec3(camera[3]) - s->place;
        const double share = session.camera().orthographic ? 0 : s->value / glm::length(back);
        if (share < 1) {
            const dvec3 n = glm::normalize(back), u = glm::normalize(glm::cross(dvec3(camera[1]), n));
            const double radius = s->value * std::sqrt(1 - share * share);
            ring = circle(s->place + s->value * share * n, radius * u, radius * glm::cross(n, u));
            if (const auto at = projection.pixel(ring[kRingSteps * 7 / 8])) knob += *at - *middle;
        }
    }
    for (std::size_t i = 1; i < ring.size(); ++i) add(ring[i - 1], ring[i]);
    add_square(knob, kKnob * length, handle.lines);
    return handle;
}

/// Returns the size that a pixel stands for: the radius of the ball that the pixel's ray touches, or the place of the
/// square of a cone, which is the root of an angle, so that small angles can be set.
double Gizmo::size_at(const Drag& d, const dvec2& point) {
    if (d.of_light->is_cone) return along(d, d.of_light->across, point);
    const Ray ray = ray_through(d.camera, point, d.size);
    return glm::length(glm::cross(ray.direction, d.of_light->place - ray.origin));
}

void Gizmo::drag_size(const Drag& d, Session& session, const dvec2& point) {
    const LightSize& s = *d.of_light;
    LightEdit& edit = light_edit(session.edits, session.references().lights[d.object.index]);
    const double start = s.is_cone ? std::sqrt(s.value / kWidest) : s.value;
    const double now = std::max(start + size_at(d, point) - size_at(d, d.first), 0.0);
    if (s.is_cone)
        edit.angle = static_cast<float>(std::min(kWidest * now * now, kEditAngle.upper));
    else
        edit.radius = static_cast<float>(std::min(now, kEditRadius.upper));
}

std::vector<Gizmo::Handle> Gizmo::handles(const Session& session, const ivec2& size, double length) const {
    std::vector<Handle> all = axis_handles(session, size, length);
    if (const auto light = selected_light(session, size, length))
        for (LightGrip& grip : light_grips(*light, session.camera(), size, length))
            all.push_back({kLight + static_cast<int>(grip.handle), std::move(grip.lines)});
    if (auto of_light = size_handle(session, size, length)) all.push_back(std::move(*of_light));
    return all;
}

std::vector<Gizmo::Handle> Gizmo::axis_handles(const Session& session, const ivec2& size, double length) const {
    std::vector<Handle> all;
    const auto a = axes(session);
    if (!a) return all;
    const Projection projection(session.camera(), size);
    const auto scale = projection.pixels_per_unit(a->origin);
    const auto middle = projection.pixel(a->origin);
    if (!scale || !middle) return all;
    const double reach = length / *scale;
    const auto add = [&](std::vector<PictureLine>& lines, const dvec3& from, const dvec3& to) {
        projection.add_line(projection.to_camera(from), projection.to_camera(to), lines);
    };
    for (int axis = 0; axis < 3; ++axis) {
        Handle handle{axis, {}};
        const dvec3 along = reach * glm::normalize(a->axes[axis]);
        if (mode != GizmoMode::rotate) {
            const auto end = projection.pixel(a->origin + along);
            if (!end || glm::length(*end - *middle) < kShort * length) continue;
            add(handle.lines, a->origin + kGap * along, a->origin + along);
        } else {
            const dvec3 other = std::abs(along.x) < 0.5 * reach ? dvec3(1, 0, 0) : dvec3(0, 1, 0);
            const dvec3 u = reach * glm::normalize(glm::cross(along, other));
            const dvec3 v = glm::cross(glm::normalize(along), u);
            const std::vector<dvec3> ring = circle(a->origin, u, v);
            for (std::size_t i = 1; i < ring.size(); ++i) add(handle.lines, ring[i - 1], ring[i]);
        }
        all.push_back(std::move(handle));
    }
    if (mode == GizmoMode::rotate) return all;
    Handle square{kAll, {}};
    add_square(*middle, kMiddle * length, square.lines);
    all.push_back(std::move(square));
    return all;
}

std::optional<int> Gizmo::axis_at(const std::vector<Handle>& handles, const dvec2& point, double reach) {
    std::optional<int> nearest;
    for (const Handle& handle : handles) {
        if (handle.axis == kAll && point.x >= handle.lines[0][0].x && point.y >= handle.lines[0][0].y &&
            point.x <= handle.lines[2][0].x && point.y <= handle.lines[2][0].y)
            return kAll;
        for (const PictureLine& line : handle.lines) {
            const double d = distance(point, line);
            if (d < reach) nearest = handle.axis, reach = d;
        }
    }
    return nearest;
}

/// Returns the place on the line through the origin along `axis` that is nearest to the ray of a pixel, in units of the
/// axis.
double Gizmo::along(const Drag& d, const dvec3& axis, const dvec2& point) {
    const Ray ray = ray_through(d.camera, point, d.size);
    const dvec3 to = d.at.origin - ray.origin;
    const double aa = glm::dot(axis, axis), ab = glm::dot(axis, ray.direction);
    const double determinant = aa - ab * ab;
    if (!(determinant > 1e-9 * aa)) return 0;  // seen from its end
    return (ab * glm::dot(to, ray.direction) - glm::dot(to, axis)) / determinant;
}

std::optional<dvec3> Gizmo::on_plane(const Drag& d, const dvec3& normal, const dvec2& point) {
    const Ray ray = ray_through(d.camera, point, d.size);
    const double slope = glm::dot(ray.direction, normal);
    if (slope == 0) return std::nullopt;
    const double t = glm::dot(d.at.origin - ray.origin, normal) / slope;
    if (!(t > 0) && !d.camera.orthographic) return std::nullopt;
    return ray.origin + t * ray.direction;
}

/// Returns the angle about the dragged axis between two pixels, radians.
double Gizmo::turn(const Drag& d, const dvec2& from, const dvec2& to) {
    const dvec3 n = glm::normalize(d.at.axes[d.axis]);
    const dvec3 ahead = ray_through(d.camera, to, d.size).direction;
    const double facing = glm::dot(ahead, n);
    if (std::abs(facing) > kEdgeOn) {
        const auto a = on_plane(d, n, from), b = on_plane(d, n, to);
        if (!a || !b) return 0;
        const dvec3 u = *a - d.at.origin, w = *b - d.at.origin;
        return std::atan2(glm::dot(glm::cross(u, w), n), glm::dot(u, w));
    }
    // A ring that is seen from the side is turned by the movement along it.
    const dmat3 to_camera(glm::inverse(d.camera.camera_to_world));
    const dvec3 side = to_camera * glm::cross(ahead, n);
    const dvec2 direction = glm::normalize(dvec2(side.x, -side.y));
    return -glm::dot(to - from, direction) / d.length;
}

void Gizmo::begin(const Session& session, const ivec2& size, double length, int axis, const dvec2& point) {
    const auto of_light = axis == kSize ? light_size(session, size, length) : std::nullopt;
    const auto shape = axis >= kLight ? selected_light(session, size, length) : std::nullopt;
    const std::optional<Axes> at = shape ? Axes{.origin = shape->place, .axes = {}, .is_light = true}
                                   : of_light
                                       ? Axes{.origin = of_light->place + of_light->axis, .axes = {}, .is_light = true}
                                       : axes(session);
    if (!at) return;
    drag_ = Drag{.axis = axis,
                 .object = session.selection,
                 .at = *at,
                 .camera = session.camera(),
                 .size = size,
                 .length = length,
                 .position = at->origin,
                 .first = point,
                 .last = point,
                 .of_light = of_light,
                 .shape = shape};
    if (!at->is_light) drag_->node = own_edit(session.edits, session.references().nodes[session.selection.index]);
}

void Gizmo::drag(Session& session, const dvec2& point) {
    if (!drag_ || session.selection != drag_->object || point == drag_->last) return;
    Drag& d = *drag_;
    if (d.of_light) {
        d.last = point;
        return drag_size(d, session, point);
    }
    if (d.shape) {
        d.last = point;
        return drag_light(*d.shape, static_cast<LightHandle>(d.axis - kLight), d.camera, d.size, d.first, point,
                          light_edit(session.edits, session.references().lights[d.object.index]));
    }
    NodeEdit edit = d.node;
    dvec3 moved(0);  // translation since the start
    if (mode == GizmoMode::move && d.axis == kAll) {
        const dvec3 ahead = -dvec3(d.camera.camera_to_world[2]);
        const auto from = on_plane(d, ahead, d.first), to = on_plane(d, ahead, point);
        if (from && to) moved = glm::inverse(d.at.to_world) * (*to - *from);
    } else if (mode == GizmoMode::move) {
        moved[d.axis] = along(d, d.at.axes[d.axis], point) - along(d, d.at.axes[d.axis], d.first);
    } else if (mode == GizmoMode::rotate) {
        const double sense = glm::determinant(d.at.to_world) < 0 ? -1 : 1;  // nodes above may mirror
        d.turned += sense * turn(d, d.last, point);
        edit.rotate[d.axis] =
            std::clamp(d.node.rotate[d.axis] + glm::degrees(d.turned), kEditRotation.lower, kEditRotation.upper);
    } else if (mode == GizmoMode::scale) {
        const dvec3 axis = glm::normalize(d.at.axes[d.axis == kAll ? 0 : d.axis]);
        const double start = along(d, axis, d.first);
        const double wanted = d.axis == kAll ? std::exp((point.x - d.first.x) / d.length)
                              : start != 0   ? along(d, axis, point) / start
                                             : 1;
        const double factor = std::clamp(wanted, kLeastFactor, kMostFactor);
        for (int i = 0; i < 3; ++i) {
            if (d.axis != kAll && d.axis != i) continue;
            const double scale = std::clamp(d.node.scale[i] * factor, kEditScale.lower, kEditScale.upper);
            if (std::abs(scale) >= kLeastScale) edit.scale[i] = scale;
        }
    }
    d.last = point;
    if (d.at.is_light) {
        const std::string& light = session.references().lights[d.object.index];
        light_edit(session.edits, light).position =
            glm::clamp(d.position + moved, kEditPosition.lower, kEditPosition.upper);
        return;
    }
    keep_pivot(d.at.frame, d.node, edit);
    edit.translate = glm::clamp(edit.translate + moved, kEditPosition.lower, kEditPosition.upper);
    node_edit(session.edits, session.references().nodes[d.object.index]) = edit;
}

void Gizmo::end(Session& session) {
    drag_.reset();
    remove_empty(session.edits);
}

}  // namespace halflight::view
