#include "engine/rays/raster.h"

#include <epoxy/gl.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <utility>

#include "engine/core/error.h"
#include "engine/core/interruption.h"
#include "engine/core/stopwatch.h"
#include "engine/gpu/context.h"
#include "engine/graph/execute.h"
#include "engine/rays/raster_layout.h"
#include "shaders/shared/raster_lists.h"
#include "shaders/shared/ray_structs.h"
#include "shaders/shared/word.h"

namespace halflight::rays {
namespace {

using graph::Access;

void delete_query(GLuint id) {
    glDeleteQueries(1, &id);
}
using Query = gpu::Object<delete_query>;

constexpr std::size_t kWideTile = 10;  // survey nodes that a tile may meet and still be culled

/// Returns the texels of `boxes` (shaders/shared/raster_lists.h).
std::vector<vec4> box_rows(const CullTree& tree) {
    std::vector<vec4> rows;
    for (const CullNode& n : tree.nodes) {
        rows.emplace_back(n.box.lower, shared::float_of_word(n.node));
        rows.emplace_back(n.box.upper, shared::float_of_word(n.slots));
    }
    return rows;
}

float greatest_coordinate(const Bounds& box) {
    const vec3 v = glm::max(glm::abs(box.lower), glm::abs(box.upper));
    return box.empty() ? 0.0f : std::max({v.x, v.y, v.z});
}

}  // namespace

/// State of similar batches.
struct RasterMemory {
    CullState state;
    std::optional<gpu::Buffer> starts;  // block shafts of the previous run, which are complete
};

struct Survey;

struct RasterCulling::Parts {
    void run(RasterCulling& culling, graph::Resources& r, const TraceScene& scene, const RayBatch& batch,
             const RasterTargets& targets, bool any_hit, Survey* survey = nullptr);

