#include "passes/light/radiance_cache.h"

#include <epoxy/gl.h>

#include <algorithm>

#include "shaders/shared/path.h"
#include "shaders/shared/radiance_cache.h"

namespace halflight {
namespace {

using graph::Access;

constexpr std::uint32_t kSweepEvery = 64;  // pictures
constexpr std::uint32_t kOldest = 192;

/// What both kernels read, from binding 0 on, besides the states.
struct Inputs {
    graph::BufferHandle points, occluded, sun_occluded, sun_light;
    graph::BufferHandle cells{}, counts{};

    void declare(graph::Pass& pass) const {
        for (const graph::BufferHandle& read : {points, occluded, sun_occluded, sun_light})
            if (read) pass.read(read, Access::storage_read);
    }
    gpu::Defines defines() const {
        gpu::Defines defines;
        defines.set("HALFLIGHT_RADIANCE_CACHE");
        if (occluded) defines.set("HALFLIGHT_PENDING");
        if (sun_occluded) defines.set("HALFLIGHT_SUN");
        return defines;
    }
    void bind(graph::Resources& r, graph::BufferHandle states) const {
        r.buffer(states).bind_storage(0);
        r.buffer(points).bind_storage(1);
        r.buffer(cells).bind_storage(2);
        if (counts) r.buffer(counts).bind_storage(3);
        if (occluded) r.buffer(occluded).bind_storage(4);
        if (sun_occluded) {
            r.buffer(sun_occluded).bind_storage(5);
            r.buffer(sun_light).bind_storage(6);
        }
    }
};

}  // namespace

RadianceCache::RadianceCache()
    : cells_("radiance cache", std::size_t{shared::kCacheCells} * sizeof(shared::CacheCell)),
      counts_("radiance cache counts", sizeof(shared::CacheCounts)) {}

void RadianceCache::clear() {
    cells_.clear();
    counts_.clear();
    picture_ = 0;
}

void RadianceCache::begin_picture(gpu::ProgramCache& programs) {
    ++picture_;
    counts_.clear();
    if (picture_ % kSweepEvery != 0) return;
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
    cells_.bind_storage(0);
    const gpu::Program& program = programs.compute("shaders/radiance_cache_age.comp");
    program.set("picture", picture_);
    program.set("oldest", kOldest);
    program.dispatch(shared::kCacheCells / 64);
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
}

CacheStatistics RadianceCache::statistics() const {
    const auto cells = cells_.read<shared::CacheCell>();
    const auto with = [&](std::uint32_t samples) {
        return static_cast<std::size_t>(
            std::ranges::count_if(cells, [&](const shared::CacheCell& c) { return c.count >= samples; }));
    };
    return {.cells = cells.size(),
            .used = with(1),
            .mature = with(shared::kCacheMature),
            .refused = counts_.read<shared::CacheCounts>().front().refused};
}

void use_radiance_cache(graph::Graph& graph, const SceneView& view, RadianceCache& cache, PathBuffers& paths) {
    paths.points = graph.create_buffer("cache points", {view.band.paths() * sizeof(shared::CachePoint)});
    paths.cells = graph.import_buffer("radiance cache", cache.cells());
}

void add_radiance_cache(graph::Graph& graph, const SceneView& view, RadianceCache& cache,
                        const Continuation& continuation, PathBuffers& paths) {
    const std::uint32_t groups = view.band.paths() / 64;
    Inputs inputs{paths.points, continuation.occluded, continuation.sun_occluded,
                  continuation.sun_occluded ? paths.sun_light : graph::BufferHandle{}};
    {
        graph::Pass pass = graph.add_pass("radiance cache: feed");
        pass.read(paths.states, Access::storage_read);
        inputs.declare(pass);
        inputs.cells = pass.write(paths.cells, Access::storage_read_write);
        inputs.counts =
            pass.write(graph.import_buffer("radiance cache counts", cache.counts()), Access::storage_read_write);
        pass.execute([=, &cache, states = paths.states](graph::Resources& r) {
            inputs.bind(r, states);
            const gpu::Program& program = r.programs().compute("shaders/radiance_cache_feed.comp", inputs.defines());
            program.set("picture", cache.picture());
            program.dispatch(groups);
        });
    }
    graph.output(inputs.counts);
    inputs.counts = {};
    graph::Pass pass = graph.add_pass("radiance cache: gather");
    inputs.declare(pass);
    inputs.cells = pass.write(inputs.cells, Access::storage_read_write);
    paths.states = pass.write(paths.states, Access::storage_read_write);
    pass.execute([=, &cache, states = paths.states](graph::Resources& r) {
        inputs.bind(r, states);
        const gpu::Program& program = r.programs().compute("shaders/radiance_cache_gather.comp", inputs.defines());
        program.set("picture", cache.picture());
        program.dispatch(groups);
    });
    paths.cells = inputs.cells;
    graph.output(paths.cells);
}

}  // namespace halflight
