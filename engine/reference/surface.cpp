#include "engine/reference/surface.h"

#include <algorithm>
#include <cmath>

#include "engine/reference/texture.h"

namespace halflight::reference {
namespace {

/// Attributes of a mesh at a point of one of its triangles.
class Vertex {
  public:
    Vertex(const Mesh& mesh, int triangle, double u, double v)
        : mesh_(mesh), index_(mesh.triangles[static_cast<std::size_t>(triangle)]), weight_(1 - u - v, u, v) {}

    template <class T>
    auto operator()(const std::vector<T>& values) const {
        using Double = glm::vec<T::length(), double>;
        return Double(values[index_.x]) * weight_.x + Double(values[index_.y]) * weight_.y +
               Double(values[index_.z]) * weight_.z;
    }
    dvec2 uv(int set) const {
        const std::vector<vec2>& values = mesh_.uvs[static_cast<std::size_t>(set)];
        return values.empty() ? dvec2(0) : (*this)(values);
    }
    dvec4 color() const { return mesh_.colors.empty() ? dvec4(1) : (*this)(mesh_.colors); }
    double tangent_sign() const { return mesh_.tangents[index_.x].w; }

  private:
    const Mesh& mesh_;
    uvec3 index_;
    dvec3 weight_;
};

/// Returns white if there is no texture, so that factors stand alone.
dvec4 lookup(const Scene& scene, const TextureRef& ref, const Vertex& vertex, Encoding encoding = Encoding::linear) {
    return ref ? sample_texture(scene, ref, vertex.uv(ref.uv_set), encoding) : dvec4(1);
}

dvec4 base_color(const Scene& scene, const Material& m, const Vertex& vertex) {
    return dvec4(m.base_color) * lookup(scene, m.base_color_texture, vertex, Encoding::srgb) * vertex.color();
}

dvec3 emission(const Scene& scene, const Material& m, const Vertex& vertex) {
    if (m.emission == vec3(0)) return dvec3(0);
    return dvec3(m.emission) * dvec3(lookup(scene, m.emission_texture, vertex, Encoding::srgb));
}

dvec3 normalize_or(const dvec3& v, const dvec3& otherwise) {
    const double length2 = dot(v, v);
    return length2 > 0 ? v / std::sqrt(length2) : otherwise;
}

/// Bends a normal towards the viewer (SHADING.md, "Surfaces").
dvec3 bend_towards(const dvec3& n, const dvec3& wo) {
    const double mu = dot(n, wo);
    return mu > 0 ? n : normalize(n + wo * (1e-3 - mu));
}

struct SmoothPoint {
    double height = 0;  // above the triangle, world units
    dvec3 normal{0};    // unit length, on the side of n_g
};

/// Returns the quadratic patch through the corners that curves along each edge as the normals at its ends say. There is
/// none if normals of corners are behind the triangle.
SmoothPoint smooth_point(const Placed& placed, const uvec3& indices, const std::array<dvec3, 3>& corners,
                         const dvec3& weights, const Surface& s) {
    std::array<dvec3, 3> normals;
    for (int i = 0; i < 3; ++i) {
        const dvec3 outward = normalize_or(placed.normals * dvec3(placed.mesh->normals[indices[i]]), dvec3(0));
        normals[static_cast<std::size_t>(i)] = s.front ? outward : -outward;
        if (dot(normals[static_cast<std::size_t>(i)], s.n_g) <= 0) return {};
    }
    const dvec3 face = cross(corners[1] - corners[0], corners[2] - corners[0]);
    const auto slope_of_weight = [&](std::size_t i) {
        return cross(face, corners[(i + 2) % 3] - corners[(i + 1) % 3]) / dot(face, face);
    };
    double height = 0;
    dvec3 gradient(0);
    for (std::size_t i = 0; i < 3; ++i) {
        const std::size_t j = (i + 1) % 3;
        const double wi = weights[static_cast<int>(i)], wj = weights[static_cast<int>(j)];
        const double curvature = dot(normals[j] - normals[i], corners[j] - corners[i]);
        height += curvature * wi * wj / 2;
        gradient += curvature * (wi * slope_of_weight(j) + wj * slope_of_weight(i)) / 2.0;
    }
    return {height, normalize(s.n_g - gradient)};
}

/// Replaces the point of the triangle by that of the smooth surface if it lies above, for opaque surfaces that do
/// not glow.
void move_to_smooth_surface(const Tracer& tracer, const ReferenceHit& hit, const std::array<dvec3, 3>& corners,
                            Surface& s) {
    const BsdfParameters& p = s.parameters;
    const bool passes = p.metallic < 1 && (p.transmission > 0 || p.diffuse_transmission > 0);
    if (s.unlit || passes || s.emitted != dvec3(0)) return;
    const Placed& placed = tracer.placed(s.triangle.instance);
    const uvec3 indices = placed.mesh->triangles[static_cast<std::size_t>(s.triangle.triangle)];
    const dvec3 weights(1 - hit.u - hit.v, hit.u, hit.v);
    const SmoothPoint smooth = smooth_point(placed, indices, corners, weights, s);
    const dvec3 up = bend_towards(smooth.normal, s.wo);
    if (!(smooth.height * dot(up, s.n_g) > s.offset)) return;  // flat up to rounding
    s.position += smooth.height * up;
    s.n_g = up;
}

/// Computes the normals of base and coat: interpolated, mapped, on the side of n_g, bent towards wo.
void find_normals(const Tracer& tracer, const Vertex& vertex, Surface& s) {
    const Scene& scene = tracer.scene();
    const Placed& placed = tracer.placed(s.triangle.instance);
    const Material& m = tracer.material(s.triangle);
    const dvec3 interpolated = normalize_or(placed.normals * vertex(placed.mesh->normals), s.n_g);
    const double side = dot(interpolated, s.n_g) < 0 ? -1 : 1;

    const auto mapped = [&](const TextureRef& texture, double scale) {
        if (!texture || placed.mesh->tangents.empty()) return interpolated;
        const dvec3 t = normalize_or(placed.linear * dvec3(vertex(placed.mesh->tangents)), dvec3(0));
        const dvec3 b = cross(interpolated, t) * (vertex.tangent_sign() * placed.handedness);
        const dvec3 texel = dvec3(lookup(scene, texture, vertex)) * 2.0 - 1.0;
        return normalize_or(texel.x * scale * t + texel.y * scale * b + texel.z * interpolated, interpolated);
    };
    s.front = side > 0;
    s.n = bend_towards(side * mapped(m.normal_texture, m.normal_scale), s.wo);
    s.n_k = bend_towards(side * mapped(m.clearcoat_normal_texture, m.clearcoat_normal_scale), s.wo);
}

/// Finds the direction of higher roughness: of the interpolated frame, made perpendicular to the base's normal.
void find_rough_direction(const Tracer& tracer, const Vertex& vertex, Surface& s) {
    const Placed& placed = tracer.placed(s.triangle.instance);
    if (placed.mesh->tangents.empty()) return;
    const dvec3 n_i = normalize_or(placed.normals * vertex(placed.mesh->normals), s.n_g);
    const dvec3 t = normalize_or(placed.linear * dvec3(vertex(placed.mesh->tangents)), dvec3(0));
    const dvec3 b = cross(n_i, t) * (vertex.tangent_sign() * placed.handedness);
    const dvec3 along = s.parameters.tangent_direction.x * t + s.parameters.tangent_direction.y * b;
    const dvec3 across_normal = along - dot(along, s.n) * s.n;
    if (dot(across_normal, across_normal) > 1e-8) s.parameters.rough_direction = normalize(across_normal);
}

double norm1(const dvec3& v) {
    return std::abs(v.x) + std::abs(v.y) + std::abs(v.z);
}

}  // namespace

double offset_bound(const dvec3& p, const std::array<dvec3, 3>& corners) {
    constexpr double kRoundings = 10 * 0x1p-24;
    constexpr double kGamma = kRoundings / (1 - kRoundings);
    const double extent = std::max({norm1(corners[0] - p), norm1(corners[1] - p), norm1(corners[2] - p)});
    return kGamma * (norm1(p) + extent);
}

Surface make_surface(const Tracer& tracer, const ReferenceHit& hit, const dvec3& wo) {
    Surface s;
    s.triangle = {hit.instance, hit.triangle};
    s.wo = wo;
    const std::array<dvec3, 3> corners = tracer.corners(s.triangle);
    s.seen = (1 - hit.u - hit.v) * corners[0] + hit.u * corners[1] + hit.v * corners[2];
    s.position = s.seen;
    s.offset = offset_bound(s.position, corners);
    s.n_g = normalize_or(cross(corners[1] - corners[0], corners[2] - corners[0]), wo);
    if (dot(s.n_g, wo) < 0) s.n_g = -s.n_g;

    const Material& material = tracer.material(s.triangle);
    const Vertex vertex(*tracer.placed(hit.instance).mesh, hit.triangle, hit.u, hit.v);
    find_normals(tracer, vertex, s);
    s.unlit = material.unlit;
    s.parameters = parameters_of(material, dvec3(base_color(tracer.scene(), material, vertex)),
                                 [&](const TextureRef& texture, Encoding encoding) {
                                     return lookup(tracer.scene(), texture, vertex, encoding);
                                 });
    find_rough_direction(tracer, vertex, s);
    s.parameters.front = s.front;
    s.emitted = s.unlit ? s.parameters.base_color : emission(tracer.scene(), material, vertex);
    move_to_smooth_surface(tracer, hit, corners, s);
    return s;
}

double coverage(const Tracer& tracer, const TriangleId& id, double u, double v) {
    return base_color(tracer.scene(), tracer.material(id), Vertex(*tracer.placed(id.instance).mesh, id.triangle, u, v))
        .a;
}

dvec3 emission(const Tracer& tracer, const TriangleId& id, double u, double v) {
    return emission(tracer.scene(), tracer.material(id), Vertex(*tracer.placed(id.instance).mesh, id.triangle, u, v));
}

}  // namespace halflight::reference