    RasterSettings settings;
    CullTree tree;
    gpu::Buffer boxes;
    std::map<BatchKey, RasterMemory> memories;
    std::map<BatchKey, RasterStatistics> statistics;  // sums over all places, keyed by place 0
    std::vector<Query> queries;                       // occlusion queries, reused by every run
    gpu::Object<gpu::delete_vertex_array> no_attributes;
};

RasterCulling::RasterCulling(const PackedScene& packed, const RasterSettings& settings)
    : RasterCulling(build_cull_tree(packed, settings.cut), settings) {}

RasterCulling::RasterCulling(CullTree tree, const RasterSettings& settings) {
    gpu::Buffer boxes = gpu::Buffer::from("culling boxes", box_rows(tree));
    GLuint id = 0;
    glCreateVertexArrays(1, &id);
    gpu::label(GL_VERTEX_ARRAY, id, "culling");
    parts_ = std::make_unique<Parts>(
        Parts{settings, std::move(tree), std::move(boxes), {}, {}, {}, gpu::Object<gpu::delete_vertex_array>(id)});
}
RasterCulling::~RasterCulling() = default;

std::unique_ptr<BatchServer> make_raster_server(const ServedScene& scene) {
    if (scene.cull_tree.nodes.empty() && !scene.tables.triangles.empty())
        throw Error("render settings", "raster culling of a scene that was prepared without it");
    RasterSettings settings;
    settings.measure = scene.measure;
    return std::make_unique<RasterCulling>(scene.cull_tree, settings);
}

void RasterCulling::set_tree(CullTree tree) {
    parts_->boxes = gpu::Buffer::from("culling boxes", box_rows(tree));
    parts_->tree = std::move(tree);
}

const RasterSettings& RasterCulling::settings() const {
    return parts_->settings;
}
const CullTree& RasterCulling::tree() const {
    return parts_->tree;
}
CullState& RasterCulling::state(const BatchKey& key) {
    return parts_->memories[key].state;
}
RasterStatistics& RasterCulling::statistics(RayKind kind, std::uint32_t depth) {
    return parts_->statistics[{kind, depth}];
}

std::vector<RasterBatch> RasterCulling::batches() const {
    std::vector<RasterBatch> all;
    for (const auto& [key, statistics] : parts_->statistics) all.push_back({key.kind, key.depth, statistics});
    return all;
}

std::size_t RasterCulling::state_bytes(const RayBatch&) const {
    return parts_->tree.nodes.size() * sizeof(CullMemory);
}

void RasterCulling::reset_statistics() {
    parts_->statistics.clear();
}

void RasterCulling::invalidate() {
    parts_->memories.clear();
}

std::size_t RasterCulling::bytes() const {
    const CullTree& tree = parts_->tree;
    std::size_t sum = parts_->boxes.bytes() + tree.nodes.size() * sizeof(CullNode);
    for (const auto& [key, memory] : parts_->memories) {
        sum += memory.state.nodes.size() * sizeof(CullMemory);
        if (memory.starts) sum += memory.starts->bytes();
    }
    return sum;
}

/// Returns the mean ray origin over the shafts of blocks.
vec3 eye_of(const std::vector<vec4>& shafts) {
    vec3 sum(0);
    float count = 0;
    for (std::size_t i = 0; i < shafts.size(); i += 4) {
        const vec3 lower(shafts[i]), upper(shafts[i + 1]);
        if (lower.x > upper.x) continue;
        sum += 0.5f * (lower + upper);
        count += 1;
    }
    return count == 0 ? sum : sum / count;
}

/// A run that only collects the leaves which rays can meet.
struct Survey {
    const gpu::Buffer* ends = nullptr;
    std::vector<std::uint32_t> leaves{};
};

/// One run of one batch.
class RasterRun final : public CullDevice {
  public:
    RasterRun(graph::Resources& r, const TraceScene& scene, RasterCulling& culling, const RayBatch& batch,
              const RasterTargets& targets, bool any_hit, Survey* survey = nullptr)
        : parts_(*culling.parts_),
          statistics_(culling.statistics(batch.kind, batch.depth)),
          layout_(batch.capacity),
          resources_(r),
          scene_(scene),
          batch_(batch),
          targets_(targets),
          any_hit_(any_hit),
          survey_(survey) {
        gpu::Defines defines = batch_defines(scene, batch);
        if (any_hit) defines.set("HALFLIGHT_ANY_HIT");
        if (batch.list) defines.set("HALFLIGHT_LIST");
        gpu::ProgramCache& cache = r.programs();
        gpu::Defines of_bounds = defines;
        if (survey && survey->ends) of_bounds.set("HALFLIGHT_ENDS");
        bounds_ = &cache.graphics("shaders/raster_cover.vert", "shaders/raster_bounds.frag", of_bounds);
        ends_ = &cache.graphics("shaders/raster_cover.vert", "shaders/raster_ends.frag", defines);
        trace_ = &cache.graphics("shaders/raster_tiles.vert", "shaders/raster_trace.frag", defines);
        blocks_ = &cache.compute("shaders/raster_blocks.comp");
        ask_ = &cache.graphics("shaders/raster_blocks.vert", "shaders/raster_candidates.frag");
        cut_ = &cache.graphics("shaders/raster_blocks.vert", "shaders/raster_cut.frag", scene.defines());
        wide_ = &cache.graphics("shaders/raster_blocks.vert", "shaders/raster_candidates.frag",
                                {{"HALFLIGHT_WIDE", std::to_string(kWideTile)}});
        set_uniforms();
        glGetIntegerv(GL_VERTEX_ARRAY_BINDING, &others_attributes_);
        glBindVertexArray(parts_.no_attributes.id());
        GLuint id = 0;
        glCreateFramebuffers(1, &id);
        ray_target_ = gpu::Object<gpu::delete_framebuffer>(id);
        gpu::label(GL_FRAMEBUFFER, id, "rays");
        glNamedFramebufferParameteri(id, GL_FRAMEBUFFER_DEFAULT_WIDTH, layout_.ray_texels().x);
        glNamedFramebufferParameteri(id, GL_FRAMEBUFFER_DEFAULT_HEIGHT, layout_.ray_texels().y);
        stage(&RasterStages::bounds, [&] { add_bounds(); });
        if (survey_ || parts_.tree.survey.size() <= kWideTile) return;
        stage(&RasterStages::mark, [&] { fill_lists(*wide_, parts_.tree.survey); });
        trace_lists(true);
    }
    RasterRun(const RasterRun&) = delete;
    RasterRun& operator=(const RasterRun&) = delete;
    ~RasterRun() override {
        glBindVertexArray(static_cast<GLuint>(others_attributes_));
        glPointSize(1);
        gpu::default_state();
    }

