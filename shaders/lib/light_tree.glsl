// Ways through the light tree (shaders/shared/light_tree.h). Needs shaders/scene_tables.glsl.
#include "shaders/shared/light_tree.h"
#include "shaders/shared/sobol.h"
#include "shaders/shared/word.h"

#ifdef HALFLIGHT_LIGHT_TREE
struct LightWay {
    uint light;         // that it ends at
    float probability;  // of it, among all lights of the tree; 0: it ends where no light reaches the receiver
};

float light_tree_importance(Receiver at, bool through, vec4 ball, vec4 cone, vec4 rest) {
    bool two_sided = (word_of_float(rest.w) & kLightTreeTwoSided) != 0u;
    return light_importance(LightNode(ball.xyz, ball.w, cone.xyz, cone.w, rest.x, rest.y, two_sided), at.position,
                            at.normal, through);
}

// The way of a trail, or, where that is not guided, one by `choice`, 32 uniform bits. One loop for both: choice and
// density of it come to the same bits.
//
// A uniform number is used again and again: what is left of it by a decision, put over the share that led there, is
// uniform and still stratified. It has 24 bits before and 24 fresh ones after its point; the lesser share lies at its
// low end, where all of them count, so that shares of 2^-40 are met as often as they should be.
LightWay light_way(Receiver at, bool guided, uint trail, uint choice) {
    const float kSteps = 16777216.0;
    LightWay way = LightWay(0u, 1.0);
    uint number = choice >> 8;
    uint fresh = choice;
    bool through = texelFetch(light_tree, 0).z != 0.0;
    int row = kLightTreeHeaderTexels;
    bool inner = true;
    while (inner) {
        vec4 rest0 = texelFetch(light_tree, row + 2);
        vec4 rest1 = texelFetch(light_tree, row + 5);
        float importance0 =
            light_tree_importance(at, through, texelFetch(light_tree, row), texelFetch(light_tree, row + 1), rest0);
        float importance1 =
            light_tree_importance(at, through, texelFetch(light_tree, row + 3), texelFetch(light_tree, row + 4), rest1);
        precise float total = importance0 + importance1;
        bool lesser_is_second = importance1 < importance0;
        precise float lesser = total > 0.0 ? min(importance0, importance1) / total : 0.0;

        fresh = hash_u32(fresh + 0x9e3779b9u);
        float place = float(number) + unit_float(fresh);
        float share = lesser * kSteps;
        bool takes_lesser = place < share;
        float left = takes_lesser ? place / share : (place - share) / (kSteps - share);
        number = min(uint(left * kSteps), 0xffffffu);

        bool second = guided ? (trail & 1u) != 0u : takes_lesser == lesser_is_second;
        trail >>= 1;
        precise float probability = second == lesser_is_second ? lesser : 1.0 - lesser;
        precise float all = way.probability * probability;
        way.probability = total > 0.0 ? all : 0.0;
        uint word = word_of_float(second ? rest1.w : rest0.w);
        uint index = word & kLightTreeIndexMask;
        inner = (word & kLightTreeLeaf) == 0u && way.probability > 0.0;
        way.light = index;
        row = kLightTreeHeaderTexels + int(index) * kLightTreePairTexels;
    }
    return way;
}

// By how much the tree raises the probability that the alias table gives the light (light_tree.h, header).
float light_tree_gain(LightWay way) { return 1.0 + texelFetch(light_tree, 0).x * way.probability; }
#endif
