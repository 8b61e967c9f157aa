#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <span>

#include "tools/measure/bench/embree_tracer.h"

namespace halflight::bench {
namespace {

using shared::Hit;
using shared::Ray;

constexpr std::size_t kGrain = 256;  // rays of a task: one 16x16 block of pixels
using Paths = std::span<const std::uint32_t>;

/// Arguments of the call that traces a chunk of rays.
struct Job {
    RTCScene scene;
    mutable RTCIntersectContext context;
    const RaySet& set;
    const std::vector<std::uint32_t>& first_triangle;
    Answers& answers;

    void answer_closest(std::uint32_t path, float t, float u, float v, unsigned primitive, unsigned geometry,
                        unsigned instance_id) const {
        if (geometry == RTC_INVALID_GEOMETRY_ID) {
            answers.hits[path] = {kInfinity, 0, 0, shared::kMiss, shared::kMiss};
        } else {
            const unsigned instance = instance_id != RTC_INVALID_GEOMETRY_ID ? instance_id : geometry;
            answers.hits[path] = {t, u, v, first_triangle[instance] + primitive, instance};
        }
    }
    /// Stores the answer of an any-hit ray; Embree sets t_far to -inf for a hit.
    void answer_any(std::uint32_t path, float t_far) const {
        const Ray& ray = set.rays[path];
        answers.occluded[path] = t_far < 0 && ray.t_max >= ray.t_min ? shared::kOccluded : shared::kFree;
    }
};

// --- Rays one by one: rtcIntersect1, rtcIntersect1M ----------------------------------------------------------------

RTCRay embree_ray(const Ray& r) {
    return {r.origin.x, r.origin.y, r.origin.z, r.t_min, r.direction.x, r.direction.y, r.direction.z, 0,
            r.t_max,    ~0u,        0,          0};
}

RTCRayHit query_for(const Ray& ray) {
    RTCRayHit query;
    query.ray = embree_ray(ray);
    query.hit.geomID = query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
    return query;
}

void answer(const Job& job, std::uint32_t path, const RTCRayHit& q) {
    job.answer_closest(path, q.ray.tfar, q.hit.u, q.hit.v, q.hit.primID, q.hit.geomID, q.hit.instID[0]);
}

void trace_singly(const Job& job, Paths paths) {
    for (const std::uint32_t path : paths) {
        if (job.set.any_hit) {
            RTCRay query = embree_ray(job.set.rays[path]);
            rtcOccluded1(job.scene, &job.context, &query);
            job.answer_any(path, query.tfar);
        } else {
            RTCRayHit query = query_for(job.set.rays[path]);
            rtcIntersect1(job.scene, &job.context, &query);
            answer(job, path, query);
        }
    }
}

void trace_stream(const Job& job, Paths paths) {
    const auto count = static_cast<unsigned>(paths.size());
    if (job.set.any_hit) {
        std::array<RTCRay, kGrain> queries;
        for (std::size_t i = 0; i < count; ++i) queries[i] = embree_ray(job.set.rays[paths[i]]);
        rtcOccluded1M(job.scene, &job.context, queries.data(), count, sizeof(RTCRay));
        for (std::size_t i = 0; i < count; ++i) job.answer_any(paths[i], queries[i].tfar);
    } else {
        std::array<RTCRayHit, kGrain> queries;
        for (std::size_t i = 0; i < count; ++i) queries[i] = query_for(job.set.rays[paths[i]]);
        rtcIntersect1M(job.scene, &job.context, queries.data(), count, sizeof(RTCRayHit));
        for (std::size_t i = 0; i < count; ++i) answer(job, paths[i], queries[i]);
    }
}

// --- Packets: rtcIntersect8, rtcIntersect16, rtcIntersectNM -------------------------------------------------------

/// Loads ray i into a lane of RTCRay8 or RTCRay16. A lane without a ray gets a dead one.
template <class RayN>
void load(const Job& job, Paths paths, std::size_t lane, std::size_t i, RayN& to) {
    static constexpr Ray kDead{vec3(0), 1, vec3(1), 0};
    const Ray& r = i < paths.size() ? job.set.rays[paths[i]] : kDead;
    to.org_x[lane] = r.origin.x, to.org_y[lane] = r.origin.y, to.org_z[lane] = r.origin.z;
    to.dir_x[lane] = r.direction.x, to.dir_y[lane] = r.direction.y, to.dir_z[lane] = r.direction.z;
    to.tnear[lane] = r.t_min, to.tfar[lane] = r.t_max;
    to.time[lane] = 0, to.mask[lane] = ~0u, to.id[lane] = 0, to.flags[lane] = 0;
}

template <std::size_t N, class RayN, class RayHitN>
struct PacketsOf {
    static constexpr std::size_t kPackets = kGrain / N;

