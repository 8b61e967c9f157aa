#include "tools/scenes/shapes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "tools/scenes/exact.h"

namespace halflight::scenes {
namespace {

void facet(MeshBuilder& mesh, const dvec3& centre, double radius, const dvec3& a, const dvec3& b, const dvec3& c,
           int levels) {
    if (levels > 0) {
        const dvec3 ab = glm::normalize(a + b), bc = glm::normalize(b + c), ca = glm::normalize(c + a);
        facet(mesh, centre, radius, a, ab, ca, levels - 1);
        facet(mesh, centre, radius, ab, b, bc, levels - 1);
        facet(mesh, centre, radius, ca, bc, c, levels - 1);
        facet(mesh, centre, radius, ab, bc, ca, levels - 1);
        return;
    }
    const dvec3 n = glm::normalize(glm::cross(b - a, c - a));
    const std::uint32_t first = mesh.vertex({centre + radius * a, n});
    mesh.vertex({centre + radius * b, n}), mesh.vertex({centre + radius * c, n});
    mesh.triangle(first, first + 1, first + 2);
}

}  // namespace

const std::vector<dvec2>& ring_of(int sides) {
    static std::map<int, std::vector<dvec2>> rings;  // sines take longer than all else that makes a small part
    std::vector<dvec2>& ring = rings[sides];
    for (int i = static_cast<int>(ring.size()); i <= sides; ++i)
        ring.push_back(cos_sin_degrees(360.0 * (i % sides) / sides));
    return ring;
}

void surface(MeshBuilder& mesh, int columns, int rows, const std::function<dvec3(double, double)>& p,
             const dvec2& repeat) {
    // Step of a central difference, whose error and rounding balance near the cube root of 2^-53.
    constexpr double kStep = 0x1p-16;
    std::vector<dvec3> points;
    std::uint32_t first = 0;
    const auto normal = [&](double u, double v) {
        const double u0 = std::max(u - kStep, 0.0), u1 = std::min(u + kStep, 1.0);
        const double v0 = std::max(v - kStep, 0.0), v1 = std::min(v + kStep, 1.0);
        return glm::cross(p(u1, v) - p(u0, v), p(u, v1) - p(u, v0));
    };
    for (int j = 0; j <= rows; ++j)
        for (int i = 0; i <= columns; ++i) {
            const double u = double(i) / columns, v = double(j) / rows;
            dvec3 n = normal(u, v);
            if (n == dvec3(0)) n = normal(u, v + (0.5 - v) / rows);  // the tip of a row that shrinks to a point
            points.push_back(p(u, v));
            const std::uint32_t index = mesh.vertex({points.back(), glm::normalize(n), dvec2(u, 1 - v) * repeat});
            if (i == 0 && j == 0) first = index;
        }
    const auto triangle = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
        if (points[a] != points[b] && points[b] != points[c] && points[c] != points[a])
            mesh.triangle(first + a, first + b, first + c);
    };
    const auto width = static_cast<std::uint32_t>(columns + 1);
    for (std::uint32_t j = 0; j < static_cast<std::uint32_t>(rows); ++j)
        for (std::uint32_t i = 0; i + 1 < width; ++i) {
            const std::uint32_t a = j * width + i;
            triangle(a, a + 1, a + width + 1);
            triangle(a, a + width + 1, a + width);
        }
}

void lathe(MeshBuilder& mesh, std::span<const dvec2> profile, int segments, double repeat, double texel) {
    const std::size_t pieces = profile.size() - 1;
    std::vector<dvec2> normals(pieces);  // (radial, up) of each piece
    for (std::size_t k = 0; k < pieces; ++k) {
        const dvec2 along = profile[k + 1] - profile[k];
        normals[k] = glm::normalize(dvec2(along.y, -along.x));
    }
    const auto corner_normal = [&](std::size_t piece, std::size_t neighbour) {
        constexpr double kCos35 = 0.819152;
        const bool smooth = neighbour < pieces && glm::dot(normals[piece], normals[neighbour]) > kCos35;
        return smooth ? glm::normalize(normals[piece] + normals[neighbour]) : normals[piece];
    };
    const std::vector<dvec2>& around = ring_of(segments);
    for (std::size_t k = 0; k < pieces; ++k) {
        const std::array<dvec2, 2> ring{profile[k], profile[k + 1]};
        const std::array<dvec2, 2> n{corner_normal(k, k - 1), corner_normal(k, k + 1)};
        std::uint32_t first = 0;
        for (int i = 0; i <= segments; ++i) {
            const dvec2 t = around[static_cast<std::size_t>(i)];
            for (std::size_t e = 0; e < 2; ++e) {
                const std::uint32_t index = mesh.vertex({{ring[e].x * t.x, ring[e].y, -ring[e].x * t.y},
                                                         {n[e].x * t.x, n[e].y, -n[e].x * t.y},
                                                         {repeat * i / segments, -ring[e].y / texel}});
                if (i == 0 && e == 0) first = index;
            }
        }
        for (int i = 0; i < segments; ++i) {
            const std::uint32_t a = first + 2 * static_cast<std::uint32_t>(i);
            if (ring[0].x > 0) mesh.triangle(a, a + 2, a + 1);
            if (ring[1].x > 0) mesh.triangle(a + 2, a + 3, a + 1);
        }
    }
}

