#include "tools/scenes/shapes.h"

#include <array>
#include <cmath>

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
