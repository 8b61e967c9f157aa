// What the passes that send rays on from the first surface share.
#pragma once

#include <string>

#include "passes/surface/gbuffer.h"

namespace halflight {

/// Rays on their way and the state of their paths; one set of buffers for all batches, each path being in one of them.
struct PathBuffers {
    graph::BufferHandle rays;    // Ray
    graph::BufferHandle hits;    // Hit
    graph::BufferHandle states;  // PathState
    // Receiver: where the rays come from, for the density with which lights are picked there; none without a light tree
    graph::BufferHandle receivers;
    // ReusePoint, or CachePoint where there are `cells`: the paths' second vertices; none without path reuse or cache
    graph::BufferHandle points;
    // vec4 rgb, 0: radiance of the last sample of the sun, if it is visible; with `points` in two parts as PathState's
    // and their own `pending` are. Valid where these are; none without a sun apart
    graph::BufferHandle sun_light;
    graph::BufferHandle cells;  // CacheCell: of the radiance cache that the paths use; or none
};

/// The paths of one batch.
struct PathList {
    graph::BufferHandle list;    // uint path indices, tile by tile
    graph::BufferHandle header;  // ListHeader
};

PathBuffers create_path_buffers(graph::Graph& graph, const SceneView& view);
/// An empty list with room for every path.
PathList create_path_list(graph::Graph& graph, const SceneView& view, const std::string& name);

/// The rays of a list, sent from the path vertex number `depth` (0: the surface seen by the camera).
rays::RayBatch ray_batch(const SceneView& view, rays::RayKind kind, graph::BufferHandle rays, const PathList& list,
                         int depth);

/// How a pass writes its part of a buffer that several passes fill: the first one need not keep what was there.
template <class H>
graph::Access partial_write(const H& handle) {
    return handle.version == 0 ? graph::Access::storage_write : graph::Access::storage_read_write;
}

/// A component of the first surface's BSDF as a pass.
struct FirstScatter {
    const char* name;
    const char* kernel;
    rays::RayKind kind;
};
/// Samples the component where it was picked (one of all components is, at random), and traces the rays. Updates
/// `paths`; the first such pass of a frame also sets up the states of paths that end here.
PathList add_first_scatter(graph::Graph& graph, const SceneView& view, const GBuffer& gbuffer, const FirstScatter& what,
                           PathBuffers& paths);

}  // namespace halflight