std::vector<dvec2> curve(std::span<const dvec2> points, int steps) {
    std::vector<dvec2> result;
    const std::size_t last = points.size() - 1;
    for (std::size_t k = 0; k < last; ++k) {
        const dvec2 a = points[k == 0 ? 0 : k - 1], b = points[k], c = points[k + 1], d = points[std::min(k + 2, last)];
        for (int i = 0; i < steps; ++i) {
            const double t = double(i) / steps;
            result.push_back(
                0.5 * (2.0 * b + t * (c - a + t * (2.0 * a - 5.0 * b + 4.0 * c - d + t * (3.0 * (b - c) + d - a)))));
            result.back().x = std::max(result.back().x, 0.0);
        }
    }
    result.push_back(points[last]);
    return result;
}

void sphere(MeshBuilder& mesh, const dvec3& centre, double radius, int segments, int rings) {
    std::uint32_t first = 0;
    for (int j = 0; j <= rings; ++j)
        for (int i = 0; i <= segments; ++i) {
            const dvec2 around = cos_sin_degrees(360.0 * (i % segments) / segments),
                        up = cos_sin_degrees(180.0 * j / rings - 90);
            const dvec3 n(up.x * around.x, up.y, -up.x * around.y);
            const std::uint32_t index =
                mesh.vertex({centre + radius * n, n, {double(i) / segments, 1 - double(j) / rings}});
            if (i == 0 && j == 0) first = index;
        }
    const auto width = static_cast<std::uint32_t>(segments + 1);
    for (int j = 0; j < rings; ++j)
        for (std::uint32_t i = 0; i + 1 < width; ++i) {
            const std::uint32_t a = first + static_cast<std::uint32_t>(j) * width + i;
            if (j > 0) mesh.triangle(a, a + 1, a + width + 1);
            if (j + 1 < rings) mesh.triangle(a, a + width + 1, a + width);
        }
}

void tube(MeshBuilder& mesh, std::span<const dvec3> path, double radius, int sides) {
    const std::vector<dvec2>& around = ring_of(sides);
    dvec3 side(0);
    double length = 0;
    std::uint32_t first = 0;
    for (std::size_t k = 0; k < path.size(); ++k) {
        const dvec3 along = glm::normalize(path[std::min(k + 1, path.size() - 1)] - path[k == 0 ? 0 : k - 1]);
        if (k == 0)
            side = std::abs(along.y) < 0.9 ? dvec3(0, 1, 0) : dvec3(1, 0, 0);
        else
            length += glm::length(path[k] - path[k - 1]);
        side = glm::normalize(side - along * glm::dot(side, along));  // keeps the tube from twisting
        const dvec3 other = glm::cross(along, side);
        for (int i = 0; i <= sides; ++i) {
            const dvec2 t = around[static_cast<std::size_t>(i)];
            const dvec3 n = side * t.x + other * t.y;
            const std::uint32_t index = mesh.vertex({path[k] + radius * n, n, {double(i) / sides, -length}});
            if (k == 0 && i == 0) first = index;
        }
    }
    const auto width = static_cast<std::uint32_t>(sides + 1);
    for (std::uint32_t k = 0; k + 1 < path.size(); ++k)
        for (std::uint32_t i = 0; i + 1 < width; ++i) {
            const std::uint32_t a = first + k * width + i;
            mesh.triangle(a, a + 1, a + width + 1);
            mesh.triangle(a, a + width + 1, a + width);
        }
}

