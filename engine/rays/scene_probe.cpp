#include "engine/rays/scene_probe.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "engine/core/embree.h"
#include "engine/core/error.h"
#include "engine/scene/image_tiles.h"
#include "engine/scene/material_lobes.h"
#include "engine/tables/light_textures.h"

namespace halflight::rays {
namespace {

struct Release {
    void operator()(RTCDevice device) const { rtcReleaseDevice(device); }
    void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
    void operator()(RTCGeometry geometry) const { rtcReleaseGeometry(geometry); }
};
template <class Handle>
using Owned = std::unique_ptr<std::remove_pointer_t<Handle>, Release>;

int wrapped(float coordinate, int size, Wrap wrap) {
    const double turns = std::floor(double(coordinate));
    double within = double(coordinate) - turns;
    if (!(std::abs(turns) < 1e9)) return 0;  // the coordinate is NaN, or too large to have a fraction
    if (wrap == Wrap::clamp_to_edge) within = std::clamp(double(coordinate), 0.0, 1.0);
    if (wrap == Wrap::mirrored_repeat && std::fmod(turns, 2) != 0) within = 1 - within;
    return std::min(static_cast<int>(within * size), size - 1);
}

/// Returns the value of an sRGB-encoded texture from its nearest texel: linear rgb, alpha; 1 without an image.
vec4 texel(const Scene& scene, const TextureRef& texture, const Mesh& mesh, const uvec3& corners, const vec3& weights) {
    if (!texture) return vec4(1);
    const std::vector<vec2>& uvs = mesh.uvs[static_cast<std::size_t>(texture.uv_set)];
    vec2 uv(0);
    for (int k = 0; k < 3 && !uvs.empty(); ++k) uv += weights[k] * uvs[corners[k]];
    uv = texture.uv_transform * vec3(uv, 1);
    const TextureImage& image = scene.images[static_cast<std::size_t>(texture.image)];
    const std::array<double, 4> rgba =
        texel_of(image, {wrapped(uv.x, image.width, texture.wrap_u), wrapped(uv.y, image.height, texture.wrap_v)});
    return {srgb_to_linear(rgba[0]), srgb_to_linear(rgba[1]), srgb_to_linear(rgba[2]), rgba[3]};
}

/// Returns the base colour of a surface, with its texture and the colours of its vertices.
vec4 base_color(const Scene& scene, const Material& m, const Mesh& mesh, const uvec3& corners, const vec3& weights) {
    vec4 color = m.base_color * texel(scene, m.base_color_texture, mesh, corners, weights);
    if (mesh.colors.empty()) return color;
    vec4 vertex(0);
    for (int k = 0; k < 3; ++k) vertex += weights[k] * mesh.colors[corners[k]];
    return color * vertex;
}

/// Returns the share of rays that the surface stops by its alpha.
float coverage(const Scene& scene, const Material& m, const Mesh& mesh, const uvec3& corners, const vec3& weights) {
    if (m.alpha_mode == AlphaMode::opaque) return 1;
    const float alpha = base_color(scene, m, mesh, corners, weights).a;
    return m.alpha_mode == AlphaMode::mask ? float(alpha >= m.alpha_cutoff) : std::clamp(alpha, 0.0f, 1.0f);
}

/// Returns whether most light passes the surface in one of the ways of `passing`.
bool lets_pass(const Material& m, float coverage, unsigned passing) {
    const bool clear = passing & kPassClear || (passing & kPassPanes && !hides_points(m));
    const float passes =
        std::max(clear ? m.transmission : 0.0f, passing & kPassScattered ? m.diffuse_transmission : 0.0f);
    return passes * (1 - m.metallic) > 0.5f || (passing & (kPassClear | kPassPanes) && coverage < 0.5f);
}

/// Returns whether Embree can trace an instance in object space: directions and distances stay within float's range.
bool invertible(const dmat4& m) {
    constexpr double kMost = 1e12;
    const dmat4 inverse = glm::inverse(m);
    for (int column = 0; column < 4; ++column)
        for (int row = 0; row < 3; ++row)
            if (!(std::abs(m[column][row]) < kMost && std::abs(inverse[column][row]) < kMost)) return false;
    return true;
}

}  // namespace

vec3 emission_at(const Scene& scene, const Material& material, const Mesh& mesh, const uvec3& corners,
                 const vec3& weights) {
    const float covered = coverage(scene, material, mesh, corners, weights);
    if (material.unlit) return covered * vec3(base_color(scene, material, mesh, corners, weights));
    if (!has_emission(material)) return vec3(0);
    return covered * material.emission * vec3(texel(scene, material.emission_texture, mesh, corners, weights));
}

struct SceneProbe::Geometry {
    Owned<RTCDevice> device;
    std::vector<Owned<RTCScene>> meshes;  // hierarchies of meshes that several instances share; null for others
    Owned<RTCScene> top;
    std::vector<std::size_t> instances;  // index into Scene::instances by Embree's geometry

