#include "engine/scene/tangents.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>
#include <tuple>
#include <unordered_map>

#include "engine/scene/geometry.h"

namespace halflight {
namespace {

constexpr std::uint32_t kNobody = std::numeric_limits<std::uint32_t>::max();

bool not_zero(float x) {
    return std::abs(x) > std::numeric_limits<float>::min();
}

vec3 normalize_or_zero(const vec3& v) {
    const float length = glm::length(v);
    return not_zero(length) ? v / length : vec3(0);
}

/// Returns the component of `v` in the plane of normal `n`, normalised.
vec3 into_plane(const vec3& v, const vec3& n) {
    return normalize_or_zero(v - n * glm::dot(n, v));
}

/// The texture directions of a triangle.
struct Face {
    vec3 along_u{0};        // unit direction of growing u
    bool right_way = true;  // true: counter-clockwise in (u, 1 - v), so the texture is not mirrored
    bool any = true;        // true: no area in uv space; compatible with any neighbour
};

/// Corners (3 x triangle + 0..2) of one vertex that get one tangent.
struct Group {
    bool right_way = true;
    vec3 tangent{0};
};

class TangentFrames {
  public:
    TangentFrames(const Mesh& mesh, const std::vector<vec2>& uv, std::span<const float> sides)
        : mesh_(mesh), uv_(uv), sides_(sides), neighbour_(3 * mesh.triangles.size(), kNobody), group_of_(neighbour_) {
        weld();
        find_neighbours();
        for (const uvec3& t : mesh_.triangles) faces_.push_back(face(t));
        for (std::uint32_t corner = 0; corner < group_of_.size(); ++corner) {
            if (group_of_[corner] == kNobody && !faces_[corner / 3].any) grow_group(corner);
        }
    }

    vec4 tangent(std::uint32_t corner) const {
        const vec3& n = normal(corner);
        const float side = this->side(vertex(corner));
        if (group_of_[corner] == kNobody) return vec4(any_perpendicular(n), side);
        const Group& group = groups_[group_of_[corner]];
        // If directions cancel exactly, each triangle keeps its own.
        vec3 t = group.tangent;
        if (t == vec3(0)) t = into_plane(faces_[corner / 3].along_u, n);
        if (t == vec3(0)) t = any_perpendicular(n);
        return vec4(t, group.right_way ? side : -side);
    }

  private:
    std::uint32_t vertex(std::uint32_t corner) const { return mesh_.triangles[corner / 3][corner % 3]; }
    const vec3& normal(std::uint32_t corner) const { return mesh_.normals[vertex(corner)]; }
    float side(std::uint32_t vertex) const { return sides_.empty() ? 1 : sides_[vertex]; }
    static std::uint32_t next(std::uint32_t corner) { return corner % 3 == 2 ? corner - 2 : corner + 1; }
    static std::uint32_t previous(std::uint32_t corner) { return corner % 3 == 0 ? corner + 2 : corner - 1; }

    /// Gives vertices of equal position, normal, uv and side one id.
    void weld() {
        using Key = std::array<float, 9>;
        const auto hash = [](const Key& key) {
            std::uint64_t h = 0;
            // FNV-1a's prime is applied to one word at a time. The shift moves high bits to where buckets are chosen.
            for (const float x : key) h = (h ^ std::bit_cast<std::uint32_t>(x)) * 0x100000001b3u, h ^= h >> 29;
            return static_cast<std::size_t>(h);
        };
        std::unordered_map<Key, std::uint32_t, decltype(hash)> first(mesh_.positions.size(), hash);
        welded_.resize(mesh_.positions.size());
        for (std::uint32_t i = 0; i < welded_.size(); ++i) {
            const vec3 &p = mesh_.positions[i], &n = mesh_.normals[i];
            Key key{p.x, p.y, p.z, n.x, n.y, n.z, uv_[i].x, uv_[i].y, side(i)};
            for (float& x : key) x += 0.0f;  // -0 becomes 0
            welded_[i] = first.try_emplace(key, i).first->second;
        }
    }

    /// Fills neighbour_[c]: the triangle across the edge from corner c to the next one, if it runs in reverse there.
    void find_neighbours() {
        struct Edge {
            std::uint32_t low, high, corner;
            bool flipped;
        };
        std::vector<Edge> edges;
        edges.reserve(neighbour_.size());
        for (std::uint32_t corner = 0; corner < neighbour_.size(); ++corner) {
            const std::uint32_t a = welded_[vertex(corner)], b = welded_[vertex(next(corner))];
            edges.push_back({std::min(a, b), std::max(a, b), corner, a > b});
        }
        std::ranges::sort(edges, {}, [](const Edge& e) { return std::tuple(e.low, e.high, e.corner); });
        for (std::size_t i = 0; i < edges.size(); ++i) {
            const Edge& a = edges[i];
            if (neighbour_[a.corner] != kNobody) continue;
            for (std::size_t j = i + 1; j < edges.size() && edges[j].low == a.low && edges[j].high == a.high; ++j) {
                const Edge& b = edges[j];
                if (b.flipped == a.flipped || neighbour_[b.corner] != kNobody) continue;
                neighbour_[a.corner] = b.corner / 3;
                neighbour_[b.corner] = a.corner / 3;
                break;
            }
        }
    }

