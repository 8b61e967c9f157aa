// Traversals of the light tree (shaders/shared/light_tree_rows.h). Needs shaders/scene_tables.glsl.
#include "shaders/shared/light_tree_rows.h"
#include "shaders/shared/sobol.h"

const bool kLightTree = HALFLIGHT_LIGHT_TREE != 0;

LightTreeHeader light_tree_header() {
    uvec4 row = texelFetch(light_tree, 0);
    return LightTreeHeader(uintBitsToFloat(row.x), uintBitsToFloat(row.y), row.z, row.w);
}

struct LightWay {
    uint light;         // selected light
    float probability;  // probability of the light among all of the tree; 0: no light of this path reaches the receiver
    uint rest;          // 32 uniform bits that the selection leaves, still stratified
};

// State of a traversal.
struct LightWalk {
    bool guided;
    uint trail;         // remaining bits of a guided traversal
    uint number;        // 24 uniform bits
    uint fresh;         // hash state for further random bits
    float probability;  // probability of the decisions so far
};

// Returns whether the second of two children is selected.
//
// A uniform number is reused: the rest of it after a decision, divided by the selected share, is uniform and still
// stratified. It has 24 bits before and 24 fresh bits after its binary point. The smaller share is at its low end,
// where all bits count, so that shares of 2^-40 are selected with the right frequency.
bool takes_second(inout LightWalk walk, float first, float second, bool guide) {
    const float kSteps = 16777216.0;
    precise float total = first + second;
    bool lesser_is_second = second < first;
    precise float lesser = total > 0.0 ? min(first, second) / total : 0.0;

    walk.fresh = hash_u32(walk.fresh + 0x9e3779b9u);
    float place = float(walk.number) + unit_float(walk.fresh);
    float share = lesser * kSteps;
    bool takes_lesser = place < share;
    float left = takes_lesser ? place / share : (place - share) / (kSteps - share);
    walk.number = min(uint(left * kSteps), 0xffffffu);

    bool taken = walk.guided ? guide : takes_lesser == lesser_is_second;
    precise float probability = taken == lesser_is_second ? lesser : 1.0 - lesser;
    precise float all = walk.probability * probability;
    walk.probability = total > 0.0 ? all : 0.0;
    return taken;
}

// Follows a trail if guided, otherwise traverses by `choice`, 32 uniform bits. Both use one loop, so that selection and
// density have equal bits.
LightWay light_way(Receiver at, bool guided, uint trail, uint choice) {
    LightWalk walk = LightWalk(guided, trail, choice >> 8, choice, 1.0);
    LightTreeHeader header = light_tree_header();
    bool through = header.through != 0u;
    vec4 ball = uintBitsToFloat(texelFetch(light_tree, 1));
    uint node = 0u, child = 0u, word = 0u, next = 0u;
    bool inner = true;
    while (inner) {
        node = next;
        int row = kLightTreeHeaderTexels + int(node) * kLightTreeWidth;
        uvec4 row0 = texelFetch(light_tree, row);
        uvec4 row1 = texelFetch(light_tree, row + 1);
        uvec4 row2 = texelFetch(light_tree, row + 2);
        uvec4 row3 = texelFetch(light_tree, row + 3);
        LightNode node0 = light_child(row0, ball);
        LightNode node1 = light_child(row1, ball);
        LightNode node2 = light_child(row2, ball);
        LightNode node3 = light_child(row3, ball);
        float importance0 = light_importance(node0, at.position, at.normal, through);
        float importance1 = light_importance(node1, at.position, at.normal, through);
        float importance2 = light_importance(node2, at.position, at.normal, through);
        float importance3 = light_importance(node3, at.position, at.normal, through);
        precise float first_two = importance0 + importance1;
        precise float last_two = importance2 + importance3;
        bool upper = takes_second(walk, first_two, last_two, (walk.trail & 2u) != 0u);
        bool odd = takes_second(walk, upper ? importance2 : importance0, upper ? importance3 : importance1,
                                (walk.trail & 1u) != 0u);
        walk.trail >>= 2;
        child = (upper ? 2u : 0u) + (odd ? 1u : 0u);
        word = upper ? (odd ? row3.w : row2.w) : (odd ? row1.w : row0.w);
        inner = (word & kLightTreeLeaf) == 0u && walk.probability > 0.0;
        vec4 ball0 = vec4(node0.centre, node0.radius), ball1 = vec4(node1.centre, node1.radius);
        vec4 ball2 = vec4(node2.centre, node2.radius), ball3 = vec4(node3.centre, node3.radius);
        ball = upper ? (odd ? ball3 : ball2) : (odd ? ball1 : ball0);
        next = (row0.w & kLightTreeLinkMask) + ((row1.w & kLightTreeLinkMask) << kLightTreeLinkBits) + child;
    }
    bool pair = (word & kLightTreePair) != 0u;
    bool second = pair && (guided ? (walk.trail & 1u) != 0u : walk.number >= 0x800000u);
    uint rest = (walk.number << (pair ? 9 : 8)) | (walk.fresh & 0xffu);
    uint light = texelFetch(light_tree, int(header.names + 2u * node + (second ? 1u : 0u)))[child];
    return LightWay(light, pair ? 0.5 * walk.probability : walk.probability, rest);
}

// Returns about the illuminance that all lights of the tree give a receiver if nothing is in between, lux.
float light_tree_illuminance(Receiver at) {
    bool through = light_tree_header().through != 0u;
    vec4 ball = uintBitsToFloat(texelFetch(light_tree, 1));
    precise float sum = 0.0;
    for (int k = 0; k < kLightTreeWidth; ++k) {
        LightNode node = light_child(texelFetch(light_tree, kLightTreeHeaderTexels + k), ball);
        sum += light_importance(node, at.position, at.normal, through);
    }
    precise float all = sum * uintBitsToFloat(texelFetch(light_tree, 2).x);
    return all;
}