    void ask(std::span<const std::uint32_t> nodes) override {
        if (asked_ == parts_.queries.size()) {
            GLuint id = 0;
            glCreateQueries(GL_ANY_SAMPLES_PASSED, 1, &id);
            parts_.queries.emplace_back(id);
        }
        set_candidates(*ask_, nodes);
        resources_.framebuffer({}, targets_.depth).bind();
        test_depth();
        glBeginQuery(GL_ANY_SAMPLES_PASSED, parts_.queries[asked_++].id());
        stage(&RasterStages::ask, [&] { use(*ask_).draw(GL_POINTS, layout_.blocks); });
        glEndQuery(GL_ANY_SAMPLES_PASSED);
        // Software drivers overcount if thousands of queries wait.
        if (asked_ % 256 == 0) glFlush();
    }

    std::optional<bool> answer(std::size_t question, bool wait) override {
        const GLuint query = parts_.queries[question].id();
        GLuint known = GL_TRUE, passed = GL_TRUE;
        if (!wait) glGetQueryObjectuiv(query, GL_QUERY_RESULT_AVAILABLE, &known);
        if (known == GL_FALSE) return std::nullopt;
        glGetQueryObjectuiv(query, GL_QUERY_RESULT, &passed);
        return passed != GL_FALSE || !parts_.settings.believe_queries;
    }

    void trace(std::span<const std::uint32_t> leaves) override {
        if (survey_) {
            survey_->leaves.insert(survey_->leaves.end(), leaves.begin(), leaves.end());
            return;
        }
        stage(&RasterStages::mark, [&] { fill_lists(*cut_, leaves); });
        trace_lists(false);
    }

    /// Keeps the shafts of blocks for eye_of() in the next run.
    void keep_starts(std::optional<gpu::Buffer>& starts) const {
        const std::size_t block = 4 * sizeof(vec4), bytes = layout_.blocks * block;
        if (!starts || starts->bytes() != bytes) starts.emplace("starts of rays", bytes);
        glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
        glCopyNamedBufferSubData(resources_.buffer(targets_.shafts).id(), starts->id(),
                                 static_cast<GLintptr>(layout_.tiles() * block), 0, static_cast<GLsizeiptr>(bytes));
    }

  private:
    template <class F>
    void stage(double RasterStages::*seconds, F&& f) {
        if (!parts_.settings.measure) return f();
        gpu::finish();
        const double start = cpu_seconds();
        f();
        gpu::finish();
        statistics_.stages.*seconds += cpu_seconds() - start;
    }

    /// Binds the program's resources, unless the program was the last one used.
    const gpu::Program& use(const gpu::Program& program) {
        if (std::exchange(used_, &program) == &program) return program;
        const auto is = [&](std::initializer_list<const gpu::Program*> programs) {
            return std::ranges::find(programs, &program) != programs.end();
        };
        graph::Resources& r = resources_;
        if (is({bounds_, ends_, trace_})) {
            bind_batch(r, program, scene_, batch_);
            program.bind_storage(any_hit_ ? "Occluded" : "Hits", r.buffer(targets_.results));
        }
        if (is({bounds_}) && survey_ && survey_->ends) program.bind_storage("Ends", *survey_->ends);
        if (is({bounds_, blocks_})) program.bind_storage("Shafts", r.buffer(targets_.shafts));
        if (is({bounds_, ends_})) program.bind_storage("Alive", r.buffer(targets_.alive));
        if (is({ends_, ask_, cut_, wide_})) program.bind_texture("shafts", r.buffer(targets_.shafts), GL_RGBA32F);
        if (is({ends_, trace_})) program.bind_texture("list_sizes", r.texture(targets_.sizes));
        if (is({trace_})) program.bind_texture("lists", r.buffer(targets_.lists), GL_R32UI);
        if (is({ask_, cut_, wide_})) {
            program.bind_texture("boxes", parts_.boxes, GL_RGBA32F);
            program.bind_texture("tile_depth", r.texture(targets_.depth));
            program.bind_storage("Lists", r.buffer(targets_.lists));
        }
        return program;
    }

