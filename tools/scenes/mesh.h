// Meshes of the scene generators. Vertices are double and rounded to float once, by the writer.
// Space: right-handed, +Y up, metres. Triangles are counter-clockwise seen from outside.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "engine/core/math.h"

namespace halflight::scenes {

struct Vertex {
    dvec3 position{0};
    dvec3 normal{0};  // unit vector
    dvec2 uv{0};      // texture coordinates; v grows downwards from the texture's top row
};

/// Up to four joints that a vertex of a skinned mesh follows, as indices into the skeleton; weights add up to 1.
struct Influence {
    ivec4 joints{0};
    vec4 weights{0};
};

/// The triangles of one mesh that share a material (a glTF primitive).
struct Part {
    int material = 0;  // index in the document that the mesh is added to
    std::vector<Vertex> vertices;
    std::vector<Influence> influences;   // one per vertex; empty without a skeleton
    std::vector<std::uint32_t> indices;  // three per triangle
};

struct Mesh {
    std::string name;
    std::vector<Part> parts;  // in order of first use

    std::size_t triangles() const;
};

/// Builds one mesh. Everything that is added gets the current material and is transformed by the current frame.
class MeshBuilder {
  public:
    explicit MeshBuilder(std::string name) { mesh_.name = std::move(name); }

    MeshBuilder& material(int index);
    /// Sets the affine transform from object to mesh; a mirroring one reverses triangles, so that fronts stay outside.
    MeshBuilder& frame(const dmat4& matrix);
    const dmat4& frame() const { return frame_; }  ///< Returns the transform that frame() has set.
    /// Sets the metres of surface that one repeat of the texture covers, for shapes that derive uv from their size.
    MeshBuilder& texel_size(double metres);

    /// Adds a vertex of the current material's part, and returns its index for triangle().
    std::uint32_t vertex(const Vertex& v);
    void triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c);

    /// Adds a flat quadrilateral, corners counter-clockwise from the front; uv in metres, upright on upright faces.
    void quad(const dvec3& a, const dvec3& b, const dvec3& c, const dvec3& d);
    /// Adds a flat quadrilateral with uv (0,1) (1,1) (1,0) (0,0): the whole texture, with a at its lower left corner.
    void picture(const dvec3& a, const dvec3& b, const dvec3& c, const dvec3& d);
    /// Sides of a box that are left out because they are never visible.
    enum Sides : unsigned { kNoSide = 0, kLeft = 1, kRight = 2, kBottom = 4, kTop = 8, kBack = 16, kFront = 32 };
    void box(const dvec3& lower, const dvec3& upper, unsigned without = kNoSide);
    /// Adds a box of any eight corners, ordered as bits: 1 for +x, 2 for +y, 4 for +z.
    void hexahedron(const dvec3 (&corners)[8], unsigned without = kNoSide);

    Mesh take() { return std::move(mesh_); }

  private:
    Part& part();

    Mesh mesh_;
    int material_ = 0;
    std::size_t current_ = ~std::size_t{0};
    dmat4 frame_{1};
    dmat3 normal_frame_{1};
    bool mirrored_ = false;
    double texel_size_ = 1;
};

dmat4 move(double x, double y, double z);
dmat4 turn_y(double degrees);  ///< Returns a rotation, exact for multiples of 90.
dmat4 turn_x(double degrees);
dmat4 turn_z(double degrees);
dmat4 grow(double x, double y, double z);

}  // namespace halflight::scenes
