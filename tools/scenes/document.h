// A glTF 2.0 document and its binary container (glTF 2.0, sections 3 and 4). Equal calls give equal bytes.
//
// Mesh data is either at hand, or produced while the file is written: a producer is called once, in file order, so that
// memory stays bounded for files of any size.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "engine/core/math.h"
#include "tools/scenes/mesh.h"

namespace halflight {
class CheckedFile;
}

namespace halflight::scenes {

inline constexpr int kNothing = -1;  ///< "no texture", "no mesh"

/// What glTF and its KHR extensions say of a surface. Only what differs from glTF's defaults is written.
struct Material {
    std::string name;
    dvec3 color{1};  // linear Rec.709
    double metallic = 0;
    double roughness = 1;
    int color_texture = kNothing;
    int normal_texture = kNothing;
    int roughness_texture = kNothing;  // G roughness, B metallic
    double normal_scale = 1;
    dvec3 emission{0};        // radiance
    double alpha_cutoff = 0;  // 0: opaque
    bool double_sided = false;
    double specular = 1;
    double ior = 1.5;
    double clearcoat = 0;
    double clearcoat_roughness = 0;
    double transmission = 0;
};

/// A purely diffuse surface: the one on which glTF, this project and Cycles agree exactly.
Material matte(std::string name, const dvec3& color);
Material metal(std::string name, const dvec3& color, double roughness);
Material glossy(std::string name, const dvec3& color, double roughness);
Material light(std::string name, const dvec3& radiance);

/// One of a skeleton's, fixed to the one before it, the first one to the skeleton's node.
struct Joint {
    dvec3 offset{0};          // from the joint before, in the pose that the mesh is modelled in, where none is turned
    std::vector<vec4> turns;  // quaternions x, y, z, w at the skeleton's `seconds`
};

/// A chain of joints, and the animation that turns them.
struct Skeleton {
    std::string name, animation;
    std::vector<Joint> joints;   // at most 256
    std::vector<float> seconds;  // ascending
};

class Document {
  public:
    explicit Document(const std::string& name);

    /// An embedded picture; `png` are the bytes of a PNG file.
    int texture(const std::string& name, std::string png);
    int material(const Material& material);
    int mesh(const Mesh& mesh);
    /// A named node under the root. `matrix` must be a move, turn and grow (no shear).
    int node(const std::string& name, int mesh, const dmat4& matrix = dmat4(1));
    /// A skinned mesh, whose skeleton's node has the matrix: a move.
    int node(const std::string& name, int mesh, const Skeleton& skeleton, const dmat4& matrix);
    /// The same mesh at many places, as one node with EXT_mesh_gpu_instancing; rotations are quaternions x, y, z, w.
    void instances(const std::string& name, int mesh, std::vector<vec3> translations, std::vector<vec4> rotations);
    /// vertical_fov in degrees; aspect = width / height, 0: that of the picture.
    void camera(const std::string& name, const dvec3& from, const dvec3& at, double vertical_fov, double aspect);
    /// `toward` points from the scene to the sun; lux is what a surface facing it receives.
    void sun(const std::string& name, const dvec3& toward, const dvec3& color, double lux);
    /// Constant radiance from all around: this project's extension HALFLIGHT_environment, since glTF has nothing for
    /// it.
    void sky(const dvec3& radiance);

    /// For meshes that are produced while writing: shape, bounds and byte counts are known, the bytes come later.
    using Producer = std::function<void(CheckedFile&)>;
    struct StreamedPart {
        int material = 0;
        std::uint64_t vertices = 0;
        std::uint64_t indices = 0;
        vec3 lower{0}, upper{0};  // exactly those of the positions that are written
        Producer write_positions, write_normals, write_indices;
    };
    int mesh(const std::string& name, std::vector<StreamedPart> parts);

    std::uint64_t triangles() const;  ///< of all nodes, meshes counted as often as they are used
    std::uint64_t bytes() const;      ///< of the binary chunk so far; the file adds its JSON
    /// One .glb. Throws Error where it would pass the container's 4 GiB.
    void write(const std::filesystem::path& path) const;

  private:
    struct Chunk {
        std::uint64_t bytes;
        Producer write;
    };
    int view(std::uint64_t bytes, int target, Producer write);
    template <class T>
    int stored(std::vector<T> values, int target);
    int accessor(int view, int component_type, const char* type, std::uint64_t count);
    void use(const char* extension);
    int append(const char* list, nlohmann::ordered_json value);
    int root_node(nlohmann::ordered_json value);

    nlohmann::ordered_json json_;
    std::vector<Chunk> chunks_;
    std::vector<std::uint64_t> mesh_triangles_;
    std::uint64_t triangles_ = 0;
    std::uint64_t bytes_ = 0;
};

}  // namespace halflight::scenes
