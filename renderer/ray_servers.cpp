#include "renderer/ray_servers.h"

#include "engine/core/error.h"
#include "engine/rays/raster.h"
#include "renderer/render_result.h"

namespace halflight {
namespace {

rays::ServedScene served(const RayServers& servers) {
    const PreparedScene& scene = servers.scene;
    return {scene.tables(), scene.trace(), scene.cull_tree(), servers.measure};
}

}  // namespace

RayServers::RayServers(PreparedScene& of, RenderSettings& settings, rays::BatchServer* callers)
    : scene(of), measure(settings.measure), given(callers) {
    if (paging::PagePool* const pool = scene.pool()) {
        if (given)
            throw Error("render settings", "ray servers of callers cannot trace scenes that are loaded in pages");
        using Method = paging::PageQueries::Method;
        pages = std::make_unique<paging::PageServer>(
            *pool, settings.page_schedule,
            settings.culling == rays::Culling::raster ? Method::raster : Method::compute);
        rows = std::make_unique<paging::RowGather>(pool->source());
        settings.culling = rays::Culling::off;
        if (settings.primary == PrimaryVisibility::raster)
            throw Error("render settings", "primary raster needs the scene in memory; pages are traced");
        settings.primary = PrimaryVisibility::traced;
    } else if (const auto make = row_of(settings.culling).make_server; make && !given) {
        own = make(served(*this));
    }
    if (server())
        tracer.emplace(scene.trace(), *server());
    else
        tracer.emplace(scene.trace(), settings.culling);
    if (settings.culling != rays::Culling::automatic || server()) return;
    offered = rays::offered_native_server(served(*this));
    if (offered) tracer->offer(*offered);
}

void RayServers::follow() {
    if (server()) server()->follow(served(*this));
    if (offered) offered->follow(served(*this));
}

void RayServers::reset_statistics() {
    tracer->reset_statistics();
    if (rows) rows->reset_statistics();
}

void RayServers::fill_stats(RenderStats& stats) const {
    stats.batches = tracer->statistics();
    stats.tracing_note = tracer->note();
    if (const auto* raster = dynamic_cast<const rays::RasterCulling*>(server())) stats.raster = raster->batches();
    if (pages) stats.paging = {pages->statistics(), rows->rows(), rows->seconds()};
}

}  // namespace halflight
