#include "engine/rays/refit.h"

namespace halflight::rays {
namespace {

Bounds box_of(const BvhNode& node) {
    Bounds box;
    for (const BvhChild& child : node.children) box.add(child.bounds);
    return box;
}

double half_area(const Bounds& box) {
    if (box.empty()) return 0;
    const dvec3 e = dvec3(box.upper) - dvec3(box.lower);
    return e.x * e.y + e.y * e.z + e.z * e.x;
}

}  // namespace

void refit(Bvh& bvh, std::span<const Ring> rings) {
    for (std::size_t i = bvh.nodes.size(); i-- > 0;) {  // nodes come before their children
        for (BvhChild& child : bvh.nodes[i].children) {
            if (child.bounds.empty()) continue;
            child.bounds = child.leaf() ? Bounds{} : box_of(bvh.nodes[child.first]);
            for (std::uint32_t p = child.first; p < child.first + child.count; ++p)
                for (const vec3& corner : rings[bvh.primitives[p]]) child.bounds.add(corner);
        }
    }
}

double expected_cost(const Bvh& bvh) {
    if (bvh.nodes.empty()) return 0;
    const double root = half_area(box_of(bvh.nodes.front()));
    if (!(root > 0)) return 0;
    double sum = root;
    for (const BvhNode& node : bvh.nodes)
        for (const BvhChild& child : node.children) sum += half_area(child.bounds) * (child.leaf() ? child.count : 1);
    return sum / root;
}

}  // namespace halflight::rays
