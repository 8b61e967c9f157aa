#include "tools/measure/bench/embree_tracer.h"

#include <algorithm>

#include "engine/gpu/context.h"

namespace halflight::bench {

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

}  // namespace halflight::bench
