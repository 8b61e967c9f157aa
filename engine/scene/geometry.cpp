#include "engine/scene/geometry.h"

#include <algorithm>
#include <limits>
#include <numeric>

#include "engine/core/error.h"

namespace halflight {
namespace {

/// Calls `f` with every per-vertex array that the mesh can have.
template <class F>
void for_each_array(Mesh& mesh, F f) {
    f(mesh.positions), f(mesh.normals), f(mesh.tangents), f(mesh.uvs[0]), f(mesh.uvs[1]), f(mesh.colors);
}

/// Appends `from` if either has values. The one without values is filled with `missing`.
template <class T>
void append_array(std::vector<T>& to, std::size_t to_size, const std::vector<T>& from, std::size_t from_size,
                  const T& missing) {
    if (to.empty() && from.empty()) return;
    to.resize(to_size, missing);
    to.insert(to.end(), from.begin(), from.end());
    to.resize(to_size + from_size, missing);
}

template <class T>
void gather(std::vector<T>& values, std::span<const std::uint32_t> sources) {
    if (values.empty()) return;
    std::vector<T> gathered;
    gathered.reserve(sources.size());
    for (const std::uint32_t source : sources) gathered.push_back(values[source]);
    values = std::move(gathered);
}

void gather(VertexExtras* extras, std::span<const std::uint32_t> sources) {
    if (extras) gather(extras->sides, sources), gather(extras->uvs, sources);
}

void fill_tangents(std::vector<vec4>& tangents, const std::vector<vec3>& normals) {
    for (std::size_t i = tangents.size(); i < normals.size(); ++i)
        tangents.emplace_back(any_perpendicular(normals[i]), 1.0f);
}

}  // namespace

dvec3 area_vector(const Mesh& mesh, const uvec3& triangle) {
    const dvec3 p0 = mesh.positions[triangle.x];
    return glm::cross(dvec3(mesh.positions[triangle.y]) - p0, dvec3(mesh.positions[triangle.z]) - p0);
}

bool leaves_area(const dmat4& object_to_world) {
    const dmat3 m(object_to_world);
    return glm::cross(m[0], m[1]) != dvec3(0) || glm::cross(m[1], m[2]) != dvec3(0) ||
           glm::cross(m[2], m[0]) != dvec3(0);
}

bool has_surface(const Scene& scene, const Instance& instance) {
    return !scene.meshes[static_cast<std::size_t>(instance.mesh)].triangles.empty() &&
           leaves_area(instance.object_to_world);
}

void gather_vertices(Mesh& mesh, std::span<const std::uint32_t> sources) {
    for_each_array(mesh, [&](auto& values) { gather(values, sources); });
}

DroppedTriangles drop_bad_triangles(Mesh& mesh, VertexExtras* extras) {
    DroppedTriangles dropped;
    std::size_t kept = 0;
    std::vector<bool> used(mesh.positions.size(), false);
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
        const uvec3 t = mesh.triangles[i];
        const bool finite =
            all_finite(mesh.positions[t.x]) && all_finite(mesh.positions[t.y]) && all_finite(mesh.positions[t.z]);
        if (!finite) {
            ++dropped.non_finite;
        } else if (area_vector(mesh, t) == dvec3(0)) {
            ++dropped.degenerate;
        } else {
            used[t.x] = used[t.y] = used[t.z] = true;
            mesh.triangle_material[kept] = mesh.triangle_material[i];
            mesh.triangles[kept++] = t;
        }
    }
    mesh.triangles.resize(kept);
    mesh.triangle_material.resize(kept);
    if (std::ranges::find(used, false) == used.end()) return dropped;

    std::vector<std::uint32_t> sources;
    std::vector<std::uint32_t> renamed(used.size());
    for (std::size_t i = 0; i < used.size(); ++i) {
        renamed[i] = static_cast<std::uint32_t>(sources.size());
        if (used[i]) sources.push_back(static_cast<std::uint32_t>(i));
    }
    gather_vertices(mesh, sources);
    gather(extras, sources);
    for (uvec3& t : mesh.triangles) t = uvec3(renamed[t.x], renamed[t.y], renamed[t.z]);
    return dropped;
}

