// Morph targets and skins (glTF 2.0, sections 3.7.2.2 and 3.7.3.3): vertices from where a file has them to where a pose
// puts them. Here on the CPU; engine/device/deform.h does the same on the GPU.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "engine/core/math.h"
#include "shaders/shared/deform.h"

namespace halflight {

/// What is moved of vertices. Normals and tangents are empty or as many as positions, tangents only where there are
/// normals. Of any length; w of tangents is the handedness.
struct VertexArrays {
    std::vector<vec3> positions;
    std::vector<vec3> normals;
    std::vector<vec4> tangents;
};

/// Differences by vertex, to be multiplied with the target's weight; each empty where the target has none, or where the
/// vertices have nothing that it could be added to.
struct MorphTarget {
    std::vector<vec3> positions;
    std::vector<vec3> normals;
    std::vector<vec3> tangents;
};

/// Four joints by vertex.
struct JointSet {
    std::vector<uvec4> joints;  // indices into Deformation::joints
    std::vector<vec4> weights;  // finite, >= 0, of any sum
};

/// Vertices as a file has them, which are read when they are asked for: always the same. What reading throws it throws.
class RestShape {
  public:
    virtual ~RestShape() = default;
    virtual std::size_t vertices() const = 0;
    virtual VertexArrays read() const = 0;
    virtual std::vector<JointSet> read_joints() const = 0;  ///< empty: nothing is skinned
    virtual std::size_t targets() const = 0;
    virtual MorphTarget read_target(std::size_t target) const = 0;
    /// Which arrays of read_target() will not be empty.
    struct Moved {
        bool positions = false;
        bool normals = false;
        bool tangents = false;
    };
    virtual Moved moved_by(std::size_t target) const = 0;
};

struct ActiveTarget {
    std::uint32_t target = 0;
    float weight = 0;  // any but 0
};

/// A shape in one pose: its targets are added up in their order, then it is moved by its joints.
struct Deformation {
    std::shared_ptr<const RestShape> rest;  // who moves it may keep it, to know it again
    std::vector<ActiveTarget> targets;      // ascending
    std::span<const dmat4> joints;  // affine; of shapes without sets of joints the first one moves all; empty: none
};

/// By the mean of a vertex's joints, weighted; by its first joint where no weight is positive. Normals go by cofactors,
/// with their side of mirrored surfaces kept.
VertexArrays deform(const Deformation& deformation);

/// Joints as shaders/shared/deform.h takes them.
std::vector<shared::JointMatrix> joint_matrices(std::span<const dmat4> joints);

/// Who deforms many shapes at once.
class Deformer {
  public:
    virtual ~Deformer() = default;
    /// Of each in its order what deform() gives, but for rounding: a function of the deformation alone, whatever was
    /// asked for before or with it.
    virtual std::vector<VertexArrays> deform(std::span<const Deformation> deformations) = 0;
};

}  // namespace halflight
