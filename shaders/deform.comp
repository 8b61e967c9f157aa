// Moves vertices by morph targets and joints (engine/scene/deformer.h). Each invocation has one vertex.
#include "shaders/shared/joint_matrix.h"

const bool kJoints = HALFLIGHT_JOINTS != 0;  // joints move the vertices

layout(local_size_x = 64) in;

// Texture buffers of the vertices of one dispatch.
uniform samplerBuffer positions;  // RGB32F: rest positions
uniform samplerBuffer normals;    // RGB32F: rest normals
uniform samplerBuffer tangents;   // RGBA32F: rest tangents
uniform usamplerBuffer joints;    // RGBA32UI: four joints of each vertex, set after set
uniform samplerBuffer weights;    // RGBA32F: weights of the joints
uniform samplerBuffer deltas;     // RGB32F: slots of as many texels as there are vertices
uniform usamplerBuffer targets;   // RG32UI: slot, bits of the weight
uniform usamplerBuffer matrices;  // RGBA32UI: bits of JointMatrix, kJointTexels each

// Results: all positions, then all normals, then all tangents.
layout(std430) writeonly buffer Moved { float moved[]; };

uniform int vertices;
uniform int sets;          // number of joint sets
uniform int first_matrix;  // index of the matrix of joint 0
uniform ivec4 active_targets;  // texels of `targets`: first of positions, of normals, of tangents, end

vec3 morphed(vec3 value, int vertex, int first, int end) {
    precise vec3 sum = value;
    for (int i = first; i < end; ++i) {
        uvec2 target = texelFetch(targets, i).xy;
        sum += uintBitsToFloat(target.y) * texelFetch(deltas, int(target.x) * vertices + vertex).xyz;
    }
    return sum;
}

dvec4 matrix_row(int texel) {
    uvec4 a = texelFetch(matrices, texel);
    uvec4 b = texelFetch(matrices, texel + 1);
    return dvec4(packDouble2x32(a.xy), packDouble2x32(a.zw), packDouble2x32(b.xy), packDouble2x32(b.zw));
}

JointMatrix joint_matrix(uint joint) {
    int texel = kJointTexels * (first_matrix + int(joint));
    uvec4 side = texelFetch(matrices, texel + 6);
    return JointMatrix(matrix_row(texel), matrix_row(texel + 2), matrix_row(texel + 4),
                       dvec2(packDouble2x32(side.xy), packDouble2x32(side.zw)));
}

JointMatrix blend(int vertex) {
    if (sets == 0) return joint_matrix(0u);
    JointMatrix sum = JointMatrix(dvec4(0.0), dvec4(0.0), dvec4(0.0), dvec2(0.0));
    precise double total = 0.0;
    for (int set = 0; set < sets; ++set) {
        uvec4 which = texelFetch(joints, set * vertices + vertex);
        vec4 how_much = texelFetch(weights, set * vertices + vertex);
        for (int i = 0; i < 4; ++i) {
            if (how_much[i] <= 0.0) continue;
            sum = add_joint(sum, double(how_much[i]), joint_matrix(which[i]));
            total += double(how_much[i]);
        }
    }
    if (total > 0.0) return mean_joint(sum, total);
    return joint_matrix(texelFetch(joints, vertex).x);
}

void write(int place, vec3 value) {
    for (int axis = 0; axis < 3; ++axis) moved[place + axis] = value[axis];
}

void main() {
    int vertex = int(gl_GlobalInvocationID.x);
    if (vertex >= vertices) return;
    JointMatrix m;
    JointNormals of_normals;
    if (kJoints) {
        m = blend(vertex);
        of_normals = joint_normals(m);
    }
    vec3 position = morphed(texelFetch(positions, vertex).xyz, vertex, active_targets.x, active_targets.y);
    if (kJoints) position = vec3(joint_position(m, dvec3(position)));
    write(3 * vertex, position);
    if (HALFLIGHT_NORMALS != 0) {
        vec3 normal = morphed(texelFetch(normals, vertex).xyz, vertex, active_targets.y, active_targets.z);
        if (kJoints) normal = vec3(joint_normal(of_normals, dvec3(normal)));
        write(3 * (vertices + vertex), normal);
    }
    if (HALFLIGHT_TANGENTS != 0) {
        vec4 tangent = texelFetch(tangents, vertex);
        tangent.xyz = morphed(tangent.xyz, vertex, active_targets.z, active_targets.w);
        if (kJoints) tangent = vec4(vec3(joint_direction(m, dvec3(tangent.xyz))), float(of_normals.side) * tangent.w);
        write(6 * vertices + 4 * vertex, tangent.xyz);
        moved[6 * vertices + 4 * vertex + 3] = tangent.w;
    }
}
