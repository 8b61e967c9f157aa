// Light tree: selects triangle, point and spot lights for a receiver, by bounds of the contributions of light groups
// (Conty Estevez and Kulla 2018, Importance Sampling of Many Lights with Adaptive Tree Splitting; pbrt-v4, 12.6.3).
//
// Rows (kUnitLightTree, RGBA32UI):
//   LightTreeHeader
//   the root's ball as bits of floats: centre and radius
//   the intensity of the root's brightest child as bits of a float, cd; then unused words
//   an unused texel
//   per node, the root first: kLightTreeWidth texels, one per child (64 bytes, a line of most caches)
//   per node, from LightTreeHeader::names on: two texels. The first holds the lights of children that are leaves, the
//       second the other lights of pairs. Each light of a pair has half of the leaf's probability. Of a child that is
//       an inner node, the second texel has 1 if some light below it has a radius, else 0.
//
// A texel describes child k of a node with the ball (c, r). Values are rounded so that the lights stay inside, like in
// pbrt-v4's CompactLightBounds (12.6.3), here inside the ball:
//   x          16 bits each for the centre's x and y: 0 is c - r, 2^15 is c
//   y          16 bits for its z, 16 for its radius: 2^15 is r
//   z          8 bits each for u and v of the axis in an octahedral map (Meyer et al. 2010, On Floating-Point Normal
//              Vectors): 0 is -1, 254 is 1; for sin(theta_o / 2) and cos(theta_e): 255 is 1
//   w          kLightTreeLinkBits of a link, kLightTreePair, kLightTreeLeaf, kLightTreeTwoSided; the upper half of a
//              float's bits: the intensity
// The links of children 0 and 1 are the lower and the upper bits of child 0's node. The nodes of the next children
// follow it; leaves come after inner nodes. A missing child has kLightTreeNone as its w.
//
// The tree and the environment make `share` of the selections, the alias table makes the rest. A light's trail is its
// path: bits 2 d and 2 d + 1 are the child taken after d steps, and the bit above those of a pair selects one of its
// lights. No trail has more than kLightTreeDepth bits.
#pragma once

#include "shaders/shared/light.h"
#include "shaders/shared/ordered_dot.h"
#include "shaders/shared/portable.h"

HALFLIGHT_SHARED_BEGIN

HALFLIGHT_SHARED_CONST int kLightTreeHeaderTexels = 4;
HALFLIGHT_SHARED_CONST int kLightTreeWidth = 4;
HALFLIGHT_SHARED_CONST uint kLightTreeDepth = 26u;  // bits of a word (word.h) that the kind leaves
HALFLIGHT_SHARED_CONST uint kLightTreeLinkBits = 13u;
HALFLIGHT_SHARED_CONST uint kLightTreeLinkMask = 0x1fffu;
HALFLIGHT_SHARED_CONST uint kLightTreePair = 0x2000u;
HALFLIGHT_SHARED_CONST uint kLightTreeLeaf = 0x4000u;
HALFLIGHT_SHARED_CONST uint kLightTreeTwoSided = 0x8000u;
HALFLIGHT_SHARED_CONST uint kLightTreeNone = 0x5fffu;  // a leaf of intensity 0

struct LightTreeHeader {
    float gain;    // `share` over the probability with which the alias table picks each light of the tree
    float share;   // share of the selections, with those of the environment (environment_share())
    uint through;  // 1 if some surface transmits light, so that light from behind counts
    uint names;    // first texel of the leaves' lights
};
HALFLIGHT_SHARED_SIZE(LightTreeHeader, 16)

// Bounds of a group of lights: a ball around them, and a cone of half angle theta_o around the axis that contains their
// directions. Light leaves at most theta_e away from these.
struct LightNode {
    vec3 centre;  // centre relative to TraceTables::origin
    float radius;
    vec3 axis;    // axis of the cone, unit length
    float cos_o;  // cos(theta_o); -1: all directions
    float sin_o;
    float cos_e;      // cos(theta_e), theta_e <= pi/2
    float intensity;  // sum of the lights' maxima, relative to that of the brightest child of the node
    bool two_sided;   // true: light also leaves along the reversed axis
};

// Returns cos(max(a - b, 0)) for angles a and b in [0, pi], given with their sines.
HALFLIGHT_SHARED_FUNCTION float cos_of_rest(float cos_a, float sin_a, float cos_b, float sin_b) {
    HALFLIGHT_SHARED_PRECISE float rest = cos_a * cos_b + sin_a * sin_b;
    return cos_a > cos_b ? 1.0f : rest;
}
HALFLIGHT_SHARED_FUNCTION float sine_of(float cosine) {
    HALFLIGHT_SHARED_PRECISE float square = 1.0f - cosine * cosine;
    return square > 0.0f ? sqrt(square) : 0.0f;
}

