#include "engine/reference/tracer.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "engine/core/error.h"
#include "engine/reference/random.h"
#include "engine/reference/surface.h"

namespace halflight::reference {
namespace {

double hashed_uniform(std::uint64_t key, std::uint32_t instance, std::uint32_t triangle) {
    return to_unit(combine(key, (static_cast<std::uint64_t>(instance) << 32) | triangle));
}

/// Data of the filter about its ray; Embree passes the leading member back.
struct Query {
    embree::Query query;
    const Tracer* tracer;
    const AlphaTest* alpha;
    const ReferenceRay* ray;
    float nearest_t = kInfinity;
    TriangleId nearest{};

    Query(const Tracer& t, const AlphaTest& a, const ReferenceRay& r);
};

bool seen_from_front_only(const Material& m) {
    const bool dielectric = !m.unlit && (m.metallic < 1 || m.metallic_roughness_texture);
    const bool passes = dielectric && (m.transmission > 0 || m.diffuse_transmission > 0);
    return !m.double_sided && !passes;
}

bool is_there(const Query& query, const TriangleId& id, double u, double v) {
    const Material& material = query.tracer->material(id);
    if (material.alpha_mode == AlphaMode::opaque) return true;
    const double alpha = coverage(*query.tracer, id, u, v);
    if (material.alpha_mode == AlphaMode::mask) return alpha >= material.alpha_cutoff;
    const auto uniform = query.alpha->uniform ? query.alpha->uniform : hashed_uniform;
    return uniform(query.alpha->key, id.instance, id.triangle) < alpha;
}

/// Decides on a candidate hit; clears `valid` to reject the hit.
void filter(const RTCFilterFunctionNArguments* arguments) {
    Query& query = *reinterpret_cast<Query*>(arguments->context);
    const TriangleId id{static_cast<int>(RTCHitN_geomID(arguments->hit, 1, 0)),
                        static_cast<int>(RTCHitN_primID(arguments->hit, 1, 0))};
    const float t = RTCRayN_tfar(arguments->ray, 1, 0);
    bool accept = true;
    if (t == query.nearest_t) {
        accept = std::tie(id.instance, id.triangle) < std::tie(query.nearest.instance, query.nearest.triangle);
    }
    if (accept) {
        const Instance& object = query.tracer->scene().instances[static_cast<std::size_t>(id.instance)];
        accept = ((query.ray->classes >> object.link_class) & 1) == 1;
    }
    if (accept && query.ray->passes_backs && query.tracer->placed(id.instance).one_sided)
        accept = !query.tracer->one_sided(id) || !(dot(query.tracer->front(id), query.ray->direction) > 0);
    if (accept && query.tracer->placed(id.instance).alpha_tested) {
        accept = is_there(query, id, RTCHitN_u(arguments->hit, 1, 0), RTCHitN_v(arguments->hit, 1, 0));
    }
    if (accept) {
        query.nearest_t = t;
        query.nearest = id;
    } else {
        arguments->valid[0] = 0;
    }
}

Query::Query(const Tracer& t, const AlphaTest& a, const ReferenceRay& r) : tracer(&t), alpha(&a), ray(&r) {
    query.filter = filter;
}

/// The ray in float, and the distance at which it starts. A ray from outside starts at most one scene diameter away
/// from the scene, so that its origin is rounded on the scene's scale.
struct Prepared32 {
    RTCRay ray{};
    double shift = 0;
};

Prepared32 to_float(const ReferenceRay& ray, double radius) {
    Prepared32 result;
    const double length2 = dot(ray.direction, ray.direction);
    if (dot(ray.origin, ray.origin) > radius * radius) {
        const double closest = -dot(ray.origin, ray.direction) / length2;
        result.shift = std::max(closest - radius / std::sqrt(length2), 0.0);
    }
    const vec3 o(ray.origin + result.shift * ray.direction), d(ray.direction);
    RTCRay& r = result.ray;
    r.org_x = o.x, r.org_y = o.y, r.org_z = o.z;
    r.dir_x = d.x, r.dir_y = d.y, r.dir_z = d.z;
    r.tnear = static_cast<float>(std::max(ray.t_min - result.shift, 0.0));
    r.tfar = static_cast<float>(ray.t_max - result.shift);
    r.mask = ~0u;
    return result;
}

}  // namespace

Tracer::Tracer(const Scene& scene) : scene_(scene), device_(rtcNewDevice(nullptr)) {
    if (!device_) throw Error("embree", "no device (error {})", static_cast<int>(rtcGetDeviceError(nullptr)));
    geometry_.reset(rtcNewScene(device_.get()));
    rtcSetSceneFlags(geometry_.get(), static_cast<RTCSceneFlags>(RTC_SCENE_FLAG_ROBUST | embree::kQueriesFilter));
    find_origin();
    placed_.resize(scene.instances.size());
    for (std::size_t i = 0; i < placed_.size(); ++i) attach(static_cast<int>(i));
    rtcCommitScene(geometry_.get());
    if (const RTCError error = rtcGetDeviceError(device_.get()); error != RTC_ERROR_NONE) {
        throw Error("embree", "cannot build the scene (error {})", static_cast<int>(error));
    }
}

void Tracer::find_origin() {
    constexpr double kFar = std::numeric_limits<double>::infinity();
    dvec3 lower(kFar), upper(-kFar);
    for (const Instance& instance : scene_.instances) {
        for (const vec3& p : scene_.meshes[static_cast<std::size_t>(instance.mesh)].positions) {
            const dvec3 world(instance.object_to_world * dvec4(p, 1));
            lower = min(lower, world), upper = max(upper, world);
        }
    }
    if (lower.x <= upper.x) origin_ = 0.5 * (lower + upper);
}

void Tracer::attach(int index) {
    const Instance& instance = scene_.instances[static_cast<std::size_t>(index)];
    const Mesh& mesh = scene_.meshes[static_cast<std::size_t>(instance.mesh)];
    Placed& placed = placed_[static_cast<std::size_t>(index)];
    placed.mesh = &mesh;
    placed.linear = dmat3(instance.object_to_world);
    const dmat3& m = placed.linear;
    placed.handedness = determinant(m) < 0 ? -1 : 1;
    placed.normals = placed.handedness * dmat3(cross(m[1], m[2]), cross(m[2], m[0]), cross(m[0], m[1]));
    if (mesh.triangles.empty()) return;
    placed.alpha_tested = std::any_of(mesh.triangle_material.begin(), mesh.triangle_material.end(), [&](auto material) {
        return scene_.materials[material].alpha_mode != AlphaMode::opaque;
    });
    placed.one_sided = std::any_of(mesh.triangle_material.begin(), mesh.triangle_material.end(),
                                   [&](auto material) { return seen_from_front_only(scene_.materials[material]); });

    const RTCGeometry geometry = rtcNewGeometry(device_.get(), RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* vertices = static_cast<vec3*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                                                sizeof(vec3), mesh.positions.size()));
    auto* triangles = static_cast<uvec3*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                                                  sizeof(uvec3), mesh.triangles.size()));
    if (vertices != nullptr && triangles != nullptr) {
        for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
            vertices[i] = vec3(dvec3(instance.object_to_world * dvec4(mesh.positions[i], 1)) - origin_);
            radius_ = std::max(radius_, length(dvec3(vertices[i])));
        }
        std::copy(mesh.triangles.begin(), mesh.triangles.end(), triangles);
        placed.vertices = vertices;
        rtcCommitGeometry(geometry);
        rtcAttachGeometryByID(geometry_.get(), geometry, static_cast<unsigned>(index));
    }
    rtcReleaseGeometry(geometry);
}

