#include "tools/view/selection.h"

#include <algorithm>
#include <array>
#include <map>
#include <tuple>

namespace halflight::view {
MeshEdges::MeshEdges(const Mesh& mesh) {
    std::map<std::array<float, 3>, std::uint32_t> places;
    std::vector<std::uint32_t> place;
    for (const vec3& p : mesh.positions) {
        const auto [known, is_new] = places.try_emplace({p.x, p.y, p.z}, static_cast<std::uint32_t>(points_.size()));
        if (is_new) points_.emplace_back(p);
        place.push_back(known->second);
    }
    for (const uvec3& t : mesh.triangles) {
        const auto face = static_cast<std::uint32_t>(faces_.size());
        const uvec3 f(place[t.x], place[t.y], place[t.z]);
        for (int k = 0; k < 3; ++k) {
            const auto [a, b] = std::minmax(f[k], f[(k + 1) % 3]);
            sides_.push_back({a, b, face});
        }
        faces_.push_back(f);
    }
    std::ranges::sort(sides_, {}, [](const Side& s) { return std::tuple(s.a, s.b, s.face); });
}

/// Returns the vertices in camera space.
std::vector<dvec3> MeshEdges::in_camera(const dmat4& object_to_world, const Projection& projection) const {
    std::vector<dvec3> points;
    for (const dvec3& p : points_) points.push_back(projection.to_camera(dvec3(object_to_world * dvec4(p, 1))));
    return points;
}

void MeshEdges::add_faces(const dmat4& object_to_world, const Projection& projection, Coverage& coverage) const {
    const std::vector<dvec3> points = in_camera(object_to_world, projection);
    for (const uvec3& f : faces_) coverage.add(projection, points[f.x], points[f.y], points[f.z]);
}

void MeshEdges::add_outline(const dmat4& object_to_world, const Projection& projection,
                            std::vector<PictureLine>& lines) const {
    const std::vector<dvec3> points = in_camera(object_to_world, projection);
    std::vector<bool> front;
    for (const uvec3& f : faces_) {
        const dvec3 &a = points[f.x], &b = points[f.y], &c = points[f.z];
        const dvec3 towards = projection.perspective() ? -a : dvec3(0, 0, 1);
        front.push_back(glm::dot(glm::cross(b - a, c - a), towards) > 0);
    }
    for (std::size_t i = 0, end = 0; i < sides_.size(); i = end) {
        const Side& edge = sides_[i];
        bool any_front = false, any_back = false;
        for (end = i; end < sides_.size() && sides_[end].a == edge.a && sides_[end].b == edge.b; ++end)
            (front[sides_[end].face] ? any_front : any_back) = true;
        if ((any_front && any_back) || end - i == 1) projection.add_line(points[edge.a], points[edge.b], lines);
    }
}

}  // namespace halflight::view
