// Ray batches and the scene that they are traced in. Passes fill a batch and request hits; any tracer may answer.
#pragma once

#include <compare>
#include <cstdint>
#include <memory>

#include "engine/gpu/buffer.h"
#include "engine/gpu/shader_source.h"
#include "engine/graph/graph.h"
#include "engine/rays/kinds.h"
#include "engine/rays/packed_bvh.h"
#include "engine/tables/needs.h"
#include "engine/tables/tables.h"
#include "shaders/shared/ray_structs.h"

namespace halflight::rays {

/// Rays of a batch that pass back faces of one-sided triangles (values of HALFLIGHT_BACKFACES).
enum class PassBacks : std::uint8_t {
    none,
    marked = shared::kMarkedRays,  // rays with t_min > 0
    all = shared::kEveryRay,
};

/// A set of rays to be traced together. Rays and hits (structs Ray and Hit of shaders/shared/ray_structs.h) lie at the
/// index of their path, `capacity` of each. `paths` and `rays_of_path` place the rays of paths that have several.
///
/// The first `count` entries of `list`, path indices in tile order, are traced if a list is given. 64 consecutive
/// entries are one 8x8 tile, or the remains of several. Without a list all rays are traced. A ray with t_max < t_min is
/// dead: it is not traced and reports a miss.
struct RayBatch {
    RayKind kind = RayKind::primary;
    // Number of earlier reflections; for camera rays, number of the batch. Kind and depth identify a batch of a graph.
    std::uint32_t depth = 0;
    std::uint32_t place = 0;     // part of the picture; state carried between runs is separate for each place
    std::uint32_t capacity = 0;  // number of rays, a multiple of 256
    // Period of the paths: ray i belongs to path i % paths. 0: each path has `rays_of_path` consecutive rays, a power
    // of two, at most 16; 1 with a list.
    std::uint32_t paths = 0;
    std::uint32_t rays_of_path = 1;
    graph::BufferHandle rays;         // `capacity` Ray structs
    graph::BufferHandle list;         // `capacity` path indices, uint; optional
    graph::BufferHandle list_header;  // ListHeader of shaders/shared/ray_structs.h, if there is a list
    // Random numbers of the alpha test of blended surfaces, read only if TraceTables::alpha_tested is set
    // (shaders/lib/alpha_sampler.glsl). They depend on struct Frame (shaders/shared/frame_block.h) and a salt. The frame's
    // seed and sample_index change from run to run; the salt differs between the batches of one run.
    graph::BufferHandle frame_constants;
    graph::BufferHandle sampled_blocks{};  // buffer of SampledBlock, which places the paths; null: one per pixel
    std::uint32_t alpha_salt = 0;
    // Rays pass through all surfaces but shadow catchers. Only for any_hit() of a TraceScene whose geometry is in
    // memory; the table of triangles must be bound when the graph runs.
    bool catchers_only = false;
    PassBacks backfaces = PassBacks::none;  // rays that pass back faces
    bool passes_panes = false;              // rays pass panes (kTrianglePane; SHADING.md, Panes)
};

/// Identity of similar batches across runs. State that one of them leaves speeds up the next.
struct BatchKey {
    RayKind kind = RayKind::primary;
    std::uint32_t depth = 0;
    std::uint32_t place = 0;
    auto operator<=>(const BatchKey&) const = default;
};
inline BatchKey key_of(const RayBatch& batch) {
    return {batch.kind, batch.depth, batch.place};
}

struct TraceStatistics {
    std::size_t triangles = 0;
    std::size_t instances = 0;
    std::size_t nodes = 0;  // four-wide nodes of all hierarchies
    NodeFormat node_format = NodeFormat::grid;
    bool two_level = false;
    std::uint32_t stack_entries = 0;  // stack size of the deepest traversal, entries
    std::size_t bytes = 0;            // size in device memory, bytes
    double build_seconds = 0;
};

/// A scene whose hierarchy is loaded in pages (engine/paging/page_pool.h). All triangles are in one space.
struct PagedLayout {
    std::size_t triangles = 0;
    std::size_t texels = 0;           // room in the buffer of nodes, pairs and vertices
    std::uint32_t top = 0;            // texel of the hierarchy over all pages in it
    std::size_t slot_texels = 0;      // room of a page in it
    std::size_t slot_rows = 0;        // alpha-tested triangles of a page
    std::uint32_t stack_entries = 1;  // maximum stack of a traversal, entries
    bool slivers = false;
    bool alpha_tested = false;
    bool one_sided = false;
    gpu::Defines shading;  // SceneBuffers::defines(), needed with alpha tests
};

/// Hierarchies and triangles of one scene on the device.
class TraceScene {
  public:
    /// Builds one BVH4 per block with Embree's builder and, unless all triangles are in world space, one over the
    /// instances. `shading` is SceneBuffers::defines(); needed if tables.alpha_tested is set, since kernels then read
    /// coverage (shaders/lib/alpha.glsl). The texture units of the scene must then be bound whenever a graph runs.
    /// Throws Error if a table exceeds what the driver can address.
    explicit TraceScene(const TraceTables& tables, const gpu::Defines& shading = {});
    /// Uploads `packed`, the result of pack_scene() for the tables. `instances` is instance_rows() of the tables on the
    /// device (SceneBuffers::instance_rows()), updated with this object and outliving it. If it is null, the object
    /// makes its own table.
    TraceScene(const TraceTables& tables, const PackedScene& packed, const gpu::Defines& shading,
               const gpu::Buffer* instances = nullptr);
    /// Does the same, and frees each table of `packed` as soon as it is uploaded, because large scenes need the memory.
    TraceScene(const TraceTables& tables, PackedScene&& packed, const gpu::Defines& shading,
               const gpu::Buffer* instances = nullptr);

