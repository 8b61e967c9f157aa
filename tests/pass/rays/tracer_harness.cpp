#include "tests/pass/rays/tracer_harness.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstring>
#include <random>

#include "shaders/shared/frame_block.h"

namespace halflight::test {

using graph::Access;

template <class Result>
std::vector<Result> run_trace(graph::Executor& executor, const TraceRequest& request, const AddTrace& add) {
    std::vector<Ray> padded(request.rays.begin(), request.rays.end());
    padded.resize((padded.size() + 255) / 256 * 256, {vec3(0), 1, vec3(1), 0});
    gpu::Buffer ray_buffer = gpu::Buffer::from("rays", padded);
    gpu::Buffer results("results", padded.size() * sizeof(Result));
    std::vector<std::uint32_t> padded_list = request.list ? *request.list : std::vector<std::uint32_t>{};
    const auto count = static_cast<std::uint32_t>(padded_list.size());
    padded_list.resize(padded.size());
    gpu::Buffer list_buffer = gpu::Buffer::from("list", padded_list);
    const shared::ListHeader head{(count + 63) / 64, 1, 1, count};
    gpu::Buffer head_buffer("list header", sizeof(head), &head);

    graph::Graph graph;
    rays::RayBatch batch;
    batch.kind = request.kind;
    batch.rays_of_path = request.rays_of_path;
    batch.alpha_salt = request.alpha_salt;
    batch.backfaces = request.backfaces;
    batch.passes_panes = request.passes_panes;
    batch.capacity = static_cast<std::uint32_t>(padded.size());
    batch.rays = graph.import_buffer("rays", ray_buffer);
    if (request.list) {
        batch.list = graph.import_buffer("list", list_buffer);
        batch.list_header = graph.import_buffer("list header", head_buffer);
    }
    if (request.frame_constants) {
        batch.frame_constants = graph.import_buffer("frame constants", *request.frame_constants);
    }
    graph.output(add(graph, batch, graph.import_buffer("results", results)));
    executor.run(graph::compile(graph));
    return results.read<Result>(0, request.rays.size());
}
template std::vector<Hit> run_trace(graph::Executor&, const TraceRequest&, const AddTrace&);
template std::vector<std::uint32_t> run_trace(graph::Executor&, const TraceRequest&, const AddTrace&);

std::vector<Hit> Tracer::closest(std::span<const Ray> rays, const std::vector<std::uint32_t>* list) {
    graph::Executor executor(programs_);
    return closest_hits(executor, {rays, list}, scene);
}
std::vector<std::uint32_t> Tracer::any(std::span<const Ray> rays, const std::vector<std::uint32_t>* list) {
    graph::Executor executor(programs_);
    return any_hits(executor, {rays, list}, scene);
}

gpu::Buffer constants_of_paths(std::uint32_t sample) {
    shared::Frame frame{};
    frame.seed = 5;
    frame.size = {16, 4096}, frame.tiles_x = 1, frame.tiles_y = 256;
    frame.sample_index = sample;
    return gpu::Buffer("frame constants", sizeof(frame), &frame);
}

rays::PackedScene roomy(rays::PackedScene packed) {
    packed.stack_entries = std::max(packed.stack_entries, 64u);
    return packed;
}

AgainstPlain::AgainstPlain(gpu::ProgramCache& programs, const TraceTables& tables, rays::PackedScene packed,
                           const Methods& methods, const gpu::Defines& shading)
    : packed_(std::move(packed)), scene_(tables, packed_, shading), executor_(programs) {
    executor_.poison(true);
    if (methods.tiles)
        tracers_.emplace_back("tiles",
                              std::make_unique<rays::Tracer>(scene_, rays::Culling::compute, methods.tile_settings));
    if (methods.native && rays::NativeServer::reason_against(scene_).empty()) {
        native_ = std::make_unique<rays::NativeServer>(tables, scene_);
        tracers_.emplace_back("native", std::make_unique<rays::Tracer>(scene_, *native_));
    }
    if (methods.raster) {
        rays::RasterSettings settings;
        settings.cut.leaf_triangles = methods.raster_leaf;
        raster_.emplace(packed_, settings);
        tracers_.emplace_back("raster", std::make_unique<rays::Tracer>(scene_, *raster_));
    }
}

std::string AgainstPlain::differences(const TraceRequest& request, int runs) {
    const Answers plain = answers(executor_, request, scene_);
    std::string found;
    for (const auto& [name, tracer] : tracers_) {
        for (int run = 0; run < runs; ++run) {
            std::size_t count = different(answers(executor_, request, *tracer), plain);
            if (name == "native") {  // bundles only rays of some kinds
                TraceRequest single = request;
                single.kind = rays::RayKind::continuation;
                count += different(answers(executor_, single, *tracer), plain);
            }
            if (count != 0) found += fmt::format("{} in run {}: {} rays; ", name, run, count);
        }
    }
    if (native_ && native_->counts().disabled) found += native_->counts().note;
    return found;
}

EmbreeOracle::EmbreeOracle(const TraceTables& tables)
    : tables_(tables), device_(rtcNewDevice(nullptr)), scene_(rtcNewScene(device_.get())) {
    rtcSetSceneFlags(scene_.get(), RTC_SCENE_FLAG_ROBUST);
    for (std::uint32_t i = 0; i < tables.instances.size(); ++i) {  // Embree's geometry id is the instance
        const Block& block = tables.blocks[tables.instances[i].block];
        RTCGeometry geometry = rtcNewGeometry(device_.get(), RTC_GEOMETRY_TYPE_TRIANGLE);
        auto* vertices = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0,
                                                                     RTC_FORMAT_FLOAT3, 12, 3 * block.triangle_count));
        auto* indices = static_cast<std::uint32_t*>(
            rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12, block.triangle_count));
        for (std::uint32_t t = 0; t < block.triangle_count; ++t) {
            const auto placed = corners(i, block.first_triangle + t);
            for (std::uint32_t k = 0; k < 3; ++k) {
                for (int a = 0; a < 3; ++a) *vertices++ = static_cast<float>(placed[k][a]);
                *indices++ = 3 * t + k;
            }
        }
        rtcCommitGeometry(geometry);
        rtcAttachGeometryByID(scene_.get(), geometry, i);
        rtcReleaseGeometry(geometry);
    }
    rtcCommitScene(scene_.get());
}

