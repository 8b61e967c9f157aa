// Moving vertices by joints (glTF 2.0, section 3.7.3.3), one copy for C++ and GLSL. It uses doubles, step by step and
// without contractions, so that both compute the same bits for a vertex, wherever joints are.
#pragma once

#include "shaders/shared/portable.h"

HALFLIGHT_SHARED_BEGIN

HALFLIGHT_SHARED_CONST int kJointTexels = 7;

// Least magnitude of a determinant over the sum of the magnitudes of its terms, 2^-40. Rounding can decide the sign of
// smaller ones, such as those of transforms with a scale of 0.
HALFLIGHT_SHARED_CONST double kLeastDeterminant = 1.0 / 1099511627776.0;

// The first three rows of a matrix whose last one is (0, 0, 0, 1), and the side of its joint.
struct JointMatrix {
    dvec4 x;
    dvec4 y;
    dvec4 z;
    dvec2 side;  // x: < 0 if the transform mirrors, scales of 0 taken as 1; weighted in sums. y: unused
};
HALFLIGHT_SHARED_SIZE(JointMatrix, 112)

HALFLIGHT_SHARED_FUNCTION JointMatrix add_joint(JointMatrix sum, double weight, JointMatrix joint) {
    HALFLIGHT_SHARED_PRECISE JointMatrix m;
    m.x = sum.x + weight * joint.x;
    m.y = sum.y + weight * joint.y;
    m.z = sum.z + weight * joint.z;
    m.side = sum.side + weight * joint.side;
    return m;
}

HALFLIGHT_SHARED_FUNCTION JointMatrix mean_joint(JointMatrix sum, double total) {
    HALFLIGHT_SHARED_PRECISE JointMatrix m;
    m.x = sum.x / total;
    m.y = sum.y / total;
    m.z = sum.z / total;
    m.side = sum.side / total;
    return m;
}

HALFLIGHT_SHARED_FUNCTION dvec3 joint_position(JointMatrix m, dvec3 p) {
    HALFLIGHT_SHARED_PRECISE double x = (m.x.x * p.x + m.x.y * p.y) + (m.x.z * p.z + m.x.w);
    HALFLIGHT_SHARED_PRECISE double y = (m.y.x * p.x + m.y.y * p.y) + (m.y.z * p.z + m.y.w);
    HALFLIGHT_SHARED_PRECISE double z = (m.z.x * p.x + m.z.y * p.y) + (m.z.z * p.z + m.z.w);
    return dvec3(x, y, z);
}

HALFLIGHT_SHARED_FUNCTION dvec3 joint_direction(JointMatrix m, dvec3 d) {
    HALFLIGHT_SHARED_PRECISE double x = m.x.x * d.x + m.x.y * d.y + m.x.z * d.z;
    HALFLIGHT_SHARED_PRECISE double y = m.y.x * d.x + m.y.y * d.y + m.y.z * d.z;
    HALFLIGHT_SHARED_PRECISE double z = m.z.x * d.x + m.z.y * d.y + m.z.z * d.z;
    return dvec3(x, y, z);
}

HALFLIGHT_SHARED_FUNCTION dvec3 exact_cross(dvec4 a, dvec4 b) {
    HALFLIGHT_SHARED_PRECISE double x = a.y * b.z - b.y * a.z;
    HALFLIGHT_SHARED_PRECISE double y = a.z * b.x - b.z * a.x;
    HALFLIGHT_SHARED_PRECISE double z = a.x * b.y - b.x * a.y;
    return dvec3(x, y, z);
}

// Cofactors of the linear part, which transform normals, also if the matrix cannot be inverted.
struct JointNormals {
    dvec3 x;  // rows of the cofactors
    dvec3 y;
    dvec3 z;
    double side;  // -1 if the matrix mirrors, otherwise 1
};

// Returns the determinant of the linear part, 0 if rounding can decide its sign. x: cofactors of the first row.
HALFLIGHT_SHARED_FUNCTION double joint_determinant(JointMatrix m, dvec3 x) {
    dvec4 a = abs(m.x);
    dvec4 b = abs(m.y);
    dvec4 c = abs(m.z);
    HALFLIGHT_SHARED_PRECISE double terms =
        a.x * (b.y * c.z + b.z * c.y) + a.y * (b.z * c.x + b.x * c.z) + a.z * (b.x * c.y + b.y * c.x);
    HALFLIGHT_SHARED_PRECISE double least = kLeastDeterminant * terms;
    HALFLIGHT_SHARED_PRECISE double determinant = m.x.x * x.x + m.x.y * x.y + m.x.z * x.z;
    return determinant > least || determinant < -least ? determinant : 0.0;
}

HALFLIGHT_SHARED_FUNCTION JointNormals joint_normals(JointMatrix m) {
    JointNormals n;
    n.x = exact_cross(m.y, m.z);
    n.y = exact_cross(m.z, m.x);
    n.z = exact_cross(m.x, m.y);
    double determinant = joint_determinant(m, n.x);
    n.side = (determinant == 0.0 ? m.side.x : determinant) < 0.0 ? -1.0 : 1.0;
    return n;
}

HALFLIGHT_SHARED_FUNCTION dvec3 joint_normal(JointNormals m, dvec3 n) {
    HALFLIGHT_SHARED_PRECISE double x = m.side * (m.x.x * n.x + m.x.y * n.y + m.x.z * n.z);
    HALFLIGHT_SHARED_PRECISE double y = m.side * (m.y.x * n.x + m.y.y * n.y + m.y.z * n.z);
    HALFLIGHT_SHARED_PRECISE double z = m.side * (m.z.x * n.x + m.z.y * n.y + m.z.z * n.z);
    return dvec3(x, y, z);
}

HALFLIGHT_SHARED_END