    TraceScene(const TraceScene&) = delete;
    TraceScene& operator=(const TraceScene&) = delete;

    /// Describes a scene with these needs, for graphs that are compiled and never run. Needs no context. two_level:
    /// TraceStatistics::two_level.
    TraceScene(const SceneNeeds& needs, bool two_level);

    /// Makes empty buffers for a scene that is loaded in pages. Throws Error like the first constructor.
    explicit TraceScene(const PagedLayout& layout);
    /// Changes to another pose of a scene that is loaded in pages. The buffers keep their sizes and contents.
    void update(const PagedLayout& layout);

    /// Updates the scene to another pose. `last` is the packed scene that the buffers hold, or null; if it is given,
    /// only differences are written. Throws Error like the constructor. After a failed update the object may only be
    /// destroyed.
    void update(const TraceTables& tables, const PackedScene& packed, const gpu::Defines& shading,
                const PackedScene* last);

    /// Makes panes() of packed hierarchies over the panes of the tables; null: there are none.
    void update_panes(const TraceTables& tables, const PackedScene* packed, const gpu::Defines& shading);
    /// Sets other shading defines; defines() follow.
    void set_shading(const gpu::Defines& shading);

    gpu::Buffer& nodes() { return nodes_; }  ///< Returns the buffer of nodes, which pages are written to.
    const gpu::Buffer& nodes() const { return nodes_; }
    /// Returns the buffer of pairs of triangles (shaders/shared/bvh_nodes.h), which is empty in scenes that are loaded
    /// in pages.
    const gpu::Buffer& pairs() const { return triangles_; }
    /// Returns the buffer of node indices of the heads of the instances' blocks.
    const gpu::Buffer& heads() const { return heads_; }
    bool slivers() const { return slivers_; }  ///< Returns whether kernels test triangles in double.

