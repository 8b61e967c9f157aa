#include "passes/prepared_scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <future>

#include "engine/scene/shading_tables.h"

namespace halflight {
namespace {

std::string name_or(const std::string& name, const char* what, std::size_t index) {
    return name.empty() ? fmt::format("{} {}", what, index) : name;
}

bool glows(const Material& m) {
    return m.unlit || m.emission != vec3(0);
}

}  // namespace

PreparedScene::PreparedScene(gpu::Context& context, const Scene& scene, const PrepareOptions& options)
    : context_(context), programs_(context.binaries()), kept_(options.kept), estimator_(options.estimator) {
    using Clock = std::chrono::steady_clock;
    const Clock::time_point start = Clock::now();
    validate(scene);
    for (const Instance& i : scene.instances) object_names_.push_back(name_or(i.name, "object", object_names_.size()));
    for (const Material& m : scene.materials)
        material_names_.push_back(name_or(m.name, "material", material_names_.size()));
    tables_ = build_trace_tables(scene, kFlattenLimit);
    const SceneNeeds kept = kept_needs(kept_);
    tables_.alpha_tested |= kept.alpha;
    tables_.keep_top_level = kept.instances;
    // Hierarchies on another thread, while this one packs and uploads the rest.
    auto packing = std::async(std::launch::async, [&] { return rays::pack_scene(tables_); });
    {
        const ShadingTables shading = build_shading_tables(scene, tables_, kept, estimator_.lights, estimator_.sun);
        estimator_.lights = shading.light_choice;
        estimator_.camera = resolved(estimator_.camera, std::ranges::any_of(scene.materials, glows));
        has_environment_ = !shading.environment.pixels.empty();
        buffers_.emplace(tables_, shading);
    }
    const rays::PackedScene packed = packing.get();
    trace_.emplace(tables_, packed, buffers_->defines());
    if (options.raster_culling) cull_tree_ = rays::build_cull_tree(packed);
    seconds_ = std::chrono::duration<double>(Clock::now() - start).count();
}

}  // namespace halflight
