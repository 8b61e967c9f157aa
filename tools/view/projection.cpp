#include "tools/view/projection.h"

#include <algorithm>
#include <cmath>

namespace halflight::view {

Projection::Projection(const Camera& camera, const ivec2& size)
    : to_camera_(glm::inverse(camera.camera_to_world)), orthographic_(camera.orthographic), size_(size) {
    pixels_ = size.y / (orthographic_ ? camera.ortho_height : 2 * std::tan(camera.vertical_fov / 2));
}

dvec2 Projection::flat(const dvec3& p) const {
    const double scale = pixels_ / (orthographic_ ? 1 : -p.z);
    return {0.5 * size_.x + scale * p.x, 0.5 * size_.y - scale * p.y};
}

std::optional<dvec2> Projection::pixel(const dvec3& world) const {
    const dvec3 p = to_camera(world);
    if (!orthographic_ && !(p.z < 0)) return std::nullopt;
    return flat(p);
}

std::optional<double> Projection::pixels_per_unit(const dvec3& world) const {
    if (orthographic_) return pixels_;
    const double ahead = -to_camera(world).z;
    if (!(ahead > 0)) return std::nullopt;
    return pixels_ / ahead;
}

void Projection::add_line(dvec3 a, dvec3 b, std::vector<PictureLine>& lines) const {
    if (!orthographic_) {
        const double farther = -std::min(a.z, b.z);
        if (!(farther > 0)) return;
        const double near = -kNear * farther;
        if (a.z > near) a = b + (a - b) * ((near - b.z) / (a.z - b.z));
        if (b.z > near) b = a + (b - a) * ((near - a.z) / (b.z - a.z));
    }
    lines.push_back({flat(a), flat(b)});
}

}  // namespace halflight::view
