#include "passes/light/radiance_cache.h"

#include <epoxy/gl.h>

#include <algorithm>

#include "shaders/shared/cache_cells.h"
#include "shaders/shared/path_state.h"

namespace halflight {
namespace {

using graph::Access;

constexpr std::uint32_t kSweepEvery = 64;  // pictures between sweeps
constexpr std::uint32_t kOldest = 192;

/// Inputs of both kernels besides states and cells.
struct Inputs {
    graph::BufferHandle points, occluded, sun_occluded, sun_light;

    void declare(graph::Pass& pass) const {
        pass.read(points, Access::storage_read, "Points");
        if (occluded) pass.read(occluded, Access::storage_read, "Occluded");
        if (!sun_occluded) return;
        pass.read(sun_occluded, Access::storage_read, "SunOccluded");
        pass.read(sun_light, Access::storage_read, "SunLight");
    }
    gpu::Defines defines() const {
        gpu::Defines defines;
        defines.set("HALFLIGHT_RADIANCE_CACHE");
        if (occluded) defines.set("HALFLIGHT_PENDING");
        if (sun_occluded) defines.set("HALFLIGHT_SUN");
        return defines;
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
    const gpu::Program& program = programs.compute("shaders/radiance_cache_age.comp");
    program.bind_storage("Cells", cells_);
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
    const Inputs inputs{paths.points, continuation.occluded, continuation.sun_occluded,
                        continuation.sun_occluded ? paths.sun_light : graph::BufferHandle{}};
    const auto add = [&](const char* name, const char* kernel) {
        graph::Pass pass = graph.add_pass(name);
        inputs.declare(pass);
        paths.cells = pass.write(paths.cells, Access::storage_read_write, "Cells");
        pass.kernel({kernel, inputs.defines()});
        pass.execute([&cache, groups = view.band.paths() / 64](graph::Resources& r) {
            const gpu::Program& program = r.kernel();
            program.set("picture", cache.picture());
            program.dispatch(groups);
        });
        return pass;
    };
    graph::Pass feed = add("radiance cache: feed", "shaders/radiance_cache_feed.comp");
    feed.read(paths.states, Access::storage_read, "States");
    graph.output(
        feed.write(graph.import_buffer("radiance cache counts", cache.counts()), Access::storage_read_write, "Counts"));
    graph::Pass gather = add("radiance cache: gather", "shaders/radiance_cache_gather.comp");
    paths.states = gather.write(paths.states, Access::storage_read_write, "States");
    graph.output(paths.cells);
}

}  // namespace halflight
