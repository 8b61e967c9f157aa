#include "engine/rays/rays.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <atomic>
#include <cassert>
#include <utility>

#include "engine/core/error.h"
#include "engine/core/interruption.h"
#include "engine/graph/execute.h"
#include "engine/rays/batch_server.h"
#include "engine/tables/instance_rows.h"
#include "shaders/shared/bvh_nodes.h"
#include "shaders/shared/ray_structs.h"
#include "shaders/shared/texture_units.h"

namespace halflight::rays {
namespace {

using graph::Access;

std::uint32_t next_serial() {
    static std::atomic<std::uint32_t> last{0};
    return ++last;
}

graph::BufferHandle trace(graph::Graph& graph, const TraceScene& scene, const RayBatch& batch,
                          graph::BufferHandle results, bool any_hit) {
    graph::Pass pass =
        graph.add_pass(fmt::format("{} rays: {}", name(batch.kind), any_hit ? "any hit" : "closest hit"));
    read_batch(pass, scene, batch);
    results = write_results(pass, batch, results);
    pass.kernel(plain_kernel(scene, batch, any_hit, static_cast<bool>(batch.list)));
    pass.execute([=, &scene](graph::Resources& r) { trace_plain(r, scene, batch, results, any_hit); });
    return results;
}

}  // namespace

void check_groups(std::uint32_t groups, std::uint32_t rays) {
    GLint limit = 0;
    glGetIntegeri_v(GL_MAX_COMPUTE_WORK_GROUP_COUNT, 0, &limit);
    if (groups > static_cast<std::uint32_t>(limit)) {
        throw Error("rays", "a batch of {} rays takes {} work groups; the driver starts at most {}", rays, groups,
                    limit);
    }
}

TraceScene::TraceScene(const TraceTables& tables, const gpu::Defines& shading)
    : TraceScene(tables, pack_scene(tables), shading) {}

TraceScene::TraceScene(const gpu::Buffer* instances)
    : nodes_("hierarchy nodes", 0),
      triangles_("hierarchy triangles", 0),
      heads_("heads of instances' blocks", 0),
      own_instances_("block instances", 0),
      shared_instances_(instances),
      triangle_ids_("ids of resident triangles", 0) {}

TraceScene::TraceScene(const SceneNeeds& needs, bool two_level)
    : alpha_tested_(needs.alpha),
      one_sided_(needs.one_sided),
      nodes_("", 0, gpu::Buffer::Unmade{}),
      triangles_("", 0, gpu::Buffer::Unmade{}),
      heads_("", 0, gpu::Buffer::Unmade{}),
      own_instances_("", 0, gpu::Buffer::Unmade{}),
      shared_instances_(nullptr),
      triangle_ids_("", 0, gpu::Buffer::Unmade{}) {
    statistics_.two_level = two_level;
    if (needs.panes) panes_ = std::make_unique<TraceScene>(SceneNeeds(), two_level);
}

TraceScene::TraceScene(const TraceTables& tables, const PackedScene& packed, const gpu::Defines& shading,
                       const gpu::Buffer* instances)
    : TraceScene(instances) {
    update(tables, packed, shading, nullptr);
}

TraceScene::TraceScene(const TraceTables& tables, PackedScene&& packed, const gpu::Defines& shading,
                       const gpu::Buffer* instances)
    : TraceScene(instances) {
    gpu::replace(triangles_, std::exchange(packed.pairs, {}));
    gpu::replace(nodes_, std::exchange(packed.nodes, {}));
    finish_update(tables, packed, shading);
}

TraceScene::TraceScene(const PagedLayout& layout) : TraceScene(nullptr) {
    nodes_ = gpu::Buffer(nodes_.name(), layout.texels * sizeof(uvec4));
    update(layout);
}

void TraceScene::update(const PagedLayout& layout) {
    top_ = layout.top, slot_texels_ = layout.slot_texels, slot_rows_ = layout.slot_rows;
    TraceTables tables;
    tables.instances.push_back({.identity = true});
    tables.slivers = layout.slivers;
    tables.alpha_tested = layout.alpha_tested;
    tables.one_sided = layout.one_sided;
    PackedScene packed;
    packed.format = NodeFormat::page;
    packed.stack_entries = layout.stack_entries;
    packed.instance_head = {0};
    finish_update(tables, packed, layout.shading);
    statistics_.triangles = layout.triangles;
}

void TraceScene::update(const TraceTables& tables, const PackedScene& packed, const gpu::Defines& shading,
                        const PackedScene* last) {
    gpu::replace(nodes_, packed.nodes, last ? &last->nodes : nullptr);
    gpu::replace(triangles_, packed.pairs, last ? &last->pairs : nullptr);
    finish_update(tables, packed, shading);
}

void TraceScene::finish_update(const TraceTables& tables, const PackedScene& packed, const gpu::Defines& shading) {
    serial_ = next_serial();
    alpha_tested_ = tables.alpha_tested;
    one_sided_ = tables.one_sided;
    paged_ = packed.format == NodeFormat::page;
    gpu::replace(heads_, packed.instance_head);
    if (shared_instances_ == nullptr) gpu::replace(own_instances_, instance_rows(tables));
    slivers_ = tables.slivers;
    statistics_ = {.triangles = tables.triangles.size(),
                   .instances = tables.instances.size(),
                   .nodes = packed.node_count,
                   .node_format = packed.format,
                   .two_level = packed.two_level,
                   // The stack never shrinks, because all poses of a scene use the same programs.
                   .stack_entries = std::max(statistics_.stack_entries, packed.stack_entries),
                   .bytes = nodes_.bytes() + triangles_.bytes() + heads_.bytes() + own_instances_.bytes(),
                   .build_seconds = packed.build_seconds};
    if (!paged_) update_panes(tables, packed.panes.get(), shading);
    set_shading(shading);
    bind();  // bind() reports tables beyond the driver's limits
}

void TraceScene::update_panes(const TraceTables& tables, const PackedScene* packed, const gpu::Defines& shading) {
    if (!packed) {
        panes_ = nullptr;
        return;
    }
    if (!panes_) panes_ = std::unique_ptr<TraceScene>(new TraceScene(&instances()));
    if (tables.absent) gpu::replace(panes_->triangle_ids_, tables.absent->resident);
    panes_->update(tables, *packed, shading, nullptr);
}

void TraceScene::set_shading(const gpu::Defines& shading) {
    if (panes_) panes_->set_shading(shading);
    defines_ = {};
    if (alpha_tested_) {
        defines_ = shading;
        const auto& values = shading.values();
        if (std::none_of(values.begin(), values.end(), [](const auto& d) { return d.first == "HALFLIGHT_ALPHA"; })) {
            throw Error("rays", "alpha-tested triangles, but no shading defines to read their coverage by");
        }
    }
    // Scenes whose trees differ a little in depth share their programs. Entries that are not used cost next to nothing.
    constexpr std::uint32_t kStackStep = 8;
    defines_.set("HALFLIGHT_STACK", (statistics_.stack_entries + kStackStep - 1) / kStackStep * kStackStep);
    if (slivers_) defines_.set("HALFLIGHT_SLIVERS");
    if (triangle_ids_.bytes() > 0) defines_.set("HALFLIGHT_TRIANGLE_IDS");
    if (statistics_.two_level) defines_.set("HALFLIGHT_TWO_LEVEL");
    if (statistics_.node_format == NodeFormat::floating) defines_.set("HALFLIGHT_NODES_FLOAT");
    if (statistics_.node_format != NodeFormat::page) return;
    defines_.set("HALFLIGHT_NODES_PAGE");
    defines_.set("HALFLIGHT_SLOT_TEXELS", slot_texels_);
    if (slot_rows_ > 0) defines_.set("HALFLIGHT_SLOT_ROWS", slot_rows_);
}

void TraceScene::bind() const {
    nodes_.bind_texture(shared::kUnitNodes, GL_RGBA32UI);
    if (statistics_.node_format == NodeFormat::page)
        nodes_.bind_texture(shared::kUnitTriangleVertices, GL_RGB32F);
    else
        triangles_.bind_texture(shared::kUnitTriangleVertices, GL_RGBA32F);
    heads_.bind_texture(shared::kUnitBlockHeads, GL_R32UI);
    instances().bind_texture(shared::kUnitInstances, GL_RGBA32F);
}

void read_batch(graph::Pass& pass, const TraceScene& scene, const RayBatch& batch, Access rays) {
    pass.read(batch.rays, rays);
    if (scene.alpha_tested()) {
        pass.read(batch.frame_constants, Access::uniform_read);
        if (batch.sampled_blocks) pass.read(batch.sampled_blocks, Access::texture_read);
    }
    if (batch.list) {
        pass.read(batch.list, Access::storage_read);
        pass.read(batch.list_header, Access::storage_read);
        pass.read(batch.list_header, Access::indirect_read);
    }
}

gpu::Defines batch_defines(const TraceScene& scene, const RayBatch& batch) {
    gpu::Defines defines = scene.defines();
    if (scene.alpha_tested() && batch.sampled_blocks) defines.set("HALFLIGHT_SAMPLED_BLOCKS");
    if (scene.one_sided() && batch.backfaces != PassBacks::none)
        defines.set("HALFLIGHT_BACKFACES", static_cast<int>(batch.backfaces));
    if (batch.passes_panes) defines.set("HALFLIGHT_PASS_PANES");
    return defines;
}

graph::BufferHandle write_results(graph::Pass& pass, const RayBatch& batch, graph::BufferHandle results) {
    const bool keeps = batch.list && results.version != 0;
    return pass.write(results, keeps ? Access::storage_read_write : Access::storage_write);
}

void bind_batch(graph::Resources& r, const gpu::Program& program, const TraceScene& scene, const RayBatch& batch) {
    scene.bind();
    program.bind_texture("rays", r.buffer(batch.rays), GL_RGBA32F);
    if (batch.list) {
        program.bind_storage("List", r.buffer(batch.list));
        program.bind_storage("Header", r.buffer(batch.list_header));
    }
    assert(!batch.list || batch.rays_of_path == 1);
    if (!scene.alpha_tested()) return;
    program.bind_uniform("FrameBlock", r.buffer(batch.frame_constants));
    if (batch.sampled_blocks) program.bind_texture("sampled_blocks", r.buffer(batch.sampled_blocks), GL_RGBA32UI);
    program.set("alpha_salt", batch.alpha_salt);
    program.set("rays_of_path", batch.rays_of_path);
    program.set("paths", batch.paths > 0 ? batch.paths : std::max(batch.capacity, 1u));
}

graph::BufferHandle closest_hit(graph::Graph& graph, const TraceScene& scene, const RayBatch& batch,
                                graph::BufferHandle hits) {
    return trace(graph, scene, batch, hits, false);
}

graph::BufferHandle any_hit(graph::Graph& graph, const TraceScene& scene, const RayBatch& batch,
                            graph::BufferHandle occluded) {
    return trace(graph, scene, batch, occluded, true);
}

graph::Kernel plain_kernel(const TraceScene& scene, const RayBatch& batch, bool any_hit, bool listed) {
    gpu::Defines defines = batch_defines(scene, batch);
    if (any_hit) defines.set("HALFLIGHT_ANY_HIT");
    if (listed) defines.set("HALFLIGHT_LIST");
    if (batch.catchers_only) defines.set("HALFLIGHT_CATCHERS_ONLY");
    return {"shaders/trace.comp", defines, [&scene, batch, listed](graph::Resources& r, const gpu::Program& program) {
                RayBatch bound = batch;
                if (!listed) bound.list = bound.list_header = {};
                bind_batch(r, program, scene, bound);
            }};
}

void trace_plain(graph::Resources& r, const TraceScene& scene, const RayBatch& batch, graph::BufferHandle results,
                 bool any_hit) {
    interruption_point();
    check_groups((batch.capacity + 63) / 64, batch.capacity);
    const graph::Kernel kernel = plain_kernel(scene, batch, any_hit, static_cast<bool>(batch.list));
    const gpu::Program& program = r.programs().compute(kernel.source, kernel.defines);
    kernel.bind(r, program);
    program.bind_storage(any_hit ? "Occluded" : "Hits", r.buffer(results));
    if (batch.list) {
        program.dispatch_indirect(r.buffer(batch.list_header), (batch.capacity + 63) / 64);
    } else {
        program.dispatch((batch.capacity + 63) / 64);
    }
}

}  // namespace halflight::rays
