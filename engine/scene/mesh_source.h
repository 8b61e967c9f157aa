// Scenes whose meshes are read one by one, for geometry that does not fit into memory.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "engine/core/versioned_file.h"
#include "engine/scene/scene.h"

namespace halflight {

/// A scene at rest, without its vertices and triangles.
class MeshSource {
  public:
    virtual ~MeshSource() = default;
    /// Returns the scene. Its meshes have names only, and may turn out to have no triangles. Instances refer to them.
    /// Its report is empty.
    virtual const Scene& scene() const = 0;
    /// Returns the report about the scene and the meshes that have been read.
    virtual SceneReport report() const = 0;
    /// Returns the files that have been opened, with those of images.
    virtual std::vector<VersionedFile> files() const = 0;
    /// Reads a mesh, which meets the requirements of scene.h. The same mesh can be read again. Throws Error that names
    /// file and element.
    virtual Mesh read(std::size_t mesh) = 0;
    /// Returns materials, vertex colours and tangents of all triangles that a deforming mesh has in some pose, but
    /// neither positions nor triangles. At rest, read() drops those without area. Tangents tell only whether there are
    /// any.
    virtual Mesh all_parts(std::size_t mesh) { return read(mesh); }
};

/// Adds the numbers and warnings of another report.
void add_report(SceneReport& to, const SceneReport& more);

/// Several scenes as one. Meshes, instances, materials, images, lights and cameras follow each other in the order of
/// the parts. The environment is the first one that is not black.
class JoinedScenes final : public MeshSource {
  public:
    JoinedScenes(std::string name, std::vector<std::unique_ptr<MeshSource>> parts);
    const Scene& scene() const override { return scene_; }
    SceneReport report() const override;
    std::vector<VersionedFile> files() const override;
    Mesh read(std::size_t mesh) override;
    Mesh all_parts(std::size_t mesh) override;

  private:
    struct Part {
        std::unique_ptr<MeshSource> source;
        std::size_t first_mesh = 0;
        std::size_t first_material = 0;
    };
    const Part& part_of(std::size_t mesh) const;

    std::vector<Part> parts_;
    Scene scene_;
};

}  // namespace halflight