std::array<dvec3, 3> EmbreeOracle::corners(std::uint32_t instance, std::uint32_t triangle) const {
    const glm::mat4x3& m = tables_.instances[instance].block_to_world;
    std::array<dvec3, 3> result;
    for (int k = 0; k < 3; ++k) {
        const dvec3 p(tables_.positions[tables_.triangles[triangle][k]]);
        result[static_cast<std::size_t>(k)] = dvec3(m[0]) * p.x + dvec3(m[1]) * p.y + dvec3(m[2]) * p.z + dvec3(m[3]);
    }
    return result;
}

static RTCRay embree_ray(const Ray& ray) {
    const auto& [o, t_min, d, t_max] = ray;
    return {o.x, o.y, o.z, t_min, d.x, d.y, d.z, 0, t_max, ~0u, 0, 0};
}

std::vector<Hit> EmbreeOracle::closest(std::span<const Ray> rays) const {
    std::vector<Hit> hits;
    for (const Ray& ray : rays) {
        RTCRayHit query{};
        query.ray = embree_ray(ray);
        query.hit.geomID = query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
        if (ray.t_max >= ray.t_min) embree::Query().trace<rtcIntersect1>(scene_.get(), &query);
        const bool hit = query.hit.geomID != RTC_INVALID_GEOMETRY_ID;
        const std::uint32_t first = hit ? tables_.blocks[tables_.instances[query.hit.geomID].block].first_triangle : 0;
        hits.push_back(hit ? Hit{query.ray.tfar, query.hit.u, query.hit.v, first + query.hit.primID, query.hit.geomID}
                           : Hit{kInfinity, 0, 0, kMiss, kMiss});
    }
    return hits;
}

std::vector<std::uint32_t> EmbreeOracle::any(std::span<const Ray> rays) const {
    std::vector<std::uint32_t> occluded;
    for (const Ray& ray : rays) {
        RTCRay query = embree_ray(ray);
        if (ray.t_max >= ray.t_min) embree::Query().trace<rtcOccluded1>(scene_.get(), &query);
        occluded.push_back(query.tfar < 0 ? 1u : 0u);
    }
    return occluded;
}

namespace {

/// Returns the distance between a line (unit direction) and a segment.
double line_segment_distance(const dvec3& origin, const dvec3& direction, const dvec3& a, const dvec3& b) {
    const auto across = [&](const dvec3& p) { return p - direction * glm::dot(p, direction); };
    const dvec3 p = across(a - origin), e = across(b - origin) - p;
    const double length2 = glm::dot(e, e);
    const double s = length2 > 0 ? glm::clamp(-glm::dot(p, e) / length2, 0.0, 1.0) : 0.0;
    return glm::length(p + s * e);
}

}  // namespace