std::size_t generate_flat_normals(Mesh& mesh, VertexExtras* extras) {
    std::vector<float>* const sides = extras && !extras->sides.empty() ? &extras->sides : nullptr;
    std::vector<float> new_sides;
    std::vector<std::uint32_t> sources;
    std::vector<vec3> normals;
    sources.reserve(3 * mesh.triangles.size());
    normals.reserve(3 * mesh.triangles.size());
    for (uvec3& t : mesh.triangles) {
        const float side = sides && (*sides)[t.x] + (*sides)[t.y] + (*sides)[t.z] < 0 ? -1.0f : 1.0f;
        if (sides) new_sides.insert(new_sides.end(), 3, side);
        normals.insert(normals.end(), 3, side * vec3(glm::normalize(area_vector(mesh, t))));
        const auto first = static_cast<std::uint32_t>(sources.size());
        sources.insert(sources.end(), {t.x, t.y, t.z});
        t = uvec3(first, first + 1, first + 2);
    }
    mesh.normals.clear();
    gather_vertices(mesh, sources);
    gather(extras, sources);
    if (sides) *sides = std::move(new_sides);
    mesh.normals = std::move(normals);
    return mesh.normals.size();
}

std::size_t repair_normals(Mesh& mesh, std::span<const float> sides) {
    std::vector<std::uint32_t> bad;
    for (std::size_t i = 0; i < mesh.normals.size(); ++i) {
        // Double precision keeps the length of tiny and huge normals.
        const dvec3 n = mesh.normals[i];
        if (all_finite(mesh.normals[i]) && n != dvec3(0))
            mesh.normals[i] = vec3(glm::normalize(n));
        else
            bad.push_back(static_cast<std::uint32_t>(i));
    }
    if (bad.empty()) return 0;

    constexpr std::uint32_t kGood = std::numeric_limits<std::uint32_t>::max();
    std::vector<std::uint32_t> place(mesh.normals.size(), kGood);
    for (std::size_t i = 0; i < bad.size(); ++i) place[bad[i]] = static_cast<std::uint32_t>(i);
    std::vector<dvec3> sums(bad.size(), dvec3(0)), last(bad.size(), dvec3(0));
    for (const uvec3& t : mesh.triangles) {
        const dvec3 area = area_vector(mesh, t);
        for (int corner = 0; corner < 3; ++corner) {
            const std::uint32_t p = place[t[corner]];
            if (p == kGood) continue;
            sums[p] += area;
            last[p] = area;
        }
    }
    // Normals can cancel if two sides of a sheet share a vertex. Then the last triangle's normal is used.
    for (std::size_t i = 0; i < bad.size(); ++i) {
        const double side = sides.empty() ? 1 : sides[bad[i]];
        mesh.normals[bad[i]] = vec3(side * glm::normalize(sums[i] == dvec3(0) ? last[i] : sums[i]));
    }
    return bad.size();
}

void reserve(Mesh& mesh, std::size_t vertices, std::size_t triangles) {
    for_each_array(mesh, [&](auto& values) {
        if (!values.empty()) values.reserve(vertices);
    });
    mesh.triangles.reserve(triangles);
    mesh.triangle_material.reserve(triangles);
}

void append(Mesh& mesh, const Mesh& part) {
    const std::size_t old_size = mesh.positions.size();
    const std::size_t part_size = part.positions.size();
    if (old_size + part_size > std::numeric_limits<std::uint32_t>::max())
        throw Error(mesh.name, "more than 2^32 - 1 vertices in one mesh");
    mesh.positions.insert(mesh.positions.end(), part.positions.begin(), part.positions.end());
    mesh.normals.insert(mesh.normals.end(), part.normals.begin(), part.normals.end());
    for (int set = 0; set < 2; ++set) append_array(mesh.uvs[set], old_size, part.uvs[set], part_size, vec2(0));
    append_array(mesh.colors, old_size, part.colors, part_size, vec4(1));
    if (!mesh.tangents.empty() || !part.tangents.empty()) {
        const std::vector<vec3> old_normals(mesh.normals.begin(),
                                            mesh.normals.begin() + static_cast<std::ptrdiff_t>(old_size));
        fill_tangents(mesh.tangents, old_normals);
        mesh.tangents.insert(mesh.tangents.end(), part.tangents.begin(), part.tangents.end());
        fill_tangents(mesh.tangents, mesh.normals);
    }
    const auto offset = static_cast<std::uint32_t>(old_size);
    for (const uvec3& t : part.triangles) mesh.triangles.push_back(t + offset);
    mesh.triangle_material.insert(mesh.triangle_material.end(), part.triangle_material.begin(),
                                  part.triangle_material.end());
}

vec3 any_perpendicular(const vec3& n) {
    // The axis with the smallest component of n cannot be parallel to n.
    const vec3 a = glm::abs(n);
    const vec3 axis = a.x <= a.y && a.x <= a.z ? vec3(1, 0, 0) : a.y <= a.z ? vec3(0, 1, 0) : vec3(0, 0, 1);
    return glm::normalize(glm::cross(n, axis));
}

}  // namespace halflight
