// Morph targets and skins (glTF 2.0, sections 3.7.2.2 and 3.7.3.3) deform the vertices of a file into those of a pose.
// This is the CPU implementation; engine/device/deform.h is the one on the GPU.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "engine/core/math.h"
#include "shaders/shared/joint_matrix.h"

namespace halflight {

/// Vertex attributes that a deformation changes. Normals and tangents are empty or as many as positions; tangents need
/// normals. Vectors have any length. The w of a tangent is its handedness.
struct VertexArrays {
    std::vector<vec3> positions;
    std::vector<vec3> normals;
    std::vector<vec4> tangents;
};

/// Differences per vertex, which the target's weight multiplies. An array is empty if the target lacks it, or if
/// the vertices have no such attribute.
struct MorphTarget {
    std::vector<vec3> positions;
    std::vector<vec3> normals;
    std::vector<vec3> tangents;
};

/// Four joints per vertex.
struct JointSet {
    std::vector<uvec4> joints;  // indices into Deformation::joints
    std::vector<vec4> weights;  // weights of the joints, finite, >= 0, of any sum
};

/// The undeformed vertices of a file. Each call reads them anew and returns the same values. All calls throw what
/// reading throws.
class RestShape {
  public:
    virtual ~RestShape() = default;
    virtual std::size_t vertices() const = 0;
    virtual VertexArrays read() const = 0;
    virtual std::vector<JointSet> read_joints() const = 0;  ///< Returns none if nothing is skinned.
    virtual std::size_t targets() const = 0;
    virtual MorphTarget read_target(std::size_t target) const = 0;
    /// Flags that tell which arrays of read_target() are not empty.
    struct Moved {
        bool positions = false;
        bool normals = false;
        bool tangents = false;
    };
    virtual Moved moved_by(std::size_t target) const = 0;
};

struct ActiveTarget {
    std::uint32_t target = 0;
    float weight = 0;  // factor of the target, not 0
};

/// The transform of a joint.
struct Joint {
    dmat4 matrix{1};  // affine
    double side = 1;  // -1 if the transform mirrors, otherwise 1. Scales of 0 in the matrix count as 1.
};

/// A shape in one pose. Targets are added in their order, then joints transform the sum.
struct Deformation {
    std::shared_ptr<const RestShape> rest;  // the shape at rest, which a Deformer may keep
    std::vector<ActiveTarget> targets;      // active targets by ascending index
    std::span<const Joint> joints;          // without joint sets the first one moves all vertices; empty: none
};

/// Returns the deformed vertices. A vertex is transformed by the weighted mean of its joints, or by its first joint
/// if no weight is positive. Normals are transformed by cofactors and keep their side of mirrored surfaces.
VertexArrays deform(const Deformation& deformation);

/// Returns -1 for vertices that their joints mirror, otherwise 1. A mean of joints can mirror even if no joint does,
/// such as that of two opposite turns. Returns none if no vertex can be mirrored.
std::vector<float> sides_of(const Deformation& deformation);

/// Returns the determinant of the linear part of an affine matrix, 0 if rounding can decide its sign.
double determinant_of(const dmat4& matrix);

/// Returns a joint in the layout of shaders/shared/joint_matrix.h.
shared::JointMatrix joint_matrix(const Joint& joint);
std::vector<shared::JointMatrix> joint_matrices(std::span<const Joint> joints);

/// Interface that deforms many shapes at once.
class Deformer {
  public:
    virtual ~Deformer() = default;
    /// Returns the results of the free function deform() in the same order, up to rounding. A result depends on its
    /// deformation alone, not on earlier calls or on the other deformations.
    virtual std::vector<VertexArrays> deform(std::span<const Deformation> deformations) = 0;
};

}  // namespace halflight