void bevelled_box(MeshBuilder& mesh, const dvec3& lower, const dvec3& upper, double bevel) {
    // corner(sign, axis) is the corner's point on the face across `axis`; each corner has three such points.
    const auto corner = [&](const ivec3& sign, int axis) {
        dvec3 p;
        for (int i = 0; i < 3; ++i) {
            const double inset = i == axis ? 0 : bevel;
            p[i] = sign[i] > 0 ? upper[i] - inset : lower[i] + inset;
        }
        return p;
    };
    const auto quad = [&](const dvec3& a, const dvec3& b, const dvec3& c, const dvec3& d) {
        const dvec3 outward = (a + c) - (lower + upper);
        if (glm::dot(glm::cross(c - a, d - b), outward) > 0)
            mesh.quad(a, b, c, d);
        else
            mesh.quad(b, a, d, c);
    };
    for (int axis = 0; axis < 3; ++axis) {
        const int b = (axis + 1) % 3, c = (axis + 2) % 3;
        const auto sign = [&](int sa, int sb, int sc) {
            ivec3 s;
            s[axis] = sa, s[b] = sb, s[c] = sc;
            return s;
        };
        for (const int s : {-1, 1}) {  // face, then the four edges along `axis`
            quad(corner(sign(s, -1, -1), axis), corner(sign(s, 1, -1), axis), corner(sign(s, 1, 1), axis),
                 corner(sign(s, -1, 1), axis));
            for (const int t : {-1, 1})
                quad(corner(sign(-1, s, t), b), corner(sign(1, s, t), b), corner(sign(1, s, t), c),
                     corner(sign(-1, s, t), c));
        }
    }
    for (int i = 0; i < 8; ++i) {
        const ivec3 s(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1);
        dvec3 a = corner(s, 0), b = corner(s, 1), c = corner(s, 2);
        if (s.x * s.y * s.z < 0) std::swap(b, c);
        const dvec3 n = glm::normalize(glm::cross(b - a, c - a));
        const std::uint32_t first = mesh.vertex({a, n});
        mesh.vertex({b, n}), mesh.vertex({c, n});
        mesh.triangle(first, first + 1, first + 2);
    }
}

void pierced_wall(MeshBuilder& mesh, double half, double y0, double y1, const dvec2& low, const dvec2& high,
                  double depth) {
    const auto face = [&](double xa, double ya, double xb, double yb) {
        mesh.quad({xa, ya, 0}, {xb, ya, 0}, {xb, yb, 0}, {xa, yb, 0});
    };
    face(-half, y0, low.x, y1), face(high.x, y0, half, y1);
    if (low.y > y0) face(low.x, y0, high.x, low.y);
    mesh.quad({low.x, low.y, 0}, {low.x, low.y, -depth}, {low.x, high.y, -depth}, {low.x, high.y, 0});
    mesh.quad({high.x, low.y, -depth}, {high.x, low.y, 0}, {high.x, high.y, 0}, {high.x, high.y, -depth});
    if (low.y > y0) mesh.quad({low.x, low.y, -depth}, {low.x, low.y, 0}, {high.x, low.y, 0}, {high.x, low.y, -depth});
    if (high.y == y1) return;  // the wall continues above
    face(low.x, high.y, high.x, y1);
    mesh.quad({low.x, high.y, 0}, {low.x, high.y, -depth}, {high.x, high.y, -depth}, {high.x, high.y, 0});
}

void faceted_sphere(MeshBuilder& mesh, const dvec3& centre, double radius, int levels) {
    const double g = (1 + std::sqrt(5.0)) / 2;  // corners of an icosahedron: cyclic (0, +-1, +-g)
    std::array<dvec3, 12> p{{{-1, g, 0},
                             {1, g, 0},
                             {-1, -g, 0},
                             {1, -g, 0},
                             {0, -1, g},
                             {0, 1, g},
                             {0, -1, -g},
                             {0, 1, -g},
                             {g, 0, -1},
                             {g, 0, 1},
                             {-g, 0, -1},
                             {-g, 0, 1}}};
    for (dvec3& corner : p) corner = glm::normalize(corner);
    static constexpr std::array<std::array<std::size_t, 3>, 20> kFaces{
        {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
         {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
         {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}}};
    for (const auto& [a, b, c] : kFaces) facet(mesh, centre, radius, p[a], p[b], p[c], levels);
}

}  // namespace halflight::scenes
