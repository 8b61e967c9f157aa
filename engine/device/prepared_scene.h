// The part of a scene that renderers share: tables, hierarchies, buffers, compiled programs.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/device/scene_buffers.h"
#include "engine/gpu/context.h"
#include "engine/gpu/program_cache.h"
#include "engine/paging/moving_pages.h"
#include "engine/paging/page_pool.h"
#include "engine/rays/hierarchies.h"
#include "engine/rays/raster_tree.h"
#include "engine/rays/rays.h"
#include "engine/settings/estimator.h"
#include "engine/tables/tables.h"

namespace halflight {

struct PrepareOptions {
    bool raster_culling = true;  // whether to prepare for rays::Culling::raster
    Kept kept{};                 // parts to keep although the scene does not need them (SceneNeeds)
    Estimator estimator{};
    unsigned bank_shift = shared::kMostBankShift;  // SceneBuffers; pictures do not depend on it
    std::size_t most_in_part = rays::kMostInPart;  // see rays::Hierarchies
    bool single_pose = false;                      // true: no state for update() is kept, so update() throws Error
    // Pages of a scene whose geometry is not in memory; its meshes are then empty, but for those that move or deform
    // (paging::is_moving()). Updates may change everything but the instances in pages. Null: the scene has it all.
    std::shared_ptr<const paging::PageSource> pages{};
    // Returns the bytes of device memory for pages. The scene's other buffers have been made when it is called.
    std::function<std::size_t(const SceneNeeds&)> pool_bytes = [](const SceneNeeds&) { return std::size_t{1} << 30; };
    std::size_t tile_bytes = std::size_t{256} << 20;  // bytes of device memory for textures in tiles
    // Called by the constructor once it does not read the scene any more, before hierarchies of large scenes are built.
    std::function<void()> scene_read{};
    // Programs of earlier scenes of the same context, which this one shares and adds to. Null: it has its own.
    std::shared_ptr<gpu::ProgramCache> programs{};
};

/// A scene prepared for rendering. It changes by update(), and by settle() before the first picture; programs are added
/// as they are needed. The context must be current on the calling thread and outlive the object. The scene need not
/// outlive it.
class PreparedScene {
  public:
    /// Throws Error for an invalid scene and if the scene exceeds limits of the driver.
    PreparedScene(gpu::Context& context, const Scene& scene, const PrepareOptions& options = {});
    PreparedScene(const PreparedScene&) = delete;
    PreparedScene& operator=(const PreparedScene&) = delete;
    ~PreparedScene();

    /// Updates to another pose of the scene. The images must be the same; anything else may differ. Unchanged parts are
    /// kept, and hierarchies of moving parts (Instance::moves, Mesh::deforms) are refitted (engine/rays/hierarchies.h).
    /// Pictures depend on this pose and the reference pose of the construction alone, not on poses between. Returns
    /// false if the pose needs other shaders or buffers: renderers must then be made anew. Throws Error like the
    /// constructor. After a failed update, later updates and pictures of the scene throw Error, too.
    bool update(const Scene& scene);
    /// Builds later poses with the tables and kernels that `needs` and this pose call for. Lights are then chosen
    /// alike, and poses of one picture can share renderers. It changes the noise of pictures, not their mean. None:
    /// poses have what they need by themselves.
    void share(const std::optional<SceneNeeds>& needs);
    /// Returns the needs of a pose of the scene, without taking it. Precondition: the scene has no pages.
    SceneNeeds needs_of(const Scene& scene) const;
    /// Returns whether the last update() of the same picture can go on with its renderers: tables and kernels are
    /// alike. update() also returns false if only statistics differ.
    bool same_kernels() const { return same_kernels_; }
    /// Throws Error if an update has failed.
    void check_usable() const;

    gpu::Context& context() const { return context_; }
    const TraceTables& tables() const { return tables_; }
    const SceneBuffers& buffers() const { return *buffers_; }
    const rays::TraceScene& trace() const { return pool_ ? pool_->scene() : *trace_; }
    paging::PagePool* pool() { return pool_ ? &*pool_ : nullptr; }  ///< Returns null unless the scene has pages.
    const rays::CullTree& cull_tree() const { return cull_tree_; }  ///< Returns an empty tree unless prepared.
    const std::vector<std::string>& object_names() const { return object_names_; }      ///< Returns instances' names.
    const std::vector<std::string>& material_names() const { return material_names_; }  ///< Returns materials' names.
    const std::vector<std::string>& light_groups() const { return light_groups_; }  ///< Returns Scene::light_groups.
    std::uint64_t drawn_triangles() const;                     ///< Returns the number of triangles of all instances.
    bool has_environment() const { return has_environment_; }  ///< Returns whether an environment is visible.
    const Kept& kept() const { return options_.kept; }
    const Estimator& estimator() const { return estimator_; }  ///< Returns the estimator in use, without `auto`.
    const Estimator& asked_estimator() const { return asked_estimator_; }  ///< Returns the estimator as requested.
    /// Sets the estimator that a pilot (renderer/pilot.h) found or is to try, for renderers made from here on, and adds
    /// the seconds that it took.
    void settle(const Estimator& piloted, double seconds);
    gpu::ProgramCache& programs() { return *programs_; }
    std::size_t bytes() const;                   ///< Returns bytes on the device.
    double seconds() const { return seconds_; }  ///< Returns seconds of construction or last update, with pilots.
    const rays::HierarchyCounts& hierarchies() const {
        return hierarchies_;
    }  ///< Returns the counts of construction or the last update.

  private:
    struct Memory;
    struct Shape;
    void prepare(const Scene& scene);
    void prepare_pages(const Scene& scene);
    bool pose_pages(const Scene& scene);
    const paging::PageSource& pages() const;
    void take_names(const Scene& scene);
    Shape shape() const;
    SceneNeeds kept_parts() const;

    gpu::Context& context_;
    PrepareOptions options_;
    TraceTables tables_;
    std::optional<dvec3> origin_;       // origin of the reference pose
    std::optional<SceneNeeds> shared_;  // share()
    bool same_kernels_ = true;
    std::vector<std::string> object_names_;
    std::vector<std::string> material_names_;
    std::vector<std::string> light_groups_;
    std::vector<PooledImage> pooled_;
    std::optional<SceneBuffers> buffers_;
    std::optional<rays::TraceScene> trace_;
    std::unique_ptr<paging::MovingPages> moving_pages_;  // null unless a scene with pages has geometry that moves
    std::optional<paging::PagePool> pool_;               // in place of trace_, for scenes with pages
    std::uint32_t pools_ = 0;                            // number of pools so far
    rays::CullTree cull_tree_;
    std::unique_ptr<Memory> memory_;  // state of the last pose; null unless something moves
    std::shared_ptr<gpu::ProgramCache> programs_;
    bool has_environment_ = false;
    bool usable_ = true;  // false: an update has failed
    Estimator estimator_;
    const Estimator asked_estimator_;
    rays::HierarchyCounts hierarchies_;
    double seconds_ = 0;
};

}  // namespace halflight
