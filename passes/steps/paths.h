// Paths behind the first surface: their buffers, lists and batches of rays.
#pragma once

#include <string>

#include "engine/device/scene_view.h"

namespace halflight {

/// Rays and states of all paths, at the path's index. The batches share one set, since each path is in one batch.
struct PathBuffers {
    graph::BufferHandle rays;    // one Ray per path
    graph::BufferHandle hits;    // one Hit per path
    graph::BufferHandle states;  // one PathState per path
    // Receiver: origin of the ray, for the density of light sampling there; empty if it is the same everywhere
    graph::BufferHandle receivers;
    graph::BufferHandle met_lamps;  // one MetLamp per path; empty without lights with a size
    graph::BufferHandle cones;      // vec2 (RayCone of shaders/lib/ray_cone.glsl) per path; empty without mip levels
    graph::BufferHandle media;      // vec4 (Bsdf's medium) per path; empty unless a material is solid
    // ReusePoint, or CachePoint with `cells`: second vertices of the paths; empty without path reuse and cache
    graph::BufferHandle points;
    // vec4 (rgb, 0): radiance of the last sun sample, if the sun is visible. With `points` there are two entries per
    // path, which belong to the `pending` of PathState and of the point. Empty unless the sun is sampled separately
    graph::BufferHandle sun_light;
    graph::BufferHandle cells;        // CacheCell: radiance cache; empty without one
    graph::BufferHandle group_light;  // rows of shaders/lib/group_rows.glsl; empty without light groups
};

/// The paths of one batch.
struct PathList {
    graph::BufferHandle list;    // path indices, uint, tile by tile
    graph::BufferHandle header;  // one ListHeader
};

/// Returns the bytes per path of PathBuffers::group_light. reuse: paths have points for path reuse.
constexpr std::size_t group_light_bytes(std::size_t groups, bool reuse) {
    return (1 + (reuse ? 2 : 1) * groups) * sizeof(vec4);
}
/// Creates the buffers without `points`, `sun_light`, `cells` and `group_light`.
PathBuffers create_path_buffers(graph::Graph& graph, const SceneView& view);
/// Creates an empty list with room for `capacity` entries; 0: for every path.
PathList create_path_list(graph::Graph& graph, const SceneView& view, const std::string& name,
                          std::size_t capacity = 0);

/// Declares that a pass reads a list of paths with their rays and hits.
void read_listed(graph::Pass& pass, const PathList& list, const PathBuffers& paths);
/// Returns the batch of the rays of a list that leave path vertex number `depth` (0: the first surface).
rays::RayBatch ray_batch(const SceneView& view, rays::RayKind kind, graph::BufferHandle rays, const PathList& list,
                         int depth);

/// Returns the access by which a pass writes its part of a buffer that several passes fill: the first pass need not
/// keep old content.
template <class H>
graph::Access partial_write(const H& handle) {
    return handle.version == 0 ? graph::Access::storage_write : graph::Access::storage_read_write;
}

/// Returns the batch of the shadow rays at the first surface, in the order of DirectLightEstimate::light
/// (light_answers.h). kind: shadow for chosen lights, or sun.
rays::RayBatch shadow_batch(const SceneView& view, rays::RayKind kind, graph::BufferHandle rays);

}  // namespace halflight
