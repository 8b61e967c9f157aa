#include "engine/rays/bvh.h"

#include <tbb/task_arena.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <memory>
#include <utility>

#include "engine/core/embree.h"
#include "engine/core/error.h"
#include "engine/core/release.h"

namespace halflight::rays {
namespace {

/// A node made by the builder's callbacks, in the builder's memory until it is flattened. It is followed by
/// `child_count` objects of type BuiltChild, or by the `primitive_count` primitives of a leaf. There are several leaves
/// for each inner node, so that both are only as large as needed.
struct BuiltNode {
    std::uint32_t child_count = 0;
    std::uint32_t primitive_count = 0;
};
struct BuiltChild {
    const BuiltNode* node;
    Bounds bounds;
};

static_assert(sizeof(BuiltNode) % alignof(BuiltChild) == 0);

BuiltChild* children_of(void* node) {
    return reinterpret_cast<BuiltChild*>(static_cast<BuiltNode*>(node) + 1);
}
std::span<const BuiltChild> children_of(const BuiltNode& node) {
    return {reinterpret_cast<const BuiltChild*>(&node + 1), node.child_count};
}
std::span<const std::uint32_t> primitives_of(const BuiltNode& leaf) {
    return {reinterpret_cast<const std::uint32_t*>(&leaf + 1), leaf.primitive_count};
}

/// The callbacks of a builder share this object. The builder has one thread.
struct Building {
    const Ring* pairs = nullptr;
    std::size_t nodes = 0;       // number of inner nodes
    std::size_t primitives = 0;  // number of primitives in leaves
};

template <class T>
BuiltNode* allocate(RTCThreadLocalAllocator allocator, std::size_t count) {
    void* const at = rtcThreadLocalAlloc(allocator, sizeof(BuiltNode) + count * sizeof(T), alignof(BuiltChild));
    return new (at) BuiltNode;
}

void* create_node(RTCThreadLocalAllocator allocator, unsigned child_count, void* building) {
    BuiltNode* node = allocate<BuiltChild>(allocator, child_count);
    node->child_count = child_count;
    std::uninitialized_default_construct_n(children_of(node), child_count);
    ++static_cast<Building*>(building)->nodes;
    return node;
}

void set_children(void* node, void** children, unsigned child_count, void*) {
    for (unsigned i = 0; i < child_count; ++i) children_of(node)[i].node = static_cast<const BuiltNode*>(children[i]);
}

void set_bounds(void* node, const RTCBounds** bounds, unsigned child_count, void*) {
    for (unsigned i = 0; i < child_count; ++i) {
        const RTCBounds& b = *bounds[i];
        children_of(node)[i].bounds = {{b.lower_x, b.lower_y, b.lower_z}, {b.upper_x, b.upper_y, b.upper_z}};
    }
}

void* create_leaf(RTCThreadLocalAllocator allocator, const RTCBuildPrimitive* primitives, std::size_t count,
                  void* building) {
    assert(count <= kMaxLeafPrimitives);
    BuiltNode* leaf = allocate<std::uint32_t>(allocator, count);
    auto* const ids = reinterpret_cast<std::uint32_t*>(leaf + 1);
    std::transform(primitives, primitives + count, ids, [](const RTCBuildPrimitive& p) { return p.primID; });
    std::sort(ids, ids + count);
    leaf->primitive_count =
        static_cast<std::uint32_t>(std::unique(ids, ids + count) - ids);  // several parts may belong to one pair
    static_cast<Building*>(building)->primitives += leaf->primitive_count;
    return leaf;
}

/// Appends a node with these children and their subtrees; returns the maximum number of children that a traversal below
/// it defers.
std::uint32_t flatten(std::span<const BuiltChild> children, Bvh& bvh) {
    const std::size_t index = bvh.nodes.size();
    bvh.nodes.emplace_back();
    std::uint32_t deepest = 0;
    for (std::size_t i = 0; i < children.size(); ++i) {
        const BuiltNode& below = *children[i].node;
        BvhChild child{children[i].bounds, static_cast<std::uint32_t>(bvh.nodes.size()), below.primitive_count};
        if (child.leaf()) {
            child.first = static_cast<std::uint32_t>(bvh.primitives.size());
            const std::span<const std::uint32_t> primitives = primitives_of(below);
            bvh.primitives.insert(bvh.primitives.end(), primitives.begin(), primitives.end());
        } else {
            deepest = std::max(deepest, flatten(children_of(below), bvh));
        }
        bvh.nodes[index].children[i] = child;
    }
    return deepest + static_cast<std::uint32_t>(children.size()) - 1;
}

/// Computes the boxes, rounded outwards, of the parts of a pair on either side of a plane.
void split_pair(const RTCBuildPrimitive* primitive, unsigned dimension, float position, RTCBounds* left,
                RTCBounds* right, void* building) {
    const Ring& corner = static_cast<const Building*>(building)->pairs[primitive->primID];
    const auto axis = static_cast<int>(dimension);
    Bounds sides[2], cut;  // cut: bounds of the points where edges cross the plane
    static constexpr std::size_t kEdges[][2] = {{0, 1}, {1, 2}, {2, 3}, {3, 0}, {0, 2}};
    for (const auto& [from, to] : kEdges) {
        const vec3 &a = corner[from], &b = corner[to];
        if (a[axis] <= position) sides[0].add(a);
        if (a[axis] >= position) sides[1].add(a);
        if (std::min(a[axis], b[axis]) >= position || std::max(a[axis], b[axis]) <= position) continue;
        const double s = (double{position} - a[axis]) / (double{b[axis]} - a[axis]);
        cut.add(vec3(glm::mix(dvec3(a), dvec3(b), s)));
    }
    if (!cut.empty()) {
        for (int i = 0; i < 3; ++i) {
            cut.lower[i] = std::nextafter(cut.lower[i], -kInfinity);
            cut.upper[i] = std::nextafter(cut.upper[i], kInfinity);
        }
        for (Bounds& side : sides) side.add(cut);
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
Bvh build(std::vector<RTCBuildPrimitive> primitives, std::size_t count, std::uint32_t max_leaf, const Ring* pairs) {
    Bvh bvh;
    if (count == 0) return bvh;
    Bounds all;
    for (const RTCBuildPrimitive& p : std::span(primitives).first(count))
        all.add(Bounds{{p.lower_x, p.lower_y, p.lower_z}, {p.upper_x, p.upper_y, p.upper_z}});
    const std::unique_ptr<RTCDeviceTy, decltype(&rtcReleaseDevice)> device(rtcNewDevice(nullptr), rtcReleaseDevice);
    const std::unique_ptr<RTCBVHTy, decltype(&rtcReleaseBVH)> storage(rtcNewBVH(device.get()), rtcReleaseBVH);
    if (!storage)
        throw Error("bvh", "Embree cannot start: error {}", static_cast<int>(rtcGetDeviceError(device.get())));
    Building building{pairs};
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
    arguments.userPtr = &building;
    // One thread is used, because several would number the parts of split pairs in the order of their arrival.
    tbb::task_arena one_thread(1);
    const auto* built = one_thread.execute([&] { return static_cast<const BuiltNode*>(rtcBuildBVH(&arguments)); });
    if (built == nullptr) {
        throw Error("bvh", "Embree failed with error {}", static_cast<int>(rtcGetDeviceError(device.get())));
    }
    release(primitives);
    bvh.nodes.reserve(std::max(building.nodes, std::size_t{1}));
    bvh.primitives.reserve(building.primitives);
    // Every traversal starts at a node, so a root that is a leaf gets a node above it.
    const BuiltChild root{built, all};
    bvh.stack_entries = flatten(built->primitive_count != 0 ? std::span(&root, 1) : children_of(*built), bvh);
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
    return build(std::move(primitives), boxes.size(), 1, nullptr);
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
    return build(std::move(primitives), pairs.size(), kMaxLeafPrimitives, whole ? nullptr : pairs.data());
}

}  // namespace halflight::rays
