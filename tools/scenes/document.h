// A glTF 2.0 document and its binary container (glTF 2.0, sections 3 and 4). Equal calls give equal bytes.
//
// Mesh data is either in memory, or produced while the file is written. A producer is called once, in file order, so
// that memory stays bounded for files of any size.
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

inline constexpr int kNothing = -1;  ///< index for "no texture" and "no mesh"

/// A material of glTF and its KHR extensions. Only values that differ from glTF's defaults are written.
struct Material {
    std::string name;
    dvec3 color{1};  // base colour, linear Rec.709
    double metallic = 0;
    double roughness = 1;
    int color_texture = kNothing;
    int normal_texture = kNothing;
    int roughness_texture = kNothing;  // texture with G roughness, B metallic
    double normal_scale = 1;
    dvec3 emission{0};        // radiance, linear Rec.709, >= 0
    double alpha_cutoff = 0;  // 0: opaque
    bool double_sided = false;
    double specular = 1;
    double ior = 1.5;
    double clearcoat = 0;
    double clearcoat_roughness = 0;
    double transmission = 0;
};

/// Returns a purely diffuse material, the model that glTF, this project and Cycles share exactly.
Material matte(std::string name, const dvec3& color);
Material metal(std::string name, const dvec3& color, double roughness);
Material glossy(std::string name, const dvec3& color, double roughness);
Material light(std::string name, const dvec3& radiance);

/// A joint of a skeleton, the child of the joint before it; the first one is the child of the skeleton's node.
struct Joint {
    dvec3 offset{0};          // vector from the previous joint, in the mesh's bind pose (without rotations); metres
    std::vector<vec4> turns;  // rotations at the skeleton's `seconds`, quaternions x, y, z, w
};

/// A chain of joints, and the animation that turns them.
struct Skeleton {
    std::string name, animation;
    std::vector<Joint> joints;   // joints, at most 256
    std::vector<float> seconds;  // key times, ascending
};

class Document {
  public:
    explicit Document(const std::string& name);

    /// Adds an embedded texture and returns its index; `png` are the bytes of a PNG file.
    int texture(const std::string& name, std::string png);
    /// Adds a texture in a file beside the document, by its relative path.
    int texture_file(const std::string& name, const std::string& uri);
    int material(const Material& material);
    int mesh(const Mesh& mesh);
    /// Adds a named node under the root. `matrix` must be a translation, rotation and scale without shear.
    int node(const std::string& name, int mesh, const dmat4& matrix = dmat4(1));
    /// Adds a skinned mesh. The node of its skeleton has `matrix`, which must be a translation.
    int node(const std::string& name, int mesh, const Skeleton& skeleton, const dmat4& matrix);
    /// Adds instances of a mesh as one node with EXT_mesh_gpu_instancing; rotations are quaternions x, y, z, w.
    void instances(const std::string& name, int mesh, std::vector<vec3> translations, std::vector<vec4> rotations);
    /// Adds a camera with vertical_fov in degrees; aspect = width / height, 0: that of the picture.
    void camera(const std::string& name, const dvec3& from, const dvec3& at, double vertical_fov, double aspect);
    /// Adds a directional light; `toward` points from the scene to the sun, lux is the illuminance of a surface that
    /// faces it.
    void sun(const std::string& name, const dvec3& toward, const dvec3& color, double lux);
    /// Adds a light that shines down from `at`, candela, within `cone` degrees of the vertical; 180: in all directions.
    void lamp(const std::string& name, const dvec3& at, const dvec3& color, double candela, double cone);
    /// Adds constant radiance from all directions by this project's extension HALFLIGHT_environment; glTF has no
    /// environments.
    void sky(const dvec3& radiance);

    /// Writes the bytes of a mesh whose bounds and byte counts are known beforehand.
    using Producer = std::function<void(CheckedFile&)>;
    struct StreamedPart {
        int material = 0;
        std::uint64_t vertices = 0;
        std::uint64_t indices = 0;
        vec3 lower{0}, upper{0};  // exact bounds of the positions that are written
        Producer write_positions, write_normals, write_indices;
    };
    int mesh(const std::string& name, std::vector<StreamedPart> parts);

    int meshes() const { return static_cast<int>(mesh_triangles_.size()); }  ///< Returns the number of meshes.
    std::uint64_t triangles() const;  ///< Returns the triangles of all nodes; meshes count as often as they are used.
    std::uint64_t bytes() const;      ///< Returns the size of the binary chunk so far, without the file's JSON.
    /// Writes a .glb. Throws Error if it would exceed the container's 4 GiB.
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
    void add_sampler();
    int add_texture(nlohmann::ordered_json image);
    int root_node(nlohmann::ordered_json value);

    nlohmann::ordered_json json_;
    std::vector<Chunk> chunks_;
    std::vector<std::uint64_t> mesh_triangles_;
    std::uint64_t triangles_ = 0;
    std::uint64_t bytes_ = 0;
};

}  // namespace halflight::scenes
