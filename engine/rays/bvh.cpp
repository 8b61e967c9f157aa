#include "engine/rays/bvh.h"

#include <embree3/rtcore.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "engine/core/error.h"

namespace halflight::rays {
namespace {

/// A node made by the builder's callbacks, in the builder's memory until it is flattened.
struct BuiltNode {
    std::uint32_t child_count = 0;  // number of children of an inner node
    BuiltNode* children[4] = {};
    Bounds bounds[4];
    std::uint32_t primitive_count = 0;  // number of primitives of a leaf
    std::uint32_t primitives[kMaxLeafPrimitives] = {};
};

BuiltNode* allocate(RTCThreadLocalAllocator allocator) {
    return new (rtcThreadLocalAlloc(allocator, sizeof(BuiltNode), alignof(BuiltNode))) BuiltNode;
}

void* create_node(RTCThreadLocalAllocator allocator, unsigned child_count, void*) {
    BuiltNode* node = allocate(allocator);
    node->child_count = child_count;
    return node;
}

void set_children(void* node, void** children, unsigned child_count, void*) {
    for (unsigned i = 0; i < child_count; ++i)
        static_cast<BuiltNode*>(node)->children[i] = static_cast<BuiltNode*>(children[i]);
}

void set_bounds(void* node, const RTCBounds** bounds, unsigned child_count, void*) {
    for (unsigned i = 0; i < child_count; ++i) {
        const RTCBounds& b = *bounds[i];
        static_cast<BuiltNode*>(node)->bounds[i] = {{b.lower_x, b.lower_y, b.lower_z},
                                                    {b.upper_x, b.upper_y, b.upper_z}};
    }
}

void* create_leaf(RTCThreadLocalAllocator allocator, const RTCBuildPrimitive* primitives, std::size_t count, void*) {
    BuiltNode* leaf = allocate(allocator);
    for (std::size_t i = 0; i < count; ++i) leaf->primitives[i] = primitives[i].primID;
    std::sort(leaf->primitives, leaf->primitives + count);
    const auto* end = std::unique(leaf->primitives, leaf->primitives + count);  // parts of one pair
    leaf->primitive_count = static_cast<std::uint32_t>(end - leaf->primitives);
    return leaf;
}

/// Appends a node and its subtree; returns the maximum number of children that a traversal below it defers.
std::uint32_t flatten(const BuiltNode& built, Bvh& bvh) {
    const std::size_t index = bvh.nodes.size();
    bvh.nodes.emplace_back();
    std::uint32_t deepest = 0;
    for (std::uint32_t i = 0; i < built.child_count; ++i) {
        const BuiltNode& below = *built.children[i];
        BvhChild child{built.bounds[i], static_cast<std::uint32_t>(bvh.nodes.size()), below.primitive_count};
        if (child.leaf()) {
            child.first = static_cast<std::uint32_t>(bvh.primitives.size());
            bvh.primitives.insert(bvh.primitives.end(), below.primitives, below.primitives + below.primitive_count);
        } else {
            deepest = std::max(deepest, flatten(below, bvh));
        }
        bvh.nodes[index].children[i] = child;
    }
    return deepest + built.child_count - 1;
}

/// Returns a node above a root that is a leaf, so that every traversal starts at a node.
BuiltNode above(BuiltNode& leaf, std::span<const RTCBuildPrimitive> primitives) {
    BuiltNode root;
    root.child_count = 1;
    root.children[0] = &leaf;
    for (const RTCBuildPrimitive& p : primitives) {
        root.bounds[0].add(Bounds{{p.lower_x, p.lower_y, p.lower_z}, {p.upper_x, p.upper_y, p.upper_z}});
    }
    return root;
}

/// Computes the boxes, rounded outwards, of the parts of a pair on either side of a plane.
void split_pair(const RTCBuildPrimitive* primitive, unsigned dimension, float position, RTCBounds* left,
                RTCBounds* right, void* pairs) {
    const Ring& corner = static_cast<const Ring*>(pairs)[primitive->primID];
    const auto axis = static_cast<int>(dimension);
    Bounds sides[2];
    static constexpr std::size_t kEdges[][2] = {{0, 1}, {1, 2}, {2, 3}, {3, 0}, {0, 2}};
    for (const auto& [from, to] : kEdges) {
        const vec3 &a = corner[from], &b = corner[to];
        if (a[axis] <= position) sides[0].add(a);
        if (a[axis] >= position) sides[1].add(a);
        if (std::min(a[axis], b[axis]) >= position || std::max(a[axis], b[axis]) <= position) continue;
        const double s = (double{position} - a[axis]) / (double{b[axis]} - a[axis]);
        const vec3 crossing(glm::mix(dvec3(a), dvec3(b), s));
        for (Bounds& side : sides) {
            for (int i = 0; i < 3; ++i) {
                side.lower[i] = std::min(side.lower[i], std::nextafter(crossing[i], -kInfinity));
                side.upper[i] = std::max(side.upper[i], std::nextafter(crossing[i], kInfinity));
            }
        }
    }
    sides[0].upper[axis] = std::min(sides[0].upper[axis], position);
    sides[1].lower[axis] = std::max(sides[1].lower[axis], position);
    // An earlier split may have removed all contents of a side, whose box must not become invalid.
    const vec3 lower(primitive->lower_x, primitive->lower_y, primitive->lower_z);
    const vec3 upper(primitive->upper_x, primitive->upper_y, primitive->upper_z);
    RTCBounds* const results[2] = {left, right};
    for (int side = 0; side < 2; ++side) {
        const vec3 l = glm::clamp(sides[side].lower, lower, upper);
        const vec3 u = glm::max(glm::clamp(sides[side].upper, lower, upper), l);
        *results[side] = {l.x, l.y, l.z, 0, u.x, u.y, u.z, 0};
    }
}

/// Builds a hierarchy. `primitives` has `count` elements, and spare capacity if `pairs` are given.
Bvh build(std::vector<RTCBuildPrimitive>& primitives, std::size_t count, std::uint32_t max_leaf, const Ring* pairs) {
    Bvh bvh;
    if (count == 0) return bvh;
    const std::unique_ptr<RTCDeviceTy, decltype(&rtcReleaseDevice)> device(rtcNewDevice(nullptr), rtcReleaseDevice);
    const std::unique_ptr<RTCBVHTy, decltype(&rtcReleaseBVH)> storage(rtcNewBVH(device.get()), rtcReleaseBVH);
    if (!storage)
        throw Error("bvh", "Embree cannot start: error {}", static_cast<int>(rtcGetDeviceError(device.get())));
    RTCBuildArguments arguments = rtcDefaultBuildArguments();
    arguments.bvh = storage.get();
    arguments.buildQuality = RTC_BUILD_QUALITY_HIGH;
    arguments.maxBranchingFactor = 4;
    arguments.maxDepth = 64;
    arguments.sahBlockSize = 2;  // a leaf of one or two pairs costs about the same
    arguments.minLeafSize = 1;
    arguments.maxLeafSize = max_leaf;
    arguments.primitives = primitives.data();
    arguments.primitiveCount = count;
    arguments.primitiveArrayCapacity = primitives.size();
    arguments.createNode = create_node;
    arguments.setNodeChildren = set_children;
    arguments.setNodeBounds = set_bounds;
    arguments.createLeaf = create_leaf;
    arguments.splitPrimitive = pairs ? split_pair : nullptr;
    arguments.userPtr = const_cast<Ring*>(pairs);
    // One thread is used, because several would number the parts of split pairs in the order of their arrival.
    tbb::task_arena one_thread(1);
    auto* built = one_thread.execute([&] { return static_cast<BuiltNode*>(rtcBuildBVH(&arguments)); });
    if (built == nullptr) {
        throw Error("bvh", "Embree failed with error {}", static_cast<int>(rtcGetDeviceError(device.get())));
    }
    if (built->primitive_count != 0) {
        bvh.stack_entries = flatten(above(*built, {primitives.data(), count}), bvh);
    } else {
        bvh.stack_entries = flatten(*built, bvh);
    }
    return bvh;
}

RTCBuildPrimitive primitive_of(const Bounds& box, std::size_t id) {
    const auto& [lower, upper] = box;
    return {lower.x, lower.y, lower.z, 0, upper.x, upper.y, upper.z, static_cast<unsigned>(id)};
}

}  // namespace

int BvhNode::child_count() const {
    return static_cast<int>(
        std::count_if(children.begin(), children.end(), [](const BvhChild& c) { return !c.bounds.empty(); }));
}

Bvh build_bvh(std::span<const Bounds> boxes) {
    std::vector<RTCBuildPrimitive> primitives(boxes.size());
    for (std::size_t i = 0; i < boxes.size(); ++i) primitives[i] = primitive_of(boxes[i], i);
    return build(primitives, boxes.size(), 1, nullptr);
}

Bvh build_pair_bvh(std::span<const Ring> pairs, Splits splits) {
    const bool whole = splits == Splits::none;
    const auto capacity = static_cast<std::size_t>(kSplitBudget * static_cast<double>(pairs.size())) + 1;
    std::vector<RTCBuildPrimitive> primitives(whole ? pairs.size() : capacity);
    for (std::size_t i = 0; i < pairs.size(); ++i) {
        Bounds box;
        for (const vec3& p : pairs[i]) box.add(p);
        primitives[i] = primitive_of(box, i);
    }
    return build(primitives, pairs.size(), kMaxLeafPrimitives, whole ? nullptr : pairs.data());
}

}  // namespace halflight::rays