    Owned<RTCScene> make_scene() const {
        Owned<RTCScene> made(rtcNewScene(device.get()));
        rtcSetSceneFlags(made.get(), static_cast<RTCSceneFlags>(RTC_SCENE_FLAG_ROBUST | RTC_SCENE_FLAG_COMPACT));
        return made;
    }
    /// Returns the triangles of a mesh, at the positions that place(position) returns.
    template <class Place>
    Owned<RTCGeometry> triangles_of(const Mesh& mesh, const Place& place) const {
        Owned<RTCGeometry> triangles(rtcNewGeometry(device.get(), RTC_GEOMETRY_TYPE_TRIANGLE));
        // Embree reads beyond the end of vertex buffers, so it gets them in buffers of its own.
        auto* const vertices = static_cast<vec3*>(rtcSetNewGeometryBuffer(
            triangles.get(), RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, sizeof(vec3), mesh.positions.size()));
        if (!vertices) throw Error(mesh.name, "embree has no memory for the mesh");
        std::ranges::transform(mesh.positions, vertices, place);
        rtcSetSharedGeometryBuffer(triangles.get(), RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, mesh.triangles.data(),
                                   0, sizeof(uvec3), mesh.triangles.size());
        rtcCommitGeometry(triangles.get());
        return triangles;
    }
};

SceneProbe::SceneProbe(const Scene& scene) : scene_(scene), geometry_(std::make_unique<Geometry>()) {
    Geometry& g = *geometry_;
    bounds_ = world_bounds(scene);
    const dvec3 reach = glm::max(glm::abs(bounds_.lower), glm::abs(bounds_.upper));
    spacing_ =
        bounds_.empty() ? 0 : 0x1p-20 * glm::length(bounds_.upper - bounds_.lower) + 0x1p-46 * glm::length(reach);
    g.device.reset(rtcNewDevice(nullptr));
    if (!g.device) throw Error("embree", "no device (error {})", static_cast<int>(rtcGetDeviceError(nullptr)));
    std::vector<std::size_t> uses(scene.meshes.size());
    for (const Instance& instance : scene.instances) ++uses[static_cast<std::size_t>(instance.mesh)];
    g.meshes.resize(scene.meshes.size());
    g.top = g.make_scene();
    for (std::size_t i = 0; i < scene.instances.size(); ++i) {
        const auto index = static_cast<std::size_t>(scene.instances[i].mesh);
        const Mesh& mesh = scene.meshes[index];
        if (mesh.triangles.empty() || scene.instances[i].added) continue;
        dmat4 placed = scene.instances[i].object_to_world;  // relative to the centre, where floats are dense
        placed[3] -= dvec4(0.5 * bounds_.lower + 0.5 * bounds_.upper, 0);
        Owned<RTCGeometry> geometry;
        const bool shared = uses[index] > 1;
        if (shared && !invertible(placed)) continue;  // copies of a mesh could take any amount of memory
        if (shared) {
            if (!g.meshes[index]) {
                g.meshes[index] = g.make_scene();
                const auto triangles = g.triangles_of(mesh, [](const vec3& p) { return p; });
                rtcAttachGeometry(g.meshes[index].get(), triangles.get());
                rtcCommitScene(g.meshes[index].get());
            }
            geometry.reset(rtcNewGeometry(g.device.get(), RTC_GEOMETRY_TYPE_INSTANCE));
            rtcSetGeometryInstancedScene(geometry.get(), g.meshes[index].get());
            const mat4 columns(placed);
            rtcSetGeometryTransform(geometry.get(), 0, RTC_FORMAT_FLOAT4X4_COLUMN_MAJOR, &columns);
            rtcCommitGeometry(geometry.get());
        } else {
            geometry = g.triangles_of(mesh, [&](const vec3& p) { return vec3(dvec3(placed * dvec4(p, 1))); });
        }
        rtcAttachGeometryByID(g.top.get(), geometry.get(), static_cast<unsigned>(g.instances.size()));
        g.instances.push_back(i);
    }
    rtcCommitScene(g.top.get());
    if (const RTCError error = rtcGetDeviceError(g.device.get()); error != RTC_ERROR_NONE)
        throw Error(scene.name, "embree cannot build its hierarchy (error {})", static_cast<int>(error));
}

SceneProbe::~SceneProbe() = default;

std::optional<ProbeHit> SceneProbe::trace(const dvec3& origin, const dvec3& direction, double most,
                                          unsigned passing) const {
    constexpr int kMostPassed = 32;  // transparent surfaces, so that a stack of them ends
    if (bounds_.empty()) return std::nullopt;
    const dvec3 centre = 0.5 * bounds_.lower + 0.5 * bounds_.upper;
    dvec3 from = origin;
    for (int passed = 0; passed < kMostPassed; ++passed) {
        const vec3 o(from - centre), d(direction);
        constexpr float kMost = 1e15f;  // products of coordinates must be finite
        if (!all_finite(d) || !glm::all(glm::lessThan(glm::abs(o), vec3(kMost)))) return std::nullopt;
        RTCRayHit ray{};
        ray.ray.org_x = o.x, ray.ray.org_y = o.y, ray.ray.org_z = o.z;
        ray.ray.dir_x = d.x, ray.ray.dir_y = d.y, ray.ray.dir_z = d.z;
        ray.ray.tfar = std::max(static_cast<float>(most - glm::length(from - origin)), 0.0f);
        ray.ray.mask = ~0u;
        ray.hit.geomID = ray.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
        embree::Query().trace<rtcIntersect1>(geometry_->top.get(), &ray);
        if (ray.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;
        const std::size_t index =
            geometry_->instances[ray.hit.instID[0] != RTC_INVALID_GEOMETRY_ID ? ray.hit.instID[0] : ray.hit.geomID];
        const Instance& instance = scene_.instances[index];
        const Mesh& mesh = scene_.meshes[static_cast<std::size_t>(instance.mesh)];
        const uvec3& corners = mesh.triangles[ray.hit.primID];
        const vec3 weights(1 - ray.hit.u - ray.hit.v, ray.hit.u, ray.hit.v);
        const Material& material = scene_.materials[mesh.triangle_material[ray.hit.primID]];
        const auto corner = [&](int k) {
            return dvec3(instance.object_to_world * dvec4(mesh.positions[corners[k]], 1));
        };
        const dvec3 a = corner(0), b = corner(1), c = corner(2);
        dvec3 normal = glm::cross(b - a, c - a);
        const double length = glm::length(normal);
        normal = length > 0 ? normal / length : -direction;
        const bool mirrors = glm::determinant(dmat3(instance.object_to_world)) < 0;
        const bool outside = glm::dot(normal, direction) < 0, front = outside != mirrors;
        const float covered = coverage(scene_, material, mesh, corners, weights);
        const bool hidden = !front && is_one_sided(material);
        if ((passing & kPassHidden && hidden) || lets_pass(material, covered, passing)) {
            from += (double(ray.ray.tfar) + spacing_) * direction;
            continue;
        }
        return ProbeHit{.position = double(weights.x) * a + double(weights.y) * b + double(weights.z) * c,
                        .normal = outside ? normal : -normal,
                        .front = front,
                        .material = &material,
                        .instance = index,
                        .color = vec3(base_color(scene_, material, mesh, corners, weights)),
                        .emission = emission_at(scene_, material, mesh, corners, weights)};
    }
    return std::nullopt;
}

std::optional<ProbeHit> SceneProbe::see(const dvec3& origin, const dvec3& direction) const {
    const auto hit = trace(origin, direction, kFar, kPassHidden | kPassClear);
    return hit ? hit : trace(origin, direction, kFar, kPassHidden);
}

bool SceneProbe::blocked(const dvec3& from, const dvec3& direction, double distance, bool has_size) const {
    return trace(from, direction, distance, (has_size ? kPassClear : kPassPanes) | kPassScattered).has_value();
}

}  // namespace halflight::rays
