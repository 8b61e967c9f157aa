#include "engine/device/prepared_scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cstring>
#include <future>

#include "engine/core/error.h"
#include "engine/core/release.h"
#include "engine/core/stopwatch.h"
#include "engine/scene/geometry.h"
#include "engine/tables/shading_tables.h"

namespace halflight {
namespace {

std::string name_or(const std::string& name, const char* what, std::size_t index) {
    return name.empty() ? fmt::format("{} {}", what, index) : name;
}

bool anything_moves(const TraceTables& tables) {
    return std::ranges::any_of(tables.ranges, &MeshRange::moves);
}

template <class T>
bool same_bits(const T& a, const T& b) {
    return std::memcmp(&a, &b, sizeof(T)) == 0;
}

/// Returns whether rays see the same geometry, bit for bit.
bool same_geometry(const TraceTables& a, const TraceTables& b) {
    const auto same = [](const BlockInstance& x, const BlockInstance& y) {
        return x.block == y.block && same_bits(x.block_to_world, y.block_to_world) &&
               same_bits(x.world_to_block, y.world_to_block) && x.identity == y.identity;
    };
    return a.ranges == b.ranges && a.triangles == b.triangles &&
           std::ranges::equal(a.positions, b.positions, same_bits<vec3>) &&
           std::ranges::equal(a.instances, b.instances, same);
}

}  // namespace

/// State that makes the update to the next pose cheaper.
struct PreparedScene::Memory {
    rays::Hierarchies hierarchies;
    rays::PackedScene packed;  // uploaded hierarchies
    ShadingTables shading;     // uploaded tables, without texels
};

/// Properties that the graphs, buffers and statistics of renderers depend on.
struct PreparedScene::Shape {
    struct Kernels {
        SceneNeeds needs;
        std::vector<std::pair<std::string, std::string>> defines;  // defines of the tables: banks of texels, tiles
        Estimator estimator;
        rays::NodeFormat format;
        bool two_level;
        bool alpha_tested;
        std::uint32_t pools;
        bool operator==(const Kernels&) const = default;
    } kernels;
    bool environment;
    std::uint64_t drawn_triangles;
    std::vector<std::string> objects;
    std::vector<std::string> materials;
    std::vector<std::string> light_groups;
    bool operator==(const Shape&) const = default;
};

PreparedScene::Shape PreparedScene::shape() const {
    const rays::TraceStatistics& s = trace().statistics();
    return {{buffers_->needs(), buffers_->defines().values(), estimator_, s.node_format, s.two_level,
             trace().alpha_tested(), pools_},
            has_environment_,
            drawn_triangles(),
            object_names_,
            material_names_,
            light_groups_};
}

PreparedScene::PreparedScene(gpu::Context& context, const Scene& scene, const PrepareOptions& options)
    : context_(context),
      options_(options),
      programs_(options.programs ? options.programs : std::make_shared<gpu::ProgramCache>(context.binaries())),
      asked_estimator_(options.estimator) {
    options_.pages ? prepare_pages(scene) : prepare(scene);
    origin_ = tables_.origin;
}

PreparedScene::~PreparedScene() = default;

std::uint64_t PreparedScene::drawn_triangles() const {
    std::uint64_t triangles = 0;
    for (const BlockInstance& i : tables_.instances) triangles += tables_.blocks[i.block].triangle_count;
    return triangles;
}

std::size_t PreparedScene::bytes() const {
    const rays::TraceScene* panes = trace().panes();
    return buffers_->bytes() + trace().statistics().bytes + (panes ? panes->statistics().bytes : 0);
}

bool PreparedScene::update(const Scene& scene) {
    check_usable();
    if (options_.single_pose) throw Error("prepared scene", "it was made for one pose only");
    const Shape before = shape();
    usable_ = false;
    options_.pages ? prepare_pages(scene) : prepare(scene);
    usable_ = true;
    const Shape now = shape();
    same_kernels_ = now.kernels == before.kernels;
    return now == before;
}

void PreparedScene::share(const std::optional<SceneNeeds>& needs) {
    options_.estimator.lights = needs ? LightChoice::power : asked_estimator_.lights;
    options_.estimator.sun = needs ? SunChoice::among : asked_estimator_.sun;
    shared_ = needs ? std::optional(united(*needs, buffers_->needs())) : std::nullopt;
    if (!shared_) return;
    // Lights that are chosen by power need neither a tree nor a sun of its own.
    shared_->light_tree = shared_->every_light = shared_->sun = false;
}

SceneNeeds PreparedScene::needs_of(const Scene& scene) const {
    const TraceTables tables = build_trace_tables(scene, kFlattenLimit, origin_);
    return united(shading_needs(scene, tables, options_.estimator.lights, options_.estimator.sun), kept_parts());
}

/// Returns the needs that are built although a pose does not have them.
SceneNeeds PreparedScene::kept_parts() const {
    const SceneNeeds kept = kept_needs(options_.kept);
    return shared_ ? united(kept, *shared_) : kept;
}

void PreparedScene::check_usable() const {
    if (!usable_) throw Error("prepared scene", "its update has failed, and it cannot be used any more");
}

void PreparedScene::settle(const Estimator& piloted, double seconds) {
    assert(piloted.lights == estimator_.lights && piloted.sun == estimator_.sun);
    for (Estimator* e : {&estimator_, &options_.estimator})
        e->reuse = piloted.reuse, e->camera = piloted.camera, e->shadow = piloted.shadow;
    seconds_ += seconds;
}

void PreparedScene::take_names(const Scene& scene) {
    object_names_.clear();
    material_names_.clear();
    light_groups_ = scene.light_groups;
    for (const Instance& i : scene.instances) object_names_.push_back(name_or(i.name, "object", object_names_.size()));
    for (const Material& m : scene.materials)
        material_names_.push_back(name_or(m.name, "material", material_names_.size()));
    // Readers of pages add the default material as the last one, whether it is used or not.
    if (!options_.pages || material_names_.empty()) return;
    const std::vector<bool>& used = options_.pages->index().geometry.used_materials;
    if (used.size() == material_names_.size() && !used.back()) material_names_.pop_back();
}

const paging::PageSource& PreparedScene::pages() const {
    return moving_pages_ ? static_cast<const paging::PageSource&>(*moving_pages_) : *options_.pages;
}

/// Makes pages of the geometry that moves. Returns whether the tables have to follow.
bool PreparedScene::pose_pages(const Scene& scene) {
    const bool any =
        std::ranges::any_of(scene.instances, [&](const Instance& i) { return paging::is_moving(scene, i); });
    if (!moving_pages_ && !any) return !pool_;
    if (!moving_pages_) {
        pool_.reset();  // the pool reads another source
        moving_pages_ = std::make_unique<paging::MovingPages>(options_.pages);
    }
    if (pool_) pool_->begin_pose();
    if (moving_pages_->pose(scene) && pool_ && !pool_->end_pose()) pool_.reset();
    return true;
}

void PreparedScene::prepare_pages(const Scene& scene) {
    const Stopwatch watch;
    take_names(scene);
    const bool posed = pose_pages(scene);
    if (posed) tables_ = paging::resident_tables(pages(), tables_.absent ? &tables_ : nullptr);
    const auto shown = static_cast<std::size_t>(std::ranges::count_if(
        scene.instances, [&](const Instance& i) { return !paging::is_moving(scene, i) || has_surface(scene, i); }));
    if (tables_.absent->used_materials.size() != scene.materials.size() || tables_.ranges.size() != shown) {
        throw Error(scene.name, "its pages were made of another scene: {} materials and {} objects, not {} and {}",
                    tables_.absent->used_materials.size(), tables_.ranges.size(), scene.materials.size(), shown);
    }
    const SceneNeeds kept = united(kept_parts(), paging::vertex_layout(pages().index()));
    ShadingTables shading = build_shading_tables(scene, tables_, kept, options_.estimator.lights,
                                                 options_.estimator.sun, buffers_ ? &pooled_ : nullptr);
    if (static_cast<std::uint32_t>(shading.needs.vertex_stride()) != pages().index().vertex_texels)
        throw Error(scene.name, "its materials need vertex attributes that its pages do not have");
    estimator_ = options_.estimator;
    estimator_.lights = shading.light_choice;
    has_environment_ = !shading.environment.pixels.empty();
    pooled_ = shading.pooled;
    if (buffers_) {
        buffers_->update(tables_, shading, nullptr);
    } else {
        buffers_.emplace(tables_, shading, options_.bank_shift, options_.tile_bytes);
    }
    if (options_.scene_read) options_.scene_read();
    if (pool_) {
        pool_->set_shading(buffers_->defines());
    } else {
        pool_.emplace(pages(), options_.pool_bytes(shading.needs), buffers_->defines());
        ++pools_;
    }
    if (posed) pool_->update_panes(tables_);
    seconds_ = watch.seconds();
}

void PreparedScene::prepare(const Scene& scene) {
    const Stopwatch watch;
    validate(scene);
    take_names(scene);
    TraceTables tables = build_trace_tables(scene, kFlattenLimit, origin_);
    const SceneNeeds kept = kept_parts();
    tables.slivers |= kept.slivers;
    tables.alpha_tested |= kept.alpha || kept.panes;
    tables.panes |= kept.panes;
    tables.one_sided |= kept.one_sided;
    tables.keep_top_level = kept.instances;

    // Another thread builds the hierarchies while this one packs and uploads the rest. Large static scenes have several
    // parts that are built in parallel, later, when the rest has been freed.
    const bool same = trace_ && same_geometry(tables_, tables);
    const bool keeps = !memory_ && !origin_ && !options_.single_pose && anything_moves(tables);
    std::optional<rays::Hierarchies> made;
    const bool moves = memory_ || keeps;
    const bool later = !moves && tables.triangles.size() > options_.most_in_part;
    auto packing = std::async(later ? std::launch::deferred : std::launch::async, [&]() -> rays::PackedScene {
        if (same) return {};
        if (memory_)
            memory_->hierarchies.update(tables_, tables);
        else
            made.emplace(tables, options_.most_in_part);
        hierarchies_ = (memory_ ? memory_->hierarchies : *made).counts();
        if (memory_ || keeps) return rays::pack_scene(tables, memory_ ? memory_->hierarchies : *made);
        return rays::pack_scene(tables, std::move(*made));
    });
    ShadingTables shading = build_shading_tables(scene, tables, kept, options_.estimator.lights, options_.estimator.sun,
                                                 buffers_ ? &pooled_ : nullptr);
    estimator_ = options_.estimator;
    estimator_.lights = shading.light_choice;
    has_environment_ = !shading.environment.pixels.empty();
    pooled_ = shading.pooled;
    if (buffers_) {
        const std::optional<SceneBuffers::Content> last =
            memory_ ? std::optional(SceneBuffers::Content{tables_, memory_->shading}) : std::nullopt;
        buffers_->update(tables, shading, last ? &*last : nullptr);
    } else {
        buffers_.emplace(tables, shading, options_.bank_shift, options_.tile_bytes);
    }
    if (options_.scene_read) options_.scene_read();
    if (!moves) shading = {};  // hierarchies need the memory
    rays::PackedScene packed = packing.get();
    if (options_.single_pose) release(tables.positions);
    if (!same && options_.raster_culling) cull_tree_ = rays::build_cull_tree(packed);
    if (same) {
        hierarchies_ = {.kept = hierarchies_.kept + hierarchies_.refitted + hierarchies_.built};
        trace_->set_shading(buffers_->defines());
    } else if (trace_) {
        trace_->update(tables, packed, buffers_->defines(), memory_ ? &memory_->packed : nullptr);
    } else if (moves) {
        trace_.emplace(tables, packed, buffers_->defines(), &buffers_->instance_rows());
    } else {
        trace_.emplace(tables, std::move(packed), buffers_->defines(), &buffers_->instance_rows());
    }

    shading.color_texels = {};  // their images may be freed
    shading.data_texels = {};
    if (memory_) {
        memory_->shading = std::move(shading);
        if (!same) memory_->packed = std::move(packed);
    } else if (keeps) {
        memory_ = std::make_unique<Memory>(Memory{std::move(*made), std::move(packed), std::move(shading)});
    }
    tables_ = std::move(tables);
    seconds_ = watch.seconds();
}

}  // namespace halflight
