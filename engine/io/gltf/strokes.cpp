#include "engine/io/gltf/strokes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>

#include "engine/io/gltf/tinygltf.h"

namespace halflight {
namespace {

/// A closed surface around +Z. Vertices of the far end belong to the second vertex of a segment.
struct Shape {
    std::vector<vec3> directions;
    std::vector<bool> far_end;
    std::vector<uvec3> triangles;
};

/// Returns an icosahedron whose faces are split into four.
Shape make_sphere() {
    const auto t = static_cast<float>((1 + std::sqrt(5.0)) / 2);
    Shape s;
    for (const vec3& v :
         {vec3(-1, t, 0), vec3(1, t, 0), vec3(-1, -t, 0), vec3(1, -t, 0), vec3(0, -1, t), vec3(0, 1, t),
          vec3(0, -1, -t), vec3(0, 1, -t), vec3(t, 0, -1), vec3(t, 0, 1), vec3(-t, 0, -1), vec3(-t, 0, 1)})
        s.directions.push_back(glm::normalize(v));
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
    const auto middle = [&](std::uint32_t a, std::uint32_t b) {
        const auto [known, is_new] =
            middles.try_emplace(std::minmax(a, b), static_cast<std::uint32_t>(s.directions.size()));
        if (is_new) s.directions.push_back(glm::normalize(s.directions[a] + s.directions[b]));
        return known->second;
    };
    for (const uvec3& f : {uvec3(0, 11, 5), uvec3(0, 5, 1),  uvec3(0, 1, 7),   uvec3(0, 7, 10), uvec3(0, 10, 11),
                           uvec3(1, 5, 9),  uvec3(5, 11, 4), uvec3(11, 10, 2), uvec3(10, 7, 6), uvec3(7, 1, 8),
                           uvec3(3, 9, 4),  uvec3(3, 4, 2),  uvec3(3, 2, 6),   uvec3(3, 6, 8),  uvec3(3, 8, 9),
                           uvec3(4, 9, 5),  uvec3(2, 4, 11), uvec3(6, 2, 10),  uvec3(8, 6, 7),  uvec3(9, 8, 1)}) {
        const std::uint32_t a = middle(f.x, f.y), b = middle(f.y, f.z), c = middle(f.z, f.x);
        s.triangles.insert(s.triangles.end(), {{f.x, a, c}, {f.y, b, a}, {f.z, c, b}, {a, b, c}});
    }
    s.far_end.assign(s.directions.size(), false);
    return s;
}

/// Returns a tube of eight sides, whose ends are halves of spheres.
Shape make_tube() {
    constexpr std::uint32_t kSides = 8, kRings = 4;
    const float slope = std::sqrt(0.5f);
    const std::array<vec2, kRings> rings = {vec2(slope, -slope), vec2(1, 0), vec2(1, 0), vec2(slope, slope)};
    Shape s;
    s.directions.emplace_back(0, 0, -1);
    for (const vec2& ring : rings)
        for (std::uint32_t k = 0; k < kSides; ++k) {
            const double turn = 2 * kPi * k / kSides;
            s.directions.emplace_back(ring.x * std::cos(turn), ring.x * std::sin(turn), ring.y);
        }
    s.directions.emplace_back(0, 0, 1);
    const auto last = static_cast<std::uint32_t>(s.directions.size()) - 1;
    for (std::uint32_t k = 0; k < kSides; ++k) {
        const std::uint32_t next = (k + 1) % kSides;
        s.triangles.emplace_back(0, 1 + next, 1 + k);
        for (std::uint32_t ring = 0; ring + 1 < kRings; ++ring) {
            const std::uint32_t below = 1 + ring * kSides, above = below + kSides;
            s.triangles.emplace_back(below + k, below + next, above + next);
            s.triangles.emplace_back(below + k, above + next, above + k);
        }
        s.triangles.emplace_back(last, last - kSides + k, last - kSides + next);
    }
    for (std::size_t i = 0; i < s.directions.size(); ++i) s.far_end.push_back(i > s.directions.size() / 2 - 1);
    return s;
}

const Shape& shape_of(int mode) {
    static const Shape sphere = make_sphere(), tube = make_tube();
    return mode == TINYGLTF_MODE_POINTS ? sphere : tube;
}

std::size_t segments(int mode, std::size_t corners) {
    if (mode == TINYGLTF_MODE_LINE) return corners / 2;
    if (mode == TINYGLTF_MODE_LINE_LOOP && corners > 2) return corners;
    return corners - std::min<std::size_t>(corners, 1);
}

/// Returns a rotation of +Z to a direction, and any one for a length that is 0 or no number.
dmat3 rotation_to(const dvec3& direction) {
    const double length = glm::length(direction);
    const dvec3 z = length > 0 && std::isfinite(length) ? direction / length : dvec3(0, 0, 1);
    const dvec3 x = glm::normalize(glm::cross(std::abs(z.x) < 0.5 ? dvec3(1, 0, 0) : dvec3(0, 1, 0), z));
    return {x, glm::cross(z, x), z};
}

}  // namespace

bool is_stroke(int mode) {
    return mode >= 0 && mode < TINYGLTF_MODE_TRIANGLES;
}

StrokeSize measure_strokes(int mode, std::size_t corners) {
    const std::size_t strokes = mode == TINYGLTF_MODE_POINTS ? corners : segments(mode, corners);
    const Shape& shape = shape_of(mode);
    return {strokes, strokes * shape.directions.size(), strokes * shape.triangles.size()};
}

Strokes make_strokes(int mode, std::span<const std::uint32_t> indices, std::span<const vec3> positions) {
    const bool points = mode == TINYGLTF_MODE_POINTS;
    const StrokeSize size = measure_strokes(mode, indices.size());
    const Shape& shape = shape_of(mode);
    Strokes made;
    made.sources.reserve(size.vertices);
    made.directions.reserve(size.vertices);
    made.triangles.reserve(size.triangles);
    for (std::size_t i = 0; i < size.strokes; ++i) {
        const std::size_t first = mode == TINYGLTF_MODE_LINE ? 2 * i : i;
        const std::uint32_t a = indices[first], b = points ? a : indices[(first + 1) % indices.size()];
        const dmat3 turn = rotation_to(dvec3(positions[b]) - dvec3(positions[a]));
        const uvec3 base(static_cast<std::uint32_t>(made.sources.size()));
        for (std::size_t k = 0; k < shape.directions.size(); ++k) {
            made.sources.push_back(shape.far_end[k] ? b : a);
            made.directions.emplace_back(turn * dvec3(shape.directions[k]));
        }
        for (const uvec3& t : shape.triangles) made.triangles.push_back(base + t);
    }
    return made;
}

}  // namespace halflight