    /// Returns the derivative of position by u, up to scale (Mikkelsen 2008, section 4.2).
    Face face(const uvec3& t) const {
        const vec3 d1 = mesh_.positions[t.y] - mesh_.positions[t.x], d2 = mesh_.positions[t.z] - mesh_.positions[t.x];
        const vec2 e1 = uv_[t.y] - uv_[t.x], e2 = uv_[t.z] - uv_[t.x];
        // doubled area in (u, v): negative if (u, 1 - v) is counter-clockwise
        const float area = e1.x * e2.y - e1.y * e2.x;
        Face result;
        result.right_way = !(area > 0);
        if (!not_zero(area)) return result;
        const vec3 along_u = e2.y * d1 - e1.y * d2, along_v = e1.x * d2 - e2.x * d1;
        result.along_u = normalize_or_zero(area > 0 ? along_u : -along_u);
        result.any =
            !(not_zero(glm::length(along_u) / std::abs(area)) && not_zero(glm::length(along_v) / std::abs(area)));
        return result;
    }

    /// Collects the corners that are connected to `seed` over edges, left before right, and averages their directions.
    void grow_group(std::uint32_t seed) {
        const auto id = static_cast<std::uint32_t>(groups_.size());
        const std::uint32_t name = welded_[vertex(seed)];
        Group group{faces_[seed / 3].right_way, vec3(0)};
        std::vector<std::uint32_t> todo{seed / 3};
        while (!todo.empty()) {
            const std::uint32_t triangle = todo.back();
            todo.pop_back();
            std::uint32_t corner = 3 * triangle;
            while (corner < 3 * triangle + 3 && welded_[vertex(corner)] != name) ++corner;
            if (corner == 3 * triangle + 3 || group_of_[corner] != kNobody) continue;
            Face& f = faces_[triangle];
            const auto* groups = &group_of_[3 * triangle];
            // A triangle without area in uv space takes the winding of the first group that reaches it.
            if (f.any && groups[0] == kNobody && groups[1] == kNobody && groups[2] == kNobody)
                f.right_way = group.right_way;
            if (f.right_way != group.right_way) continue;
            group_of_[corner] = id;
            if (!f.any) group.tangent += weighted_direction(corner);
            for (const std::uint32_t edge : {previous(corner), corner}) {
                if (neighbour_[edge] != kNobody) todo.push_back(neighbour_[edge]);
            }
        }
        group.tangent = normalize_or_zero(group.tangent);
        groups_.push_back(group);
    }

    vec3 weighted_direction(std::uint32_t corner) const {
        const vec3& n = normal(corner);
        const vec3& p = mesh_.positions[vertex(corner)];
        const vec3 to_previous = into_plane(mesh_.positions[vertex(previous(corner))] - p, n);
        const vec3 to_next = into_plane(mesh_.positions[vertex(next(corner))] - p, n);
        const float angle = std::acos(std::clamp(glm::dot(to_previous, to_next), -1.0f, 1.0f));
        return angle * into_plane(faces_[corner / 3].along_u, n);
    }

    const Mesh& mesh_;
    const std::vector<vec2>& uv_;
    const std::span<const float> sides_;
    std::vector<std::uint32_t> welded_;
    std::vector<std::uint32_t> neighbour_;
    std::vector<std::uint32_t> group_of_;
    std::vector<Face> faces_;
    std::vector<Group> groups_;
};

}  // namespace

void generate_tangents(Mesh& mesh, const std::vector<vec2>& uv, std::span<const float> sides) {
    const TangentFrames frames(mesh, uv, sides);
    // A vertex whose corners disagree gets copies, which form a linked list.
    std::vector<std::uint32_t> sources(mesh.positions.size()), next_copy(mesh.positions.size(), kNobody);
    std::iota(sources.begin(), sources.end(), 0u);
    std::vector<vec4> tangents(mesh.positions.size(), vec4(0));
    std::vector<uvec3> triangles = mesh.triangles;
    for (std::uint32_t corner = 0; corner < 3 * triangles.size(); ++corner) {
        const vec4 tangent = frames.tangent(corner);
        std::uint32_t& v = triangles[corner / 3][corner % 3];
        while (tangents[v] != vec4(0) && tangents[v] != tangent) {
            if (next_copy[v] == kNobody) {
                next_copy[v] = static_cast<std::uint32_t>(sources.size());
                sources.push_back(sources[v]);
                tangents.push_back(vec4(0));
                next_copy.push_back(kNobody);
            }
            v = next_copy[v];
        }
        tangents[v] = tangent;
    }
    mesh.tangents.clear();
    gather_vertices(mesh, sources);
    mesh.tangents = std::move(tangents);
    mesh.triangles = std::move(triangles);
}

}  // namespace halflight
