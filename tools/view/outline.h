// The outline of the selected object as lines of the picture. Uses no window.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "tools/view/session.h"

namespace halflight::view {

/// Finds the lines of the outline. They are kept until an input changes.
class Outline {
  public:
    /// Returns the outline of the session's selected node, with everything below it, or mesh: the edges of the area
    /// that it covers. Objects of very many triangles give the edges of their bounding box. Other objects, and scenes
    /// in pages, give no lines.
    const std::vector<PictureLine>& lines(const Session& session, const ivec2& size);

  private:
    /// Everything that the lines depend on.
    struct Key {
        Selection selection;
        std::shared_ptr<const Scene> scene;
        SceneEdits surfaces;
        Camera camera;
        ivec2 size;
        bool operator==(const Key& other) const;
    };
    std::optional<Key> key_;
    std::vector<PictureLine> lines_;
    std::map<std::size_t, MeshEdges> edges_;  // edges of meshes of Key::scene, by index
};

}  // namespace halflight::view