std::optional<ReferenceHit> Tracer::closest_hit(const ReferenceRay& ray, const AlphaTest& alpha) const {
    const Prepared32 prepared = to_float(ray, radius_);
    RTCRayHit hit{prepared.ray, {}};
    hit.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    Query(*this, alpha, ray).query.trace<rtcIntersect1>(geometry_.get(), &hit);
    if (hit.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;
    return ReferenceHit{prepared.shift + hit.ray.tfar, hit.hit.u, hit.hit.v, static_cast<int>(hit.hit.geomID),
                        static_cast<int>(hit.hit.primID)};
}

bool Tracer::occluded(const ReferenceRay& ray, const AlphaTest& alpha) const {
    Prepared32 prepared = to_float(ray, radius_);
    Query(*this, alpha, ray).query.trace<rtcOccluded1>(geometry_.get(), &prepared.ray);
    return prepared.ray.tfar < 0;
}

const Material& Tracer::material(const TriangleId& id) const {
    return scene_.materials[placed(id.instance).mesh->triangle_material[static_cast<std::size_t>(id.triangle)]];
}

LightLinks Tracer::links(const TriangleId& id) const {
    const LightLinks& object = scene_.instances[static_cast<std::size_t>(id.instance)].links;
    const LightLinks& surface = material(id).links;
    return {object.receivers & surface.receivers, object.blockers & surface.blockers};
}

bool Tracer::one_sided(const TriangleId& id) const {
    return seen_from_front_only(material(id));
}

dvec3 Tracer::front(const TriangleId& id) const {
    const auto [a, b, c] = corners(id);
    return placed(id.instance).handedness * cross(b - a, c - a);
}

std::array<dvec3, 3> Tracer::corners(const TriangleId& id) const {
    const Placed& instance = placed(id.instance);
    const uvec3& index = instance.mesh->triangles[static_cast<std::size_t>(id.triangle)];
    return {dvec3(instance.vertices[index.x]), dvec3(instance.vertices[index.y]), dvec3(instance.vertices[index.z])};
}

}  // namespace halflight::reference