// Unpacks a child of a node with the given ball: centre, radius. A missing child has intensity 0.
HALFLIGHT_SHARED_FUNCTION LightNode light_child(uvec4 child, vec4 ball) {
    const float kPlace = 1.0f / 32768.0f, kMap = 1.0f / 127.0f, kCone = 1.0f / 255.0f;
    HALFLIGHT_SHARED_PRECISE vec3 place =
        vec3(float(child.x & 0xffffu), float(child.x >> 16), float(child.y & 0xffffu)) * kPlace - vec3(1.0f);
    HALFLIGHT_SHARED_PRECISE vec3 centre = place * ball.w + vec3(ball.x, ball.y, ball.z);
    HALFLIGHT_SHARED_PRECISE float radius = float(child.y >> 16) * kPlace * ball.w;

    HALFLIGHT_SHARED_PRECISE float u = (float(child.z & 0xffu) - 127.0f) * kMap;
    HALFLIGHT_SHARED_PRECISE float v = (float((child.z >> 8) & 0xffu) - 127.0f) * kMap;
    HALFLIGHT_SHARED_PRECISE float z = 1.0f - abs(u) - abs(v);
    HALFLIGHT_SHARED_PRECISE float fold = z < 0.0f ? z : 0.0f;
    HALFLIGHT_SHARED_PRECISE float x = u < 0.0f ? u - fold : u + fold;
    HALFLIGHT_SHARED_PRECISE float y = v < 0.0f ? v - fold : v + fold;
    HALFLIGHT_SHARED_PRECISE float scale = 1.0f / sqrt(x * x + y * y + z * z);
    HALFLIGHT_SHARED_PRECISE vec3 axis = vec3(x, y, z) * scale;
    HALFLIGHT_SHARED_PRECISE float half_sine = float((child.z >> 16) & 0xffu) * kCone;
    HALFLIGHT_SHARED_PRECISE float cos_o = 1.0f - 2.0f * half_sine * half_sine;
    HALFLIGHT_SHARED_PRECISE float sin_o = 2.0f * half_sine * sine_of(half_sine);
    HALFLIGHT_SHARED_PRECISE float cos_e = float(child.z >> 24) * kCone;

    LightNode node;
    node.centre = centre;
    node.radius = radius;
    node.axis = axis;
    node.cos_o = cos_o;
    node.sin_o = sin_o;
    node.cos_e = cos_e;
    node.intensity = uintBitsToFloat(child.w & 0xffff0000u);
    node.two_sided = (child.w & kLightTreeTwoSided) != 0u;
    return node;
}

// Returns the importance of a node's lights for a receiver, up to a factor common to the children of a node. It is 0
// only if they contribute nothing. If `through` is set, light from behind counts, too.
//
// By pbrt-v4, 12.6.3, it is the intensity times the largest cosines that the ball allows, at the light and at the
// receiver. This is divided by the squared distance, or by the ball's squared radius if that is larger. The code is
// precise, because selection and density are compiled separately.
HALFLIGHT_SHARED_FUNCTION float light_importance(LightNode node, vec3 position, vec3 normal, bool through) {
    const float kLeastSquare = 1e-30f;
    // Lobes that do not follow the cosine contribute at grazing angles, too.
    const float kGrazing = 0.05f;
    HALFLIGHT_SHARED_PRECISE vec3 to_node = node.centre - position;
    HALFLIGHT_SHARED_PRECISE float square = ordered_dot(to_node, to_node);
    HALFLIGHT_SHARED_PRECISE float ball = node.radius * node.radius;
    HALFLIGHT_SHARED_PRECISE float near = 1.0f / sqrt(square > kLeastSquare ? square : kLeastSquare);
    bool outside = square > ball;
    // The cone around the ball has the half angle u. It holds all directions for a receiver inside.
    HALFLIGHT_SHARED_PRECISE float sin_u = outside ? node.radius * near : 0.0f;
    HALFLIGHT_SHARED_PRECISE float cos_u = outside ? sine_of(sin_u) : -1.0f;

    HALFLIGHT_SHARED_PRECISE float cos_axis = -ordered_dot(node.axis, to_node) * near;
    cos_axis = node.two_sided && cos_axis < 0.0f ? -cos_axis : cos_axis;
    HALFLIGHT_SHARED_PRECISE float cos_reach = node.cos_o * cos_u - node.sin_o * sin_u;  // cosine of theta_o + u
    HALFLIGHT_SHARED_PRECISE float sin_reach = node.sin_o * cos_u + node.cos_o * sin_u;  // below 0 from pi on
    HALFLIGHT_SHARED_PRECISE float emitted = cos_of_rest(cos_axis, sine_of(cos_axis), cos_reach, sin_reach);
    emitted = outside && sin_reach >= 0.0f ? emitted : 1.0f;

    HALFLIGHT_SHARED_PRECISE float cos_normal = ordered_dot(normal, to_node) * near;
    cos_normal = through && cos_normal < 0.0f ? -cos_normal : cos_normal;
    HALFLIGHT_SHARED_PRECISE float received = cos_of_rest(cos_normal, sine_of(cos_normal), cos_u, sin_u);
    received = received > 0.0f ? kGrazing + (1.0f - kGrazing) * received : 0.0f;

    HALFLIGHT_SHARED_PRECISE float far = square > ball ? square : ball;
    HALFLIGHT_SHARED_PRECISE float importance =
        node.intensity * emitted * received / (far > kLeastSquare ? far : kLeastSquare);
    return emitted >= node.cos_e && emitted > 0.0f ? importance : 0.0f;
}

HALFLIGHT_SHARED_END
