#include "engine/reference/reference.h"

#include <tbb/blocked_range2d.h>
#include <tbb/info.h>
#include <tbb/parallel_for.h>
#include <tbb/partitioner.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <cmath>

#include "engine/core/error.h"
#include "engine/reference/path.h"

namespace halflight {

using reference::Prepared;
using reference::Surface;

ReferenceScene::ReferenceScene(const Scene& scene) : prepared_(std::make_unique<Prepared>(scene)) {}
ReferenceScene::~ReferenceScene() = default;
ReferenceScene::ReferenceScene(ReferenceScene&&) noexcept = default;
ReferenceScene& ReferenceScene::operator=(ReferenceScene&&) noexcept = default;

const dvec3& ReferenceScene::origin() const {
    return prepared_->tracer.origin();
}

std::optional<ReferenceHit> ReferenceScene::closest_hit(const ReferenceRay& ray, const AlphaTest& alpha) const {
    return prepared_->tracer.closest_hit({ray.origin - origin(), ray.direction, ray.t_min, ray.t_max, ray.passes_backs},
                                         alpha);
}

bool ReferenceScene::occluded(const ReferenceRay& ray, const AlphaTest& alpha) const {
    return prepared_->tracer.occluded({ray.origin - origin(), ray.direction, ray.t_min, ray.t_max, ray.passes_backs},
                                      alpha);
}

namespace {

constexpr int kTile = 16;  // pixels; small enough for load balancing, large enough for coherence

void check(const ReferenceSettings& s) {
    const auto require = [](bool fine, const char* name, auto value) {
        if (!fine) throw Error("reference", "{} = {} is out of range", name, value);
    };
    require(s.width > 0, "width", s.width);
    require(s.height > 0, "height", s.height);
    require(s.samples > 0, "samples", s.samples);
    require(s.first_sample >= 0, "first_sample", s.first_sample);
    require(s.bounces >= 0, "bounces", s.bounces);
    require(s.threads >= 0, "threads", s.threads);
    require(s.filter.radius > 0, "filter.radius", s.filter.radius);
    require(s.camera.lens.focus.kind != Focus::Kind::point, "lens.focus", "a point of the picture");
}

ReferenceResult make_result(const ReferenceSettings& s) {
    const auto image = [&](int channels) { return Image(s.width, s.height, channels); };
    ReferenceResult r;
    r.beauty = image(3), r.variance = image(3), r.alpha = image(1);
    r.components = {image(3), image(3), image(3), image(3), image(3)};
    const std::vector<std::int32_t> ids(static_cast<std::size_t>(s.width) * s.height, kNone);
    r.aovs = {image(3), image(3), image(3), image(1), ids, ids};
    r.samples = s.samples;
    return r;
}

void store(Image& image, int x, int y, const dvec3& value) {
    for (int c = 0; c < 3; ++c) image.at(x, y)[c] = static_cast<float>(value[c]);
}

/// Renders all samples of one pixel in order on one thread, so the sums do not depend on scheduling.
void render_pixel(const Prepared& scene, const ReferenceSettings& settings, int x, int y, ReferenceResult& result,
                  std::atomic<std::uint64_t>& non_finite) {
    reference::Radiance sum;
    dvec3 mean(0), squares(0);  // Welford's running mean and sum of squared deviations
    int count = 0, covered = 0;
    for (int i = 0; i < settings.samples; ++i) {
        const auto pixel = (static_cast<std::uint64_t>(y) << 32) | static_cast<std::uint64_t>(x);
        const auto sample = static_cast<std::uint64_t>(settings.first_sample) + static_cast<std::uint64_t>(i);
        reference::Random random(reference::combine(reference::combine(settings.seed, pixel), sample));
        const reference::PathResult path = reference::trace_path(scene, settings, x, y, random);
        covered += path.covered;
        const dvec3 beauty = path.radiance.sum();
        if (!std::isfinite(beauty.x + beauty.y + beauty.z)) {
            ++non_finite;
            continue;
        }
        sum += path.radiance;
        const dvec3 delta = beauty - mean;
        mean += delta / static_cast<double>(++count);
        squares += delta * (beauty - mean);
    }
    const double scale = 1.0 / std::max(count, 1);
    store(result.beauty, x, y, mean);
    if (count > 1) store(result.variance, x, y, squares / (count - 1.0));
    store(result.components.emission, x, y, sum.emission * scale);
    store(result.components.direct_diffuse, x, y, sum.direct[0] * scale);
    store(result.components.direct_glossy, x, y, sum.direct[1] * scale);
    store(result.components.indirect_diffuse, x, y, sum.indirect[0] * scale);
    store(result.components.indirect_glossy, x, y, sum.indirect[1] * scale);
    *result.alpha.at(x, y) = static_cast<float>(covered) / static_cast<float>(settings.samples);
}

void store_aovs(const Prepared& scene, const ReferenceSettings& settings, int x, int y, ReferenceAovs& aovs) {
    const std::optional<reference::FirstSurface> first = reference::first_surface(scene, settings, x, y);
    if (!first) return;
    const Surface* const surface = &first->surface;
    const dmat4& camera = settings.camera.camera_to_world;
    const dvec3 position = surface->seen - (dvec3(camera[3]) - scene.tracer.origin());
    store(aovs.position, x, y, position);
    store(aovs.normal, x, y, surface->n);
    store(aovs.albedo, x, y, surface->parameters.base_color);
    *aovs.depth.at(x, y) = static_cast<float>(first->depth);
    const auto index = static_cast<std::size_t>(y) * settings.width + x;
    aovs.instance[index] = surface->triangle.instance;
    aovs.triangle[index] = surface->triangle.triangle;
}

}  // namespace

ReferenceResult render_reference(const ReferenceScene& scene, const ReferenceSettings& settings) {
    check(settings);
    ReferenceResult result = make_result(settings);
    std::atomic<std::uint64_t> non_finite{0};
    const auto render_tile = [&](const tbb::blocked_range2d<int>& tile) {
        for (int y = tile.rows().begin(); y != tile.rows().end(); ++y) {
            for (int x = tile.cols().begin(); x != tile.cols().end(); ++x) {
                render_pixel(scene.prepared(), settings, x, y, result, non_finite);
                store_aovs(scene.prepared(), settings, x, y, result.aovs);
            }
        }
    };
    const int available = tbb::info::default_concurrency();
    tbb::task_arena arena(settings.threads > 0 ? std::min(settings.threads, available) : available);
    arena.execute([&] {
        tbb::parallel_for(tbb::blocked_range2d<int>(0, settings.height, kTile, 0, settings.width, kTile), render_tile,
                          tbb::simple_partitioner());
    });
    result.non_finite_samples = non_finite;
    return result;
}

}  // namespace halflight
