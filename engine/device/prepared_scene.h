// What all renderers of a scene share: its tables, its hierarchies, its buffers, the programs compiled for it.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/device/scene_buffers.h"
#include "engine/gpu/context.h"
#include "engine/gpu/program.h"
#include "engine/rays/raster_tree.h"
#include "engine/rays/rays.h"
#include "engine/settings/estimator.h"
#include "engine/tables/tables.h"

namespace halflight {

struct PrepareOptions {
    bool raster_culling = true;  // also what renderers with rays::Culling::raster need
    Kept kept{};                 // and what the scene has no use for (SceneNeeds)
    Estimator estimator{};
};

/// Changes only by update() and by what a pilot settles before the first picture, but for the programs, of which there
/// are more and more. Needs its context current on the
/// calling thread for as long as it lives. The context must outlive it, the scene need not.
class PreparedScene {
  public:
    /// Throws Error for a scene that is not valid and for limits of the driver.
    PreparedScene(gpu::Context& context, const Scene& scene, const PrepareOptions& options = {});
    PreparedScene(const PreparedScene&) = delete;
    PreparedScene& operator=(const PreparedScene&) = delete;
    ~PreparedScene();

    /// Brings it to another pose of its scene: the same images, anything else may differ. What has not changed is kept;
    /// of what moves (Instance::moves, Mesh::deforms) hierarchies are refitted (engine/rays/hierarchies.h). All that
    /// pictures depend on is a function of this pose and of that which it was made with, the reference, whatever poses
    /// were between. False where renderers cannot go on and are to be made anew: it needs other shaders or buffers.
    /// Throws Error as the constructor; later updates and pictures of the scene then throw Error, too.
    bool update(const Scene& scene);
    /// Throws Error where an update has failed.
    void check_usable() const;

    gpu::Context& context() const { return context_; }
    const TraceTables& tables() const { return tables_; }
    const SceneBuffers& buffers() const { return *buffers_; }
    const rays::TraceScene& trace() const { return *trace_; }
    const rays::CullTree& cull_tree() const { return cull_tree_; }                      ///< empty unless prepared
    const std::vector<std::string>& object_names() const { return object_names_; }      ///< of Scene::instances
    const std::vector<std::string>& material_names() const { return material_names_; }  ///< of Scene::materials
    std::uint64_t drawn_triangles() const;                                              ///< instances counted each
    bool has_environment() const { return has_environment_; }  ///< that is seen where there is no surface
    const Kept& kept() const { return options_.kept; }
    const Estimator& estimator() const { return estimator_; }  ///< where it was left to the scene, what came of it
    const Estimator& asked_estimator() const { return asked_estimator_; }  ///< as it was when the scene was prepared
    /// What a pilot (renderer/pilot.h) found, or is to try, in so many seconds: for renderers from here on.
    void settle(const Estimator& piloted, double seconds);
    gpu::ProgramCache& programs() { return programs_; }
    std::size_t bytes() const { return buffers_->bytes() + trace_->statistics().bytes; }  ///< in device memory
    double seconds() const { return seconds_; }  ///< that it took to make, or to update last, pilots included
    const rays::HierarchyCounts& hierarchies() const { return hierarchies_; }  ///< what became of them then

  private:
    struct Memory;
    struct Shape;
    void prepare(const Scene& scene);
    Shape shape() const;

    gpu::Context& context_;
    PrepareOptions options_;
    TraceTables tables_;
    std::optional<dvec3> origin_;  // of the reference pose
    std::vector<std::string> object_names_;
    std::vector<std::string> material_names_;
    std::vector<PooledImage> pooled_;
    std::optional<SceneBuffers> buffers_;
    std::optional<rays::TraceScene> trace_;
    rays::CullTree cull_tree_;
    std::unique_ptr<Memory> memory_;  // of scenes in which something moves
    gpu::ProgramCache programs_;
    bool has_environment_ = false;
    bool usable_ = true;  // no update has failed
    Estimator estimator_;
    const Estimator asked_estimator_;
    rays::HierarchyCounts hierarchies_;
    double seconds_ = 0;
};

}  // namespace halflight
