// The ray servers of a renderer, and the tracer that asks them.
#pragma once

#include <memory>
#include <optional>

#include "engine/device/prepared_scene.h"
#include "engine/paging/page_server.h"
#include "engine/paging/row_gather.h"
#include "engine/rays/native.h"
#include "engine/rays/tracer.h"
#include "engine/settings/render_settings.h"

namespace halflight {

struct RenderStats;

/// Owns the servers that the culling method and the scene call for. It stays where it is, as the tracer refers to them.
struct RayServers {
    PreparedScene& scene;
    const bool measure;                           // RenderSettings::measure
    rays::BatchServer* const given;               // server of the caller; null: none
    std::unique_ptr<rays::BatchServer> own;       // server of the culling method; null: none
    std::unique_ptr<rays::NativeServer> offered;  // candidate of Culling::automatic; null: none
    std::unique_ptr<paging::PageServer> pages;    // server of scenes that are loaded in pages; else null
    std::unique_ptr<paging::RowGather> rows;      // table rows of such scenes; else null
    std::optional<rays::Tracer> tracer;

    /// Resolves the culling method of the settings, and the primary visibility of scenes that are loaded in pages.
    RayServers(PreparedScene& of, RenderSettings& settings, rays::BatchServer* callers);
    RayServers(const RayServers&) = delete;
    RayServers& operator=(const RayServers&) = delete;

    /// Returns the server in use; null if the tracer serves all batches.
    rays::BatchServer* server() const { return given ? given : own ? own.get() : pages.get(); }
    /// Takes up another pose of the scene.
    void follow();
    void reset_statistics();
    void fill_stats(RenderStats& stats) const;
};

}  // namespace halflight