    /// Binds kUnitNodes, kUnitTriangleVertices, kUnitBlockHeads and kUnitInstances.
    void bind() const;
    /// Returns the defines that select the variant of shaders/trace_scene.glsl and shaders/lib/traverse.glsl.
    const gpu::Defines& defines() const { return defines_; }
    bool paged() const { return paged_; }       ///< Returns whether the hierarchy is loaded in pages.
    std::uint32_t top() const { return top_; }  ///< Returns PagedLayout::top, the uniform `top` of kernels.
    /// Returns whether hits depend on coverage, and thus on RayBatch::frame_constants and the scene's texture units.
    bool alpha_tested() const { return alpha_tested_; }
    bool one_sided() const { return one_sided_; }  ///< Returns whether some triangle is seen from its front only.
    /// Returns the hierarchies over the panes alone, whose hits have the triangles and instances of this scene. Returns
    /// null without panes.
    const TraceScene* panes() const { return panes_.get(); }
    /// Returns the ids of the tables' triangles (R32UI) if geometry is not in memory; else empty.
    const gpu::Buffer& triangle_ids() const { return triangle_ids_; }
    const TraceStatistics& statistics() const { return statistics_; }
    /// Returns a serial number, unique per scene and pose within the process. Caches made for one serial must not be
    /// used with another.
    std::uint32_t serial() const { return serial_; }

  private:
    explicit TraceScene(const gpu::Buffer* instances);
    const gpu::Buffer& instances() const { return shared_instances_ != nullptr ? *shared_instances_ : own_instances_; }
    /// Sets the members that do not depend on nodes and pairs.
    void finish_update(const TraceTables& tables, const PackedScene& packed, const gpu::Defines& shading);

    std::uint32_t serial_ = 0;
    bool alpha_tested_ = false;
    bool one_sided_ = false;
    bool paged_ = false;
    bool slivers_ = false;
    std::uint32_t top_ = 0;  // fields of PagedLayout
    std::size_t slot_texels_ = 0, slot_rows_ = 0;
    TraceStatistics statistics_;
    gpu::Defines defines_;
    gpu::Buffer nodes_;
    gpu::Buffer triangles_;      // empty in scenes that are loaded in pages
    gpu::Buffer heads_;          // per instance: node index of its block's head
    gpu::Buffer own_instances_;  // instance rows; empty if they are shared
    const gpu::Buffer* shared_instances_;
    std::unique_ptr<TraceScene> panes_;
    gpu::Buffer triangle_ids_;
};

/// Adds the passes that find the closest hit of each ray of the batch, and returns the hits: one Hit per path. With a
/// list, other paths keep their hits. The closest hit lies in the open interval (t_min, t_max), on either side of a
/// triangle but for RayBatch::backfaces; among equal t the lower (instance, triangle) wins. A miss has triangle kMiss
/// and t +inf; a search that the driver cut short has t NaN. Runs throw Error if the driver cannot start so many rays.
graph::BufferHandle closest_hit(graph::Graph& graph, const TraceScene& scene, const RayBatch& batch,
                                graph::BufferHandle hits);

/// Adds the passes that test for each ray of the batch whether a surface lies in (t_min, t_max). Returns one uint per
/// path: kFree, kOccluded, or kUnfinished if the driver cut the search short (shaders/shared/ray_structs.h).
graph::BufferHandle any_hit(graph::Graph& graph, const TraceScene& scene, const RayBatch& batch,
                            graph::BufferHandle occluded);

/// Throws Error naming `rays` if the driver does not start this number of work groups at once.
void check_groups(std::uint32_t groups, std::uint32_t rays);
/// Returns the plain kernel of a batch. `listed`: the kernel reads path indices from a list, which the batch may lack.
graph::Kernel plain_kernel(const TraceScene& scene, const RayBatch& batch, bool any_hit, bool listed);
/// Traces a batch in a pass that has declared the batch (read_batch()) and the results (write_results()).
void trace_plain(graph::Resources& resources, const TraceScene& scene, const RayBatch& batch,
                 graph::BufferHandle results, bool any_hit);

}  // namespace halflight::rays
