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
    bool coherent;  // hint to Embree
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

// --- Rays one by one: rtcIntersect1 --------------------------------------------------------------------------------

RTCRay embree_ray(const Ray& r) {
    return {r.origin.x, r.origin.y, r.origin.z, r.t_min, r.direction.x, r.direction.y, r.direction.z, 0,
            r.t_max,    ~0u,        0,          0};
}

embree::Query query_of(const Job& job) {
    return {{}, nullptr, job.coherent};
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
            query_of(job).trace<rtcOccluded1>(job.scene, &query);
            job.answer_any(path, query.tfar);
        } else {
            RTCRayHit query = query_for(job.set.rays[path]);
            query_of(job).trace<rtcIntersect1>(job.scene, &query);
            answer(job, path, query);
        }
    }
}

// --- Packets: rtcIntersect8, rtcIntersect16 ------------------------------------------------------------------------

/// Loads a ray of a packet into its lane of RTCRay8 or RTCRay16. A lane without a ray gets a dead one.
template <class RayN>
void load(const Job& job, Paths packet, std::size_t lane, RayN& to) {
    static constexpr Ray kDead{vec3(0), 1, vec3(1), 0};
    const Ray& r = lane < packet.size() ? job.set.rays[packet[lane]] : kDead;
    to.org_x[lane] = r.origin.x, to.org_y[lane] = r.origin.y, to.org_z[lane] = r.origin.z;
    to.dir_x[lane] = r.direction.x, to.dir_y[lane] = r.direction.y, to.dir_z[lane] = r.direction.z;
    to.tnear[lane] = r.t_min, to.tfar[lane] = r.t_max;
    to.time[lane] = 0, to.mask[lane] = ~0u, to.id[lane] = 0, to.flags[lane] = 0;
}

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
    embree::Query query = query_of(job);
    for (std::size_t first = 0; first < paths.size(); first += N) {
        const Paths packet = paths.subspan(first, std::min(N, paths.size() - first));
        alignas(64) RayHitN q;
        for (std::size_t k = 0; k < N; ++k) load(job, packet, k, q.ray);
        alignas(4 * N) const std::array<int, N> valid = valid_lanes<N>(q.ray);
        if (job.set.any_hit) {
            query.trace<kOccluded>(job.scene, &q.ray, valid.data());
            for (std::size_t k = 0; k < packet.size(); ++k) job.answer_any(packet[k], q.ray.tfar[k]);
            continue;
        }
        for (std::size_t k = 0; k < N; ++k) q.hit.geomID[k] = q.hit.instID[0][k] = RTC_INVALID_GEOMETRY_ID;
        query.trace<kIntersect>(job.scene, &q, valid.data());
        for (std::size_t k = 0; k < packet.size(); ++k)
            job.answer_closest(packet[k], q.ray.tfar[k], q.hit.u[k], q.hit.v[k], q.hit.primID[k], q.hit.geomID[k],
                               q.hit.instID[0][k]);
    }
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
    }
    return nullptr;
}

}  // namespace

const char* name(EmbreeMode mode) {
    constexpr std::array kNames{"rtcIntersect1", "rtcIntersect8", "rtcIntersect16"};
    return kNames[static_cast<std::size_t>(mode)];
}

bool EmbreeTracer::supports(const RaySet& set, EmbreeMode mode, bool coherent) const {
    const bool instanced = std::ranges::any_of(blocks_, [](const ScenePtr& block) { return block != nullptr; });
    return mode == EmbreeMode::single || !(instanced && set.any_hit && coherent);
}

void EmbreeTracer::trace(const RaySet& set, EmbreeMode mode, bool coherent, Answers& answers) const {
    const Trace function = function_of(mode);
    const Paths all(set.order);
    tbb::parallel_for(std::size_t{0}, (all.size() + kGrain - 1) / kGrain, [&](std::size_t chunk) {
        const Job job{scene_.get(), coherent, set, first_triangle_, answers};
        const std::size_t first = chunk * kGrain;
        function(job, all.subspan(first, std::min(kGrain, all.size() - first)));
    });
}

}  // namespace halflight::bench