    void set_uniforms() {
        for (const gpu::Program* program : {bounds_, ends_, trace_, ask_, cut_, wide_}) {
            program->set("block_columns", layout_.columns);
        }
        for (const gpu::Program* program : {blocks_, ask_, cut_, wide_}) program->set("tile_count", layout_.tiles());
        for (const gpu::Program* program : {trace_, ask_, cut_, wide_})
            program->set("tile_texels", layout_.tile_texels);
        for (const gpu::Program* program : {ask_, cut_, wide_}) {
            program->set("hull", greatest_coordinate(parts_.tree.hull));
            program->set("slack", parts_.tree.slack);
        }
        if (!batch_.list) {
            for (const gpu::Program* program : {bounds_, ends_, trace_}) program->set("capacity", batch_.capacity);
        }
    }

    void set_candidates(const gpu::Program& program, std::span<const std::uint32_t> nodes) const {
        std::array<std::uint32_t, shared::kRasterCandidates> padded{};
        std::copy(nodes.begin(), nodes.end(), padded.begin());
        glProgramUniform4uiv(program.id(), program.uniform("candidate_boxes"), shared::kRasterCandidates / 4,
                             padded.data());
        program.set("candidate_count", static_cast<std::uint32_t>(nodes.size()));
    }

    /// Enables the depth test, which fails for tiles whose rays end nearer.
    static void test_depth() {
        glEnable(GL_DEPTH_TEST);
        glDepthFunc(GL_LEQUAL);
        glDepthMask(GL_FALSE);
        glClipControl(GL_LOWER_LEFT, GL_ZERO_TO_ONE);
        glPointSize(RasterLayout::kTileEdge);
    }

    /// Makes fragments write the depth.
    static void write_depth() {
        glEnable(GL_DEPTH_TEST);
        glDepthFunc(GL_ALWAYS);
        glDepthMask(GL_TRUE);
    }

    void add_bounds() {
        const gpu::Framebuffer& target = resources_.framebuffer({}, targets_.depth);
        target.bind();
        write_depth();
        use(*bounds_).draw(GL_TRIANGLES, 3);
        glTextureBarrier();  // later draws test and read the depth
        glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
        use(*blocks_).dispatch((layout_.blocks + 7) / 8);
        glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_TEXTURE_FETCH_BARRIER_BIT);
    }

    void fill_lists(const gpu::Program& program, std::span<const std::uint32_t> nodes) {
        const gpu::Framebuffer& target = resources_.framebuffer({targets_.sizes}, targets_.depth);
        target.bind();
        target.clear_color_uint(0, 0);
        test_depth();
        set_candidates(program, nodes);
        use(program).draw(GL_POINTS, layout_.blocks);
        glMemoryBarrier(GL_TEXTURE_FETCH_BARRIER_BIT);
    }

    void trace_lists(bool completely) {
        if (parts_.settings.measure) count_pairs();
        stage(&RasterStages::trace, [&] { trace_tiles(); });
        glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
        stage(&RasterStages::end, [&] { end_tiles(completely); });
    }

    void count_pairs() {
        for (const std::uint32_t size : resources_.texture(targets_.sizes).read_uint()) statistics_.pairs += size;
    }

    void trace_tiles() {
        glBindFramebuffer(GL_FRAMEBUFFER, ray_target_.id());
        glViewport(0, 0, layout_.ray_texels().x, layout_.ray_texels().y);
        glDisable(GL_DEPTH_TEST);
        glPointSize(RasterLayout::kTileEdge);
        use(*trace_).draw(GL_POINTS, layout_.tiles());
    }

