#include "tools/scenes/mesh.h"

#include <algorithm>
#include <array>
#include <glm/gtc/matrix_transform.hpp>

#include "tools/scenes/exact.h"

namespace halflight::scenes {

std::size_t Mesh::triangles() const {
    std::size_t count = 0;
    for (const Part& part : parts) count += part.indices.size() / 3;
    return count;
}

MeshBuilder& MeshBuilder::material(int index) {
    material_ = index;
    const auto found =
        std::find_if(mesh_.parts.begin(), mesh_.parts.end(), [&](const Part& part) { return part.material == index; });
    current_ = static_cast<std::size_t>(found - mesh_.parts.begin());
    return *this;
}

MeshBuilder& MeshBuilder::frame(const dmat4& matrix) {
    frame_ = matrix;
    normal_frame_ = glm::transpose(glm::inverse(dmat3(matrix)));
    mirrored_ = glm::determinant(dmat3(matrix)) < 0;
    return *this;
}

MeshBuilder& MeshBuilder::texel_size(double metres) {
    texel_size_ = metres;
    return *this;
}

Part& MeshBuilder::part() {
    if (current_ >= mesh_.parts.size()) {  // a material without triangles leaves no empty part
        current_ = mesh_.parts.size();
        mesh_.parts.push_back({.material = material_, .vertices = {}, .influences = {}, .indices = {}});
    }
    return mesh_.parts[current_];
}

std::uint32_t MeshBuilder::vertex(const Vertex& v) {
    Part& target = part();
    target.vertices.push_back({dvec3(frame_ * dvec4(v.position, 1)), glm::normalize(normal_frame_ * v.normal), v.uv});
    return static_cast<std::uint32_t>(target.vertices.size() - 1);
}

void MeshBuilder::triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    if (mirrored_) std::swap(b, c);
    std::vector<std::uint32_t>& indices = part().indices;
    indices.insert(indices.end(), {a, b, c});
}

void MeshBuilder::quad(const dvec3& a, const dvec3& b, const dvec3& c, const dvec3& d) {
    const dvec3 n = glm::normalize(glm::cross(c - a, d - b));
    // u is horizontal on upright faces, and along the longer side of others.
    const dvec3 level = glm::cross(dvec3(0, 1, 0), n),
                longer = glm::length(b - a) >= glm::length(d - a) ? b - a : d - a;
    const dvec3 u = glm::normalize(glm::length(level) > 0.7 ? level : longer), v = glm::cross(n, u);
    // uv start at the mesh's origin, so that coplanar neighbouring quads continue the pattern.
    const auto uv = [&](const dvec3& p) { return dvec2(glm::dot(p, u), -glm::dot(p, v)) / texel_size_; };
    const std::uint32_t first = vertex({a, n, uv(a)});
    vertex({b, n, uv(b)}), vertex({c, n, uv(c)}), vertex({d, n, uv(d)});
    triangle(first, first + 1, first + 2);
    triangle(first, first + 2, first + 3);
}

void MeshBuilder::picture(const dvec3& a, const dvec3& b, const dvec3& c, const dvec3& d) {
    const dvec3 n = glm::normalize(glm::cross(c - a, d - b));
    const std::uint32_t first = vertex({a, n, {0, 1}});
    vertex({b, n, {1, 1}}), vertex({c, n, {1, 0}}), vertex({d, n, {0, 0}});
    triangle(first, first + 1, first + 2);
    triangle(first, first + 2, first + 3);
}

void MeshBuilder::hexahedron(const dvec3 (&p)[8], unsigned without) {
    static constexpr std::array<std::array<int, 4>, 6> kCorners{
        {{0, 4, 6, 2}, {5, 1, 3, 7}, {0, 1, 5, 4}, {6, 7, 3, 2}, {1, 0, 2, 3}, {4, 5, 7, 6}}};
    for (unsigned side = 0; side < 6; ++side) {
        if (without & (1U << side)) continue;
        const auto& [a, b, c, d] = kCorners[side];
        quad(p[a], p[b], p[c], p[d]);
    }
}

void MeshBuilder::box(const dvec3& lower, const dvec3& upper, unsigned without) {
    dvec3 corners[8];
    for (int i = 0; i < 8; ++i)
        corners[i] = {i & 1 ? upper.x : lower.x, i & 2 ? upper.y : lower.y, i & 4 ? upper.z : lower.z};
    hexahedron(corners, without);
}

dmat4 move(double x, double y, double z) {
    return glm::translate(dmat4(1), dvec3(x, y, z));
}

dmat4 grow(double x, double y, double z) {
    return glm::scale(dmat4(1), dvec3(x, y, z));
}

dmat4 turn_x(double degrees) {
    const dvec2 t = cos_sin_degrees(degrees);
    return {{1, 0, 0, 0}, {0, t.x, t.y, 0}, {0, -t.y, t.x, 0}, {0, 0, 0, 1}};
}

dmat4 turn_y(double degrees) {
    const dvec2 t = cos_sin_degrees(degrees);
    return {{t.x, 0, -t.y, 0}, {0, 1, 0, 0}, {t.y, 0, t.x, 0}, {0, 0, 0, 1}};
}

dmat4 turn_z(double degrees) {
    const dvec2 t = cos_sin_degrees(degrees);
    return {{t.x, t.y, 0, 0}, {-t.y, t.x, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}};
}

}  // namespace halflight::scenes
