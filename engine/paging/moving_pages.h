// Moving and deforming geometry beside the pages of all other geometry. No OpenGL is used.
//
// Page files hold what no animation moves. The rest stays in memory. For each pose it becomes pages of its own, which
// follow the pages of the file, and its triangles follow those of the file.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "engine/paging/pages.h"
#include "engine/scene/scene.h"

namespace halflight::paging {

/// Returns whether an instance of a scene moves or deforms in some pose, so that pages of files leave it out.
inline bool is_moving(const Scene& scene, const Instance& instance) {
    return instance.moves || scene.meshes[static_cast<std::size_t>(instance.mesh)].deforms;
}

class MovingPages final : public PageSource {
  public:
    /// `still` has the pages of all other geometry.
    explicit MovingPages(std::shared_ptr<const PageSource> still);

    /// Changes to a pose of the scene. Nothing may read meanwhile. Returns whether pages have changed; they are a
    /// function of the pose. Throws Error for a scene whose still instances are not those of the pages, and what
    /// build_trace_tables() throws. After a failure the object may only be destroyed.
    bool pose(const Scene& scene);

    std::string subject() const override { return still_->subject(); }
    const PageIndex& index() const override { return index_; }
    StillPart still() const override { return still_->still(); }
    Page read(std::uint32_t page) const override;
    void read_rows(std::span<const std::uint32_t> triangles, TriangleRows& rows) const override;

  private:
    void place_still(const Scene& scene);
    void add_rows(const Scene& scene);
    void build(const PageIndex& of_still);

    std::shared_ptr<const PageSource> still_;
    PageIndex index_;
    // Tables of moving geometry. Indices of vertices count from its first vertex.
    std::vector<uvec4> triangles_;
    std::vector<vec3> positions_;
    std::vector<vec4> attributes_;
    std::vector<Page> pages_;
};

}  // namespace halflight::paging