    void end_tiles(bool completely) {
        ends_->set("completely", completely);
        resources_.framebuffer({}, targets_.depth).bind();
        write_depth();
        use(*ends_).draw(GL_TRIANGLES, 3);
        glTextureBarrier();
    }

    RasterCulling::Parts& parts_;
    RasterStatistics& statistics_;
    RasterLayout layout_;
    graph::Resources& resources_;
    const TraceScene& scene_;
    const RayBatch& batch_;
    const RasterTargets& targets_;
    const bool any_hit_;
    Survey* const survey_;  // null: leaves are traced
    const gpu::Program* bounds_;
    const gpu::Program* blocks_;
    const gpu::Program* ask_;
    const gpu::Program* cut_;
    const gpu::Program* wide_;
    const gpu::Program* trace_;
    const gpu::Program* ends_;
    const gpu::Program* used_ = nullptr;
    gpu::Object<gpu::delete_framebuffer> ray_target_;  // framebuffer without attachments
    GLint others_attributes_ = 0;
    std::size_t asked_ = 0;
};

graph::BufferHandle RasterCulling::add(graph::Graph& graph, const TraceScene& scene, const RayBatch& batch,
                                       graph::BufferHandle results, bool any_hit) {
    graph::Pass pass =
        graph.add_pass(fmt::format("{} rays: {}, raster", name(batch.kind), any_hit ? "any hit" : "closest hit"));
    read_batch(pass, scene, batch);
    const RasterTargets targets = declare(graph, pass, batch, write_results(pass, batch, results));
    pass.execute([=, this, &scene](graph::Resources& r) { parts_->run(*this, r, scene, batch, targets, any_hit); });
    return targets.results;
}

RasterTargets RasterCulling::declare(graph::Graph& graph, graph::Pass& pass, const RayBatch& batch,
                                     graph::BufferHandle results) {
    const RasterLayout layout(batch.capacity);
    layout.check_driver();
    const std::size_t tiles = layout.tiles();
    const auto texels = [&](GLenum format) {
        return gpu::TextureDesc{layout.tile_texels.x, layout.tile_texels.y, format};
    };
    RasterTargets targets;
    targets.results = results;
    targets.shafts = pass.write(graph.create_buffer("ray shafts", {(tiles + layout.blocks) * 4 * sizeof(vec4)}),
                                Access::storage_write);
    targets.alive = pass.write(graph.create_buffer("living rays", {tiles * sizeof(uvec2)}), Access::storage_write);
    targets.depth =
        pass.write(graph.create_texture("ray ends", texels(GL_DEPTH_COMPONENT32F)), Access::depth_attachment);
    targets.sizes = pass.write(graph.create_texture("sizes of lists", texels(GL_R32UI)), Access::color_attachment);
    targets.lists =
        pass.write(graph.create_buffer("lists of nodes", {tiles * shared::kRasterList * sizeof(std::uint32_t)}),
                   Access::storage_write);
    return targets;
}

std::vector<std::uint32_t> RasterCulling::visible_leaves(graph::Resources& resources, const TraceScene& scene,
                                                         const RayBatch& batch, const RasterTargets& targets,
                                                         bool any_hit, const gpu::Buffer* ends) {
    Survey survey{ends};
    parts_->run(*this, resources, scene, batch, targets, any_hit, &survey);
    return std::move(survey.leaves);
}

void RasterCulling::Parts::run(RasterCulling& culling, graph::Resources& r, const TraceScene& scene,
                               const RayBatch& batch, const RasterTargets& targets, bool any_hit, Survey* survey) {
    interruption_point();
    const Stopwatch watch;
    RasterStatistics& sums = culling.statistics(batch.kind, batch.depth);
    RasterMemory& memory = memories[key_of(batch)];
    if (memory.starts) memory.state.eye = eye_of(memory.starts->read<vec4>());
    RasterRun run(r, scene, culling, batch, targets, any_hit, survey);
    run.keep_starts(memory.starts);
    walk(tree, memory.state, run, sums);
    sums.seconds += watch.seconds();
}

}  // namespace halflight::rays
