// Scenes whose meshes are read one by one, for geometry that does not fit into memory.
#pragma once

#include <cstddef>

#include "engine/scene/scene.h"

namespace halflight {

/// A scene at rest, without its vertices and triangles.
class MeshSource {
  public:
    virtual ~MeshSource() = default;
    /// Returns the scene. Its meshes have names only, and may turn out to have no triangles. Instances refer to them.
    virtual const Scene& scene() const = 0;
    /// Reads a mesh, which meets the requirements of scene.h. The same mesh can be read again. Throws Error that names
    /// file and element.
    virtual Mesh read(std::size_t mesh) = 0;
};

}  // namespace halflight