Comparison compare_hits(const EmbreeOracle& oracle, std::span<const Ray> rays, const std::vector<Hit>& hits,
                        double condition) {
    Comparison result;
    const std::vector<Hit> expected = oracle.closest(rays);
    for (std::size_t i = 0; i < rays.size(); ++i) {
        const Hit &mine = hits[i], &theirs = expected[i];
        ++result.rays;
        if (theirs.triangle != kMiss) ++result.hits;
        if (mine.triangle == theirs.triangle && mine.instance == theirs.instance && mine.triangle == kMiss) continue;

        // The nearer of the two hits is the one that the other tracer misses.
        const bool extra = mine.triangle != kMiss && (theirs.triangle == kMiss || mine.t < theirs.t);
        const Hit& claim = extra ? mine : theirs;
        const Hit& other = extra ? theirs : mine;
        const auto c = oracle.corners(claim.instance, claim.triangle);
        const dvec3 origin(rays[i].origin);
        const double scale = glm::length(dvec3(rays[i].direction));
        const dvec3 direction = dvec3(rays[i].direction) / scale;
        double reach = 0;
        for (const dvec3& p : c) {
            for (int a = 0; a < 3; ++a) reach = std::max({reach, std::abs(p[a] - origin[a]), std::abs(p[a])});
        }
        const double error = condition * reach * 0x1p-18;
        // t has the error of the interpolation weights, which grows with the length of the projected triangle over its
        // area.
        const dvec3 normal = glm::cross(c[1] - c[0], c[2] - c[0]);
        const double projected = std::abs(glm::dot(normal, direction));
        double longest2 = 0;
        for (std::size_t k = 0; k < 3; ++k) {
            const dvec3 e = c[(k + 1) % 3] - c[k];
            longest2 = std::max(longest2, glm::dot(e, e));
        }
        const double steep = (glm::length(normal) + longest2) / std::max(projected, 1e-300);
        const double t_error = std::min(error * (1 + steep), 2 * reach) / scale;
        if (other.triangle != kMiss && std::abs(double{claim.t} - double{other.t}) <= t_error) continue;

        double edge = kInfinity;
        for (std::size_t k = 0; k < 3; ++k) {
            edge = std::min(edge, line_segment_distance(origin, direction, c[k], c[(k + 1) % 3]));
        }
        const bool at_end =
            std::abs(claim.t - rays[i].t_min) <= t_error || std::abs(claim.t - rays[i].t_max) <= t_error;
        if (edge <= error || at_end) {
            ++result.excused;
        } else {
            ++(extra ? result.false_hits : result.missed);
        }
    }
    return result;
}

Comparison expect_embree_hits(const EmbreeOracle& oracle, Tracer& tracer, std::span<const Ray> rays, double condition) {
    const std::vector<Hit> hits = tracer.closest(rays);
    const std::vector<std::uint32_t> occluded = tracer.any(rays);
    const Comparison c = compare_hits(oracle, rays, hits, condition);
    EXPECT_GT(c.hits, c.rays / 100);
    EXPECT_EQ(c.missed, 0u);
    EXPECT_EQ(c.false_hits, 0u);
    std::size_t disagree = 0;
    for (std::size_t i = 0; i < rays.size(); ++i) disagree += (hits[i].triangle != kMiss) != (occluded[i] == 1);
    EXPECT_EQ(disagree, 0u);
    return c;
}

std::vector<std::uint32_t> bits_of(const std::vector<Hit>& hits) {
    std::vector<std::uint32_t> bits(hits.size() * sizeof(Hit) / sizeof(std::uint32_t));
    std::memcpy(bits.data(), hits.data(), hits.size() * sizeof(Hit));
    return bits;
}

std::vector<Ray> rays_onward(const EmbreeOracle& oracle, std::span<const Ray> rays, const std::vector<Hit>& hits,
                             float diagonal) {
    std::mt19937 random(1);
    std::normal_distribution<float> normal_distribution;
    std::vector<Ray> onward;
    for (std::size_t i = 0; i < rays.size(); ++i) {
        if (hits[i].triangle == kMiss) continue;
        const auto c = oracle.corners(hits[i].instance, hits[i].triangle);
        vec3 normal(glm::normalize(glm::cross(c[1] - c[0], c[2] - c[0])));
        if (glm::dot(normal, rays[i].direction) > 0) normal = -normal;
        vec3 direction(normal_distribution(random), normal_distribution(random), normal_distribution(random));
        if (i % 10 == 0) direction -= 0.99f * normal * glm::dot(normal, direction);
        if (direction == vec3(0)) continue;
        const vec3 from = rays[i].origin + hits[i].t * rays[i].direction + 1e-4f * diagonal * normal;
        onward.push_back({from, 0, glm::normalize(direction), kInfinity});
    }
    return onward;
}

}  // namespace halflight::test
