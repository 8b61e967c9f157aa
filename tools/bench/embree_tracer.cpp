#include "tools/bench/embree_tracer.h"

#include <tbb/parallel_for.h>

#include <algorithm>

#include "engine/gpu/context.h"

namespace halflight::bench {
namespace {

using shared::Hit;
using shared::Ray;

constexpr std::size_t kGrain = 256;  // rays a task takes: one 16x16 block of pixels

RTCRay embree_ray(const Ray& r) {
    return {r.origin.x, r.origin.y, r.origin.z, r.t_min, r.direction.x, r.direction.y, r.direction.z, 0,
            r.t_max,    ~0u,        0,          0};
}

RTCIntersectContext context_for(bool coherent) {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = coherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
    return context;
}

RTCRayHit query_for(const Ray& ray) {
    RTCRayHit query;
    query.ray = embree_ray(ray);
    query.hit.geomID = query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
    return query;
}

template <class F>
void for_all(std::size_t count, const F& f) {
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count, kGrain), [&](const auto& range) {
        for (std::size_t i = range.begin(); i < range.end(); ++i) f(i);
    });
}

}  // namespace

EmbreeTracer::EmbreeTracer(const TraceTables& tables, bool robust) : device_(rtcNewDevice(nullptr)) {
    build_seconds_ = gpu::timed([&] {
        scene_ = new_scene(robust);
        blocks_.resize(tables.blocks.size());
        for (const BlockInstance& instance : tables.instances) {
            const Block& block = tables.blocks[instance.block];
            if (instance.identity) {
                attach_block(scene_.get(), tables, block);
            } else {
                if (!blocks_[instance.block]) {
                    blocks_[instance.block] = new_scene(robust);
                    attach_block(blocks_[instance.block].get(), tables, block);
                    rtcCommitScene(blocks_[instance.block].get());
                }
                attach_instance(instance, blocks_[instance.block].get());
            }
            first_triangle_.push_back(block.first_triangle);
        }
        rtcCommitScene(scene_.get());
    });
}

EmbreeTracer::ScenePtr EmbreeTracer::new_scene(bool robust) const {
    ScenePtr scene(rtcNewScene(device_.get()));
    if (robust) rtcSetSceneFlags(scene.get(), RTC_SCENE_FLAG_ROBUST);
    return scene;
}

void EmbreeTracer::attach_block(RTCScene scene, const TraceTables& tables, const Block& block) const {
    RTCGeometry geometry = rtcNewGeometry(device_.get(), RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* vertices = static_cast<vec3*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                                                sizeof(vec3), tables.positions.size()));
    std::copy(tables.positions.begin(), tables.positions.end(), vertices);
    auto* indices = static_cast<uvec3*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                                                sizeof(uvec3), block.triangle_count));
    for (std::uint32_t i = 0; i < block.triangle_count; ++i) {
        indices[i] = uvec3(tables.triangles[block.first_triangle + i]);
    }
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene, geometry);
    rtcReleaseGeometry(geometry);
}

void EmbreeTracer::attach_instance(const BlockInstance& instance, RTCScene block) const {
    RTCGeometry geometry = rtcNewGeometry(device_.get(), RTC_GEOMETRY_TYPE_INSTANCE);
    rtcSetGeometryInstancedScene(geometry, block);
    rtcSetGeometryTransform(geometry, 0, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, &instance.block_to_world[0][0]);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene_.get(), geometry);
    rtcReleaseGeometry(geometry);
}

void EmbreeTracer::closest(std::span<const Ray> rays, std::vector<Hit>& hits, bool coherent) const {
    for_all(rays.size(), [&](std::size_t i) {
        RTCIntersectContext context = context_for(coherent);
        RTCRayHit query = query_for(rays[i]);
        rtcIntersect1(scene_.get(), &context, &query);
        if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) {
            hits[i] = {kInfinity, 0, 0, shared::kMiss, shared::kMiss};
        } else {
            const bool instanced = query.hit.instID[0] != RTC_INVALID_GEOMETRY_ID;
            const std::uint32_t instance = instanced ? query.hit.instID[0] : query.hit.geomID;
            hits[i] = {query.ray.tfar, query.hit.u, query.hit.v, first_triangle_[instance] + query.hit.primID,
                       instance};
        }
    });
}

void EmbreeTracer::any(std::span<const Ray> rays, std::vector<std::uint32_t>& occluded, bool coherent) const {
    for_all(rays.size(), [&](std::size_t i) {
        RTCIntersectContext context = context_for(coherent);
        RTCRay query = embree_ray(rays[i]);
        rtcOccluded1(scene_.get(), &context, &query);
        occluded[i] = query.tfar < 0 && rays[i].t_max >= rays[i].t_min ? 1u : 0u;
    });
}

vec3 EmbreeTracer::normal_at(const Ray& ray) const {
    RTCIntersectContext context = context_for(false);
    RTCRayHit query = query_for(ray);
    rtcIntersect1(scene_.get(), &context, &query);
    const vec3 normal(query.hit.Ng_x, query.hit.Ng_y, query.hit.Ng_z);
    if (query.hit.instID[0] == RTC_INVALID_GEOMETRY_ID) return normal;
    glm::mat4x3 m;
    rtcGetGeometryTransform(rtcGetGeometry(scene_.get(), query.hit.instID[0]), 0, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, &m);
    return glm::transpose(glm::inverse(glm::mat3(m))) * normal;
}

}  // namespace halflight::bench
