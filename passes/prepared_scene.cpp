#include "passes/prepared_scene.h"

#include <chrono>

#include "engine/scene/shading_tables.h"

namespace halflight {

PreparedScene::PreparedScene(gpu::Context& context, const Scene& scene) : context_(context) {
    using Clock = std::chrono::steady_clock;
    const Clock::time_point start = Clock::now();
    validate(scene);
    tables_ = build_trace_tables(scene, kFlattenLimit);
    buffers_.emplace(tables_, build_shading_tables(scene, tables_));
    const rays::PackedScene packed = rays::pack_scene(tables_);
    trace_.emplace(tables_, packed, buffers_->defines());
    cull_tree_ = rays::build_cull_tree(packed);
    seconds_ = std::chrono::duration<double>(Clock::now() - start).count();
}

}  // namespace halflight