    template <class Intersect, class Occluded>
    static void trace(const Job& job, Paths paths, const Intersect& intersect, const Occluded& occluded) {
        const std::size_t packets = (paths.size() + N - 1) / N;
        if (job.set.any_hit) {
            std::array<RayN, kPackets> queries;
            for (std::size_t i = 0; i < packets * N; ++i) load(job, paths, i % N, i, queries[i / N]);
            occluded(queries.data(), packets);
            for (std::size_t i = 0; i < paths.size(); ++i) job.answer_any(paths[i], queries[i / N].tfar[i % N]);
        } else {
            std::array<RayHitN, kPackets> queries;
            for (std::size_t i = 0; i < packets * N; ++i) {
                RayHitN& q = queries[i / N];
                load(job, paths, i % N, i, q.ray);
                q.hit.geomID[i % N] = q.hit.instID[0][i % N] = RTC_INVALID_GEOMETRY_ID;
            }
            intersect(queries.data(), packets);
            for (std::size_t i = 0; i < paths.size(); ++i) {
                const RayHitN& q = queries[i / N];
                const std::size_t k = i % N;
                job.answer_closest(paths[i], q.ray.tfar[k], q.hit.u[k], q.hit.v[k], q.hit.primID[k], q.hit.geomID[k],
                                   q.hit.instID[0][k]);
            }
        }
    }
};

/// Returns a mask of the lanes that have a live ray.
template <std::size_t N, class RayN>
std::array<int, N> valid_lanes(const RayN& rays) {
    std::array<int, N> valid;
    for (std::size_t k = 0; k < N; ++k) valid[k] = rays.tfar[k] >= rays.tnear[k] ? -1 : 0;
    return valid;
}

/// Traces packet by packet. kIntersect, kOccluded: Embree's functions for one packet.
template <std::size_t N, class RayN, class RayHitN, auto kIntersect, auto kOccluded>
void trace_packets(const Job& job, Paths paths) {
    const auto each = [&](auto* queries, std::size_t count, auto rays, auto trace) {
        for (std::size_t p = 0; p < count; ++p) {
            alignas(4 * N) const std::array<int, N> valid = valid_lanes<N>(rays(queries[p]));
            trace(valid.data(), job.scene, &job.context, &queries[p]);
        }
    };
    PacketsOf<N, RayN, RayHitN>::trace(
        job, paths,
        [&](RayHitN* q, std::size_t count) {
            each(
                q, count, [](const RayHitN& query) -> const RayN& { return query.ray; }, kIntersect);
        },
        [&](RayN* q, std::size_t count) {
            each(
                q, count, [](const RayN& query) -> const RayN& { return query; }, kOccluded);
        });
}

void trace_packet_stream(const Job& job, Paths paths) {
    PacketsOf<16, RTCRay16, RTCRayHit16>::trace(
        job, paths,
        [&](RTCRayHit16* q, std::size_t count) {
            rtcIntersectNM(job.scene, &job.context, reinterpret_cast<RTCRayHitN*>(q), 16, static_cast<unsigned>(count),
                           sizeof(RTCRayHit16));
        },
        [&](RTCRay16* q, std::size_t count) {
            rtcOccludedNM(job.scene, &job.context, reinterpret_cast<RTCRayN*>(q), 16, static_cast<unsigned>(count),
                          sizeof(RTCRay16));
        });
}

using Trace = void (*)(const Job&, Paths);
Trace function_of(EmbreeMode mode) {
    switch (mode) {
        case EmbreeMode::single:
            return trace_singly;
        case EmbreeMode::packet8:
            return trace_packets<8, RTCRay8, RTCRayHit8, rtcIntersect8, rtcOccluded8>;
        case EmbreeMode::packet16:
            return trace_packets<16, RTCRay16, RTCRayHit16, rtcIntersect16, rtcOccluded16>;
        case EmbreeMode::stream:
            return trace_stream;
        case EmbreeMode::packets:
            return trace_packet_stream;
    }
    return nullptr;
}

}  // namespace

const char* name(EmbreeMode mode) {
    constexpr std::array kNames{"rtcIntersect1", "rtcIntersect8", "rtcIntersect16", "rtcIntersect1M", "rtcIntersectNM"};
    return kNames[static_cast<std::size_t>(mode)];
}

bool EmbreeTracer::supports(const RaySet& set, EmbreeMode mode, bool coherent) const {
    if (mode == EmbreeMode::single) return true;
    const bool instanced = std::ranges::any_of(blocks_, [](const ScenePtr& block) { return block != nullptr; });
    if (instanced && set.any_hit && coherent) return false;
    const bool stream = mode == EmbreeMode::stream || mode == EmbreeMode::packets;
    return !stream || rtcGetDeviceProperty(device_.get(), RTC_DEVICE_PROPERTY_RAY_STREAM_SUPPORTED) != 0;
}

void EmbreeTracer::trace(const RaySet& set, EmbreeMode mode, bool coherent, Answers& answers) const {
    const Trace function = function_of(mode);
    const Paths all(set.order);
    tbb::parallel_for(std::size_t{0}, (all.size() + kGrain - 1) / kGrain, [&](std::size_t chunk) {
        Job job{scene_.get(), {}, set, first_triangle_, answers};
        rtcInitIntersectContext(&job.context);
        job.context.flags = coherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
        const std::size_t first = chunk * kGrain;
        function(job, all.subspan(first, std::min(kGrain, all.size() - first)));
    });
}

}  // namespace halflight::bench
