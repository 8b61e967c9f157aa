#include "engine/rays/page_node.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>

namespace halflight::rays {
namespace {

constexpr std::uint32_t kCells = 255;
constexpr int kExponentBias = 127;

float side_of(std::uint32_t exponent) {
    return std::bit_cast<float>(exponent << 23);
}

double decode(float base, std::uint32_t cells, float side) {
    return base + cells * double{side};
}

/// Returns the exponent of the smallest cell with which kCells cells span the interval, as bits of a float. Cells are
/// at least as large as the steps of float at the ends of the interval.
std::uint32_t exponent_of(float lower, float upper) {
    const double extent = double{upper} - lower;
    const double least = std::max(double{std::abs(lower)}, double{std::abs(upper)}) * 0x1p-23;
    const double side = std::max(extent / kCells, least);
    int exponent = side > 0 ? std::ilogb(side) : -kExponentBias;
    if (std::ldexp(1.0, exponent) < side) ++exponent;
    auto biased = static_cast<std::uint32_t>(std::clamp(exponent + kExponentBias, 1, 254));
    while (biased < 254 && decode(lower, kCells, side_of(biased)) < upper) ++biased;
    return biased;
}

}  // namespace

PageNode encode_page_node(const BvhNode& node) {
    Bounds all;
    for (const BvhChild& child : node.children)
        if (!child.bounds.empty()) all.add(child.bounds);
    if (all.empty()) all = {vec3(0), vec3(0)};
    PageNode texels{};
    for (int a = 0; a < 3; ++a) {
        const float base = all.lower[a];
        const std::uint32_t exponent = exponent_of(base, all.upper[a]);
        const float side = side_of(exponent);
        texels[0][a] = std::bit_cast<std::uint32_t>(base);
        texels[0].w |= exponent << (8 * a);
        std::uint32_t lower = 0, upper = 0;
        for (int k = 0; k < 4; ++k) {
            const Bounds& box = node.children[static_cast<std::size_t>(k)].bounds;
            std::uint32_t l = kCells, u = 0;
            if (!box.empty()) {
                const double inverse = 1.0 / side;
                l = static_cast<std::uint32_t>(
                    std::clamp((double{box.lower[a]} - base) * inverse, 0.0, double{kCells}));
                while (l > 0 && decode(base, l, side) > box.lower[a]) --l;
                u = static_cast<std::uint32_t>(
                    std::clamp(std::ceil((double{box.upper[a]} - base) * inverse), 0.0, double{kCells}));
                while (u < kCells && decode(base, u, side) < box.upper[a]) ++u;
                assert(decode(base, l, side) <= box.lower[a] && decode(base, u, side) >= box.upper[a]);
            }
            lower |= l << (8 * k);
            upper |= u << (8 * k);
        }
        uvec4& words = texels[static_cast<std::size_t>(1 + a / 2)];
        words[2 * (a % 2)] = lower;
        words[2 * (a % 2) + 1] = upper;
    }
    std::array<std::uint32_t, 4> codes;
    codes.fill(shared::kBvhPageNoChild);
    std::uint32_t offset = 0;
    for (const bool leaves : {false, true}) {
        for (std::size_t k = 0; k < 4; ++k) {
            const BvhChild& child = node.children[k];
            if (child.bounds.empty() || child.leaf() != leaves) continue;
            codes[k] = offset | (child.count << shared::kBvhPageOffsetBits);
            offset += leaves ? child.count : shared::kBvhPageTexels;
        }
    }
    texels[2].w = codes[0] | (codes[1] << 8) | (codes[2] << 16) | (codes[3] << 24);
    return texels;
}

PageChild page_child(const PageNode& node, int child) {
    const std::uint32_t code = (node[2].w >> (8 * child)) & 0xffu;
    return {code != shared::kBvhPageNoChild, code & shared::kBvhPageNoChild, code >> shared::kBvhPageOffsetBits};
}

Bounds decode_page_box(const PageNode& node, int child) {
    Bounds box;
    for (int a = 0; a < 3; ++a) {
        const uvec4& words = node[static_cast<std::size_t>(1 + a / 2)];
        const float base = std::bit_cast<float>(node[0][a]);
        const float side = side_of((node[0].w >> (8 * a)) & 0xffu);
        box.lower[a] = static_cast<float>(decode(base, (words[2 * (a % 2)] >> (8 * child)) & 0xffu, side));
        box.upper[a] = static_cast<float>(decode(base, (words[2 * (a % 2) + 1] >> (8 * child)) & 0xffu, side));
    }
    return box;
}

}  // namespace halflight::rays
