// Light tree: which triangle, point or spot light to look at from a place, by bounds of what groups of them send there
// (Conty Estevez and Kulla 2018, Importance Sampling of Many Lights with Adaptive Tree Splitting; pbrt-v4, 12.6.3).
//
// Rows (UNIT_LIGHT_TREE, RGBA32F): texel 0 is a header, then kLightTreePairTexels for each pair of siblings, the root's
// children first, each of them as a LightNode:
//   header     gain, share, 1 where some surface transmits light and what is behind it counts, -
//   texel 0    centre, radius
//   texel 1    axis, cos_o
//   texel 2    cos_e, intensity, -, word
// The tree is asked for `share` of the choices, the alias table for the rest; gain is that share over the probability with
// which the table picks a light of the tree, which is the same for all of them. The word (word.h) has kLightTreeLeaf and the light, or the pair of its children; and kLightTreeTwoSided.
//
// A light's trail says how to come to it: bit d is 1 where the way leads to the second one of a pair after d steps. No
// way is longer than kLightTreeDepth, and there are two lights at least.
#ifndef HALFLIGHT_SHARED_LIGHT_TREE_H
#define HALFLIGHT_SHARED_LIGHT_TREE_H

#include "shaders/shared/light.h"
#include "shaders/shared/portable.h"

#ifdef __cplusplus
#include <cmath>
#endif

HALFLIGHT_SHARED_BEGIN

#ifdef __cplusplus
using std::sqrt;
#endif

HALFLIGHT_SHARED_CONST int kLightTreeHeaderTexels = 1;
HALFLIGHT_SHARED_CONST int kLightTreeNodeTexels = 3;
HALFLIGHT_SHARED_CONST int kLightTreePairTexels = 6;
HALFLIGHT_SHARED_CONST uint kLightTreeDepth = 26u;  // word.h's 29 bits without those of the kind
HALFLIGHT_SHARED_CONST uint kLightTreeLeaf = 0x10000000u;
HALFLIGHT_SHARED_CONST uint kLightTreeTwoSided = 0x08000000u;
HALFLIGHT_SHARED_CONST uint kLightTreeIndexMask = 0x07ffffffu;

// Bounds of a group of lights: a ball that holds them; a cone of half angle theta_o around the axis that holds their
// directions; light leaves at most theta_e from these.
struct LightNode {
    vec3 centre;      // relative to TraceTables::origin
    float radius;
    vec3 axis;        // unit
    float cos_o;      // cos(theta_o); -1: all directions
    float cos_e;      // cos(theta_e), theta_e <= pi/2
    float intensity;  // sum of the lights' greatest, over that of the brighter one of its pair
    bool two_sided;   // the axis goes both ways
};

// cos(max(a - b, 0)) for angles a and b in [0, pi], whose sines are given, too.
HALFLIGHT_SHARED_FUNCTION float cos_of_rest(float cos_a, float sin_a, float cos_b, float sin_b) {
    HALFLIGHT_SHARED_PRECISE float rest = cos_a * cos_b + sin_a * sin_b;
    return cos_a > cos_b ? 1.0f : rest;
}
HALFLIGHT_SHARED_FUNCTION float sine_of(float cosine) {
    HALFLIGHT_SHARED_PRECISE float square = 1.0f - cosine * cosine;
    return square > 0.0f ? sqrt(square) : 0.0f;
}

// What the lights of a node send to a place, up to a factor that is the same for both of a pair: 0 only where they send
// nothing. through: light from behind counts, too. pbrt-v4, 12.6.3: intensity times the greatest cosines that the ball
// allows, at the light and at the receiver, over the squared distance, which is not taken as less than the ball's radius.
// Precise, because what picks a light and what tells its density are compiled apart.
HALFLIGHT_SHARED_FUNCTION float light_importance(LightNode node, vec3 position, vec3 normal, bool through) {
    const float kLeastSquare = 1e-30f;
    // A lobe that does not follow the cosine lives at grazing angles, too.
    const float kGrazing = 0.05f;
    HALFLIGHT_SHARED_PRECISE vec3 to_node = node.centre - position;
    HALFLIGHT_SHARED_PRECISE float square = dot(to_node, to_node);
    HALFLIGHT_SHARED_PRECISE float ball = node.radius * node.radius;
    HALFLIGHT_SHARED_PRECISE vec3 direction = to_node / sqrt(square > kLeastSquare ? square : kLeastSquare);
    bool outside = square > ball;
    HALFLIGHT_SHARED_PRECISE float sine_square = outside ? ball / square : 0.0f;
    HALFLIGHT_SHARED_PRECISE float sin_u = sqrt(sine_square);
    HALFLIGHT_SHARED_PRECISE float cos_u = outside ? sqrt(1.0f - sine_square) : -1.0f;

    HALFLIGHT_SHARED_PRECISE float cos_axis = -dot(node.axis, direction);
    cos_axis = node.two_sided && cos_axis < 0.0f ? -cos_axis : cos_axis;
    HALFLIGHT_SHARED_PRECISE float cos_x = cos_of_rest(cos_axis, sine_of(cos_axis), node.cos_o, sine_of(node.cos_o));
    HALFLIGHT_SHARED_PRECISE float emitted = cos_of_rest(cos_x, sine_of(cos_x), cos_u, sin_u);

    HALFLIGHT_SHARED_PRECISE float cos_normal = dot(normal, direction);
    cos_normal = through && cos_normal < 0.0f ? -cos_normal : cos_normal;
    HALFLIGHT_SHARED_PRECISE float received = cos_of_rest(cos_normal, sine_of(cos_normal), cos_u, sin_u);
    received = received > 0.0f ? kGrazing + (1.0f - kGrazing) * received : 0.0f;

    HALFLIGHT_SHARED_PRECISE float far = square > ball ? square : ball;
    HALFLIGHT_SHARED_PRECISE float importance =
        node.intensity * emitted * received / (far > kLeastSquare ? far : kLeastSquare);
    return emitted >= node.cos_e && emitted > 0.0f ? importance : 0.0f;
}

HALFLIGHT_SHARED_END

#endif
