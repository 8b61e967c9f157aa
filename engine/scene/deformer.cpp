#include "engine/scene/deformer.h"

namespace halflight {
namespace {

template <class V>
void add(std::vector<V>& values, const std::vector<vec3>& deltas, float weight) {
    for (std::size_t i = 0; i < deltas.size(); ++i)
        for (int axis = 0; axis < 3; ++axis) values[i][axis] += weight * deltas[i][axis];
}

shared::JointMatrix blend(const std::vector<JointSet>& sets, const std::vector<shared::JointMatrix>& joints,
                          std::size_t vertex) {
    if (sets.empty()) return joints[0];
    shared::JointMatrix sum{dvec4(0), dvec4(0), dvec4(0), dvec2(0)};
    double total = 0;
    for (const JointSet& set : sets) {
        for (int i = 0; i < 4; ++i) {
            const double weight = set.weights[vertex][i];
            if (weight <= 0) continue;
            sum = shared::add_joint(sum, weight, joints[set.joints[vertex][i]]);
            total += weight;
        }
    }
    return total > 0 ? shared::mean_joint(sum, total) : joints[sets[0].joints[vertex].x];
}

}  // namespace

shared::JointMatrix joint_matrix(const Joint& joint) {
    const dmat4 rows = glm::transpose(joint.matrix);
    return {rows[0], rows[1], rows[2], dvec2(joint.side, 0)};
}

std::vector<shared::JointMatrix> joint_matrices(std::span<const Joint> joints) {
    std::vector<shared::JointMatrix> matrices;
    matrices.reserve(joints.size());
    for (const Joint& joint : joints) matrices.push_back(joint_matrix(joint));
    return matrices;
}

double determinant_of(const dmat4& matrix) {
    const shared::JointMatrix m = joint_matrix({matrix, 1});
    return shared::joint_determinant(m, shared::exact_cross(m.y, m.z));
}

std::vector<float> sides_of(const Deformation& deformation) {
    std::vector<float> sides;
    if (deformation.joints.empty()) return sides;
    const std::vector<JointSet> sets = deformation.rest->read_joints();
    if (sets.empty() && deformation.joints[0].side > 0) return sides;
    const std::vector<shared::JointMatrix> joints = joint_matrices(deformation.joints);
    sides.reserve(deformation.rest->vertices());
    for (std::size_t i = 0; i < deformation.rest->vertices(); ++i)
        sides.push_back(static_cast<float>(shared::joint_normals(blend(sets, joints, i)).side));
    return sides;
}

VertexArrays deform(const Deformation& deformation) {
    VertexArrays v = deformation.rest->read();
    for (const ActiveTarget& active : deformation.targets) {
        const MorphTarget target = deformation.rest->read_target(active.target);
        add(v.positions, target.positions, active.weight);
        add(v.normals, target.normals, active.weight);
        add(v.tangents, target.tangents, active.weight);
    }
    if (deformation.joints.empty()) return v;
    const std::vector<shared::JointMatrix> joints = joint_matrices(deformation.joints);
    const std::vector<JointSet> sets = deformation.rest->read_joints();
    for (std::size_t i = 0; i < v.positions.size(); ++i) {
        const shared::JointMatrix m = blend(sets, joints, i);
        v.positions[i] = vec3(shared::joint_position(m, v.positions[i]));
        if (v.normals.empty()) continue;
        const shared::JointNormals normals = shared::joint_normals(m);
        v.normals[i] = vec3(shared::joint_normal(normals, v.normals[i]));
        if (v.tangents.empty()) continue;
        vec4& tangent = v.tangents[i];
        tangent = vec4(shared::joint_direction(m, vec3(tangent)), static_cast<float>(normals.side) * tangent.w);
    }
    return v;
}

}  // namespace halflight
