// A common shader ray tracer, as a baseline: a binary tree of boxes and the triangles are in storage buffers. One thread
// per ray, in the order of the picture's rows, traverses the tree with a stack, near child first (if-if of Aila and
// Laine 2009). Triangles are intersected by the method of Moeller and Trumbore 1997. Like most such tracers it is
// neither watertight nor written for software drivers.
//
// HALFLIGHT_TWO_LEVEL: the root belongs to a tree over instances, each of which names the root of its block.
#include "shaders/shared/frame_block.h"
#include "shaders/geometry_tables.glsl"
#include "shaders/scene_tables.glsl"
#include "shaders/lib/alpha.glsl"
#include "shaders/lib/alpha_sampler.glsl"
#include "shaders/lib/batch_answers.glsl"
#include "shaders/lib/batch_paths.glsl"
#include "shaders/lib/node_format.glsl"

layout(local_size_x = 64) in;

struct Node {
    vec3 lower;
    uint first;  // inner node: first of two adjacent children; leaf: first triangle, or instance
    vec3 upper;
    uint count;  // triangles of a leaf; 0: inner node
};
struct Triangle {
    vec3 corner;
    uint id;
    vec3 edge1;
    uint alpha_tested;
    vec3 edge2;
    uint unused;
};
struct Instance {
    vec4 rows[3];  // transform from world to block space
    uint root;
    uint unused1;
    uint unused2;
    uint unused3;
};

layout(std430) readonly buffer Nodes { Node nodes[]; };
layout(std430) readonly buffer Triangles { Triangle triangles[]; };
layout(std430) readonly buffer Instances { Instance instances[]; };
layout(std430) readonly buffer Rays { Ray rays[]; };
OPTIONAL(HALFLIGHT_ALPHA) layout(std140) uniform FrameBlock { Frame frame; };
uniform uint alpha_salt;
uniform uint root;

#define INFINITE uintBitsToFloat(0x7f800000u)  // no constant: compilers differ in whether this is one
const uint kLeaveBlock = 0xffffffffu;

// Returns the distance at which the ray enters the box; INFINITE: a miss.
float enter_box(vec3 origin, vec3 inverse, uint node, float t_min, float t_max) {
    vec3 a = (nodes[node].lower - origin) * inverse;
    vec3 b = (nodes[node].upper - origin) * inverse;
    vec3 near = min(a, b);
    vec3 far = max(a, b);
    float enter = max(max(near.x, near.y), max(near.z, t_min));
    float leave = min(min(far.x, far.y), min(far.z, t_max));
    return enter <= leave ? enter : INFINITE;
}

void main() {
    uint entry = gl_GlobalInvocationID.x;
    if (entry >= entry_count()) return;
    uint index = path_of(entry);
    Ray ray = rays[index];
    Hit hit = Hit(ray.t_max, 0.0, 0.0, kMiss, kMiss);
    vec3 origin = ray.origin;
    vec3 direction = ray.direction;
    vec3 inverse = 1.0 / direction;
    uint instance = 0u;
    bool in_block = !kTwoLevel;

    uint stack[64];
    int size = 0;
    uint node = root;
    bool running = ray.t_max >= ray.t_min;
    while (running) {
        bool pop = false;
        if (kTwoLevel && node == kLeaveBlock) {
            in_block = false;
            origin = ray.origin;
            direction = ray.direction;
            inverse = 1.0 / direction;
            pop = true;
        } else if (nodes[node].count == 0u) {
            uint near = nodes[node].first;
            uint far = near + 1u;
            float near_t = enter_box(origin, inverse, near, ray.t_min, hit.t);
            float far_t = enter_box(origin, inverse, far, ray.t_min, hit.t);
            if (far_t < near_t) {
                uint n = near;
                near = far;
                far = n;
                float t = near_t;
                near_t = far_t;
                far_t = t;
            }
            if (near_t < INFINITE) {
                node = near;
                if (far_t < INFINITE) stack[size++] = far;
            } else {
                pop = true;
            }
        } else if (kTwoLevel && !in_block) {
            instance = nodes[node].first;
            Instance i = instances[instance];
            origin = vec3(dot(i.rows[0], vec4(ray.origin, 1.0)), dot(i.rows[1], vec4(ray.origin, 1.0)),
                          dot(i.rows[2], vec4(ray.origin, 1.0)));
            direction = vec3(dot(i.rows[0].xyz, ray.direction), dot(i.rows[1].xyz, ray.direction),
                             dot(i.rows[2].xyz, ray.direction));
            inverse = 1.0 / direction;
            in_block = true;
            stack[size++] = kLeaveBlock;
            node = i.root;
        } else {
            uint first = nodes[node].first;
            uint end = first + nodes[node].count;
            for (uint k = first; k < end; ++k) {
                vec3 edge1 = triangles[k].edge1;
                vec3 edge2 = triangles[k].edge2;
                vec3 p = cross(direction, edge2);
                float inverse_determinant = 1.0 / dot(edge1, p);
                vec3 from_corner = origin - triangles[k].corner;
                float u = dot(from_corner, p) * inverse_determinant;
                vec3 q = cross(from_corner, edge1);
                float v = dot(direction, q) * inverse_determinant;
                float t = dot(edge2, q) * inverse_determinant;
                bool nearer = u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > ray.t_min && t < hit.t;
                if (HALFLIGHT_ALPHA != 0 && nearer && triangles[k].alpha_tested != 0u) {
                    Sampler random = alpha_sampler_of_path(frame, index, alpha_salt);
                    nearer = alpha_accept(triangles[k].id, triangles[k].id, instance, u, v, random);
                }
                if (nearer) hit = Hit(t, u, v, triangles[k].id, instance);
            }
            pop = true;
        }
        if (kAnyHit && hit.triangle != kMiss) running = false;
        if (pop) {
            if (size > 0) {
                node = stack[--size];
            } else {
                running = false;
            }
        }
    }
    if (hit.triangle == kMiss) hit.t = INFINITE;
    store_answer(index, hit);
}
