// The table of culling methods. The setting "culling", its help and the viewer's menu follow it. A new ray server needs
// a row at the end of the table in culling.cpp, and an enumerator only if other code names it. No OpenGL.
#pragma once

#include <cstdint>
#include <memory>
#include <span>

namespace halflight {
struct TraceTables;
}

namespace halflight::rays {

class BatchServer;
class TraceScene;
struct CullTree;

/// Culling method of a ray tracer (engine/rays/tracer.h): the index of a row of the table. The hits of all methods are
/// equal, bit for bit.
enum class Culling : std::uint8_t {
    automatic,  // fastest method so far, chosen for each batch
    compute,    // per-tile lists made by compute shaders (engine/rays/tiles.h)
    raster,     // occlusion queries of the rasterizer (engine/rays/raster.h)
    off,        // plain traversal of the scene's hierarchy
    native,     // vector code of the processor, if it is the renderer, too (engine/rays/native.h)
};

/// A pose of a scene, as ray servers take it up.
struct ServedScene {
    const TraceTables& tables;
    const TraceScene& trace;
    const CullTree& cull_tree;  // tree for raster culling; empty unless prepared for a method that needs it
    bool measure = false;       // RenderSettings::measure
};

struct CullingMethod {
    const char* name;  // value of the setting
    // Makes the server of all batches, which outlives neither tables nor trace. Throws Error if it cannot serve the
    // scene. Null: Tracer itself serves the batches.
    std::unique_ptr<BatchServer> (*make_server)(const ServedScene& scene) = nullptr;
    bool needs_cull_tree = false;  // whether make_server reads ServedScene::cull_tree
};

/// Returns the methods, in the order of help texts.
std::span<const Culling> culling_methods();
/// Returns the row of a method.
const CullingMethod& row_of(Culling culling);
inline const char* name(Culling culling) {
    return row_of(culling).name;
}

}  // namespace halflight::rays
