#include "tools/measure/bench/naive_tracer.h"
#include "tools/measure/bench/kernels.h"

#include <array>
#include <memory>
#include <span>
#include <vector>

#include "engine/core/embree.h"
#include "engine/core/error.h"
#include "engine/gpu/context.h"
#include "engine/graph/execute.h"

namespace halflight::bench {
namespace {

constexpr std::uint32_t kMaxLeaf = 4;
// The shader's stack has 64 entries, one of which marks where a block begins.
constexpr unsigned kDepth = 60, kTopDepth = 28, kBlockDepth = 34;

// Layout of a node in naive.comp.
struct GpuNode {
    vec3 lower;
    std::uint32_t first;
    vec3 upper;
    std::uint32_t count;
};
struct GpuTriangle {
    vec3 corner;
    std::uint32_t id;
    vec3 edge1;
    std::uint32_t alpha_tested;
    vec4 edge2;
};
struct GpuInstance {
    std::array<vec4, 3> rows;
    uvec4 root;
};
static_assert(sizeof(GpuNode) == 32 && sizeof(GpuTriangle) == 48 && sizeof(GpuInstance) == 64);

/// A node made by Embree's callbacks.
struct Built {
    std::array<Bounds, 2> bounds;
    std::array<Built*, 2> children{};
    std::uint32_t count = 0;  // triangles of a leaf; 0: inner node
    std::array<std::uint32_t, kMaxLeaf> primitives{};
};

Built* allocate(RTCThreadLocalAllocator allocator) {
    return new (rtcThreadLocalAlloc(allocator, sizeof(Built), alignof(Built))) Built;
}
void* create_node(RTCThreadLocalAllocator allocator, unsigned, void*) {
    return allocate(allocator);
}
void set_children(void* node, void** children, unsigned count, void*) {
    for (unsigned i = 0; i < count; ++i) static_cast<Built*>(node)->children[i] = static_cast<Built*>(children[i]);
}
Bounds bounds_of(const RTCBounds& b) {
    return {{b.lower_x, b.lower_y, b.lower_z}, {b.upper_x, b.upper_y, b.upper_z}};
}
void set_bounds(void* node, const RTCBounds** bounds, unsigned count, void*) {
    for (unsigned i = 0; i < count; ++i) static_cast<Built*>(node)->bounds[i] = bounds_of(*bounds[i]);
}
void* create_leaf(RTCThreadLocalAllocator allocator, const RTCBuildPrimitive* primitives, std::size_t count, void*) {
    Built* leaf = allocate(allocator);
    leaf->count = static_cast<std::uint32_t>(count);
    for (std::size_t i = 0; i < count; ++i) leaf->primitives[i] = primitives[i].primID;
    return leaf;
}

/// All trees, one after the other, with siblings side by side.
class Trees {
  public:
    /// Adds a tree and returns its root. leaf(primitives) stores a leaf and returns the index of its first primitive.
    template <class Leaf>
    std::uint32_t add(const std::vector<Bounds>& boxes, std::uint32_t max_leaf, unsigned max_depth, const Leaf& leaf) {
        std::vector<RTCBuildPrimitive> primitives;
        primitives.reserve(boxes.size());
        Bounds all;
        for (const auto& [lower, upper] : boxes) {
            primitives.push_back(
                {lower.x, lower.y, lower.z, 0, upper.x, upper.y, upper.z, static_cast<unsigned>(primitives.size())});
            all.add(Bounds{lower, upper});
        }
        const std::unique_ptr<RTCDeviceTy, decltype(&rtcReleaseDevice)> device(rtcNewDevice(nullptr), rtcReleaseDevice);
        const std::unique_ptr<RTCBVHTy, decltype(&rtcReleaseBVH)> storage(rtcNewBVH(device.get()), rtcReleaseBVH);
        RTCBuildArguments arguments = rtcDefaultBuildArguments();
        arguments.bvh = storage.get();
        arguments.buildQuality = RTC_BUILD_QUALITY_MEDIUM;
        arguments.maxBranchingFactor = 2;
        arguments.maxDepth = max_depth;
        arguments.sahBlockSize = 1;
        arguments.minLeafSize = 1;
        arguments.maxLeafSize = max_leaf;
        arguments.primitives = primitives.data();
        arguments.primitiveCount = arguments.primitiveArrayCapacity = primitives.size();
        arguments.createNode = create_node;
        arguments.setNodeChildren = set_children;
        arguments.setNodeBounds = set_bounds;
        arguments.createLeaf = create_leaf;
        const auto* built = static_cast<const Built*>(rtcBuildBVH(&arguments));
        if (!built)
            throw Error("naive", "Embree failed with error {}", static_cast<int>(rtcGetDeviceError(device.get())));
        const auto root = static_cast<std::uint32_t>(nodes.size());
        nodes.emplace_back();
        place(*built, all, root, leaf);
        return root;
    }

    std::vector<GpuNode> nodes;

  private:
    template <class Leaf>
    void place(const Built& built, const Bounds& bounds, std::uint32_t index, const Leaf& leaf) {
        GpuNode node{bounds.lower, static_cast<std::uint32_t>(nodes.size()), bounds.upper, built.count};
        if (built.count > 0) {
            node.first = leaf(std::span(built.primitives.data(), built.count));
        } else {
            nodes.resize(nodes.size() + 2);
            for (std::uint32_t i = 0; i < 2; ++i) place(*built.children[i], built.bounds[i], node.first + i, leaf);
        }
        nodes[index] = node;
    }
};

struct Arrays {
    Trees trees;
    std::vector<GpuTriangle> triangles;
    std::vector<GpuInstance> instances;
    bool two_level = false;
    std::uint32_t root = 0;
};

std::uint32_t add_block(const TraceTables& tables, const Block& block, unsigned max_depth, Arrays& to) {
    std::vector<Bounds> boxes(block.triangle_count);
    const auto corner = [&](std::uint32_t triangle, int k) {
        return tables.positions[tables.triangles[block.first_triangle + triangle][k]];
    };
    for (std::uint32_t i = 0; i < block.triangle_count; ++i)
        for (int k = 0; k < 3; ++k) boxes[i].add(corner(i, k));
    return to.trees.add(boxes, kMaxLeaf, max_depth, [&](std::span<const std::uint32_t> primitives) {
        const auto first = static_cast<std::uint32_t>(to.triangles.size());
        for (const std::uint32_t i : primitives) {
            const vec3 a = corner(i, 0);
            const std::uint32_t id = block.first_triangle + i;
            to.triangles.push_back(
                {a, id, corner(i, 1) - a, tables.triangles[id].w & kTriangleAlpha, vec4(corner(i, 2) - a, 0)});
        }
        return first;
    });
}

Arrays build(const TraceTables& tables) {
    Arrays arrays;
    arrays.two_level = tables.instances.size() != 1 || !tables.instances.front().identity;
    std::vector<std::uint32_t> roots;
    for (const Block& block : tables.blocks)
        roots.push_back(add_block(tables, block, arrays.two_level ? kBlockDepth : kDepth, arrays));
    if (!arrays.two_level) {
        arrays.root = roots.front();
        return arrays;
    }
    std::vector<Bounds> boxes;
    for (const BlockInstance& instance : tables.instances) {
        GpuInstance& to = arrays.instances.emplace_back();
        const auto& m = instance.world_to_block;
        for (int r = 0; r < 3; ++r) to.rows[static_cast<std::size_t>(r)] = vec4(m[0][r], m[1][r], m[2][r], m[3][r]);
        to.root = uvec4(roots[instance.block], 0, 0, 0);
        const Bounds& b = tables.blocks[instance.block].bounds;
        Bounds& box = boxes.emplace_back();
        for (int k = 0; k < 8; ++k) {
            const vec3 p((k & 1 ? b.upper : b.lower).x, (k & 2 ? b.upper : b.lower).y, (k & 4 ? b.upper : b.lower).z);
            box.add(instance.block_to_world * vec4(p, 1));
        }
    }
    arrays.root = arrays.trees.add(boxes, 1, kTopDepth, [](std::span<const std::uint32_t> p) { return p.front(); });
    return arrays;
}

}  // namespace

NaiveTracer::NaiveTracer(const TraceTables& tables, std::size_t storage_block_bytes) {
    build_seconds_ = gpu::timed([&] {
        const Arrays arrays = build(tables);
        two_level_ = arrays.two_level;
        root_ = arrays.root;
        nodes_ = gpu::Buffer::from("naive nodes", arrays.trees.nodes);
        triangles_ = gpu::Buffer::from("naive triangles", arrays.triangles);
        instances_ = gpu::Buffer::from("naive instances", arrays.instances);
    });
    for (const gpu::Buffer* buffer : {&nodes_, &triangles_, &instances_}) {
        if (buffer->bytes() > storage_block_bytes) {
            throw Error("naive", "{} of {} MiB; a shader can address {}", buffer->name(), buffer->bytes() >> 20,
                        storage_block_bytes >> 20);
        }
    }
}

const gpu::Program& NaiveTracer::bound(gpu::ProgramCache& programs, gpu::Defines defines, const gpu::Buffer& rays,
                                       bool any_hit, const gpu::Buffer& results) const {
    if (any_hit) defines.set("HALFLIGHT_ANY_HIT");
    if (two_level_) defines.set("HALFLIGHT_TWO_LEVEL");
    const gpu::Program& program = programs.compute(gpu::bench_kernel("naive.comp"), defines);
    program.bind_storage("Nodes", nodes_);
    program.bind_storage("Triangles", triangles_);
    program.bind_storage("Instances", instances_);
    program.bind_storage("Rays", rays);
    program.bind_storage(any_hit ? "Occluded" : "Hits", results);
    program.set("root", root_);
    return program;
}

void NaiveTracer::trace(gpu::ProgramCache& programs, const gpu::Buffer& rays, std::uint32_t count, bool any_hit,
                        gpu::Buffer& results) const {
    const gpu::Program& program = bound(programs, {}, rays, any_hit, results);
    program.set("capacity", count);
    program.dispatch((count + 63) / 64);
}

graph::BufferHandle NaiveTracer::add(graph::Graph& graph, const rays::TraceScene& scene, const rays::RayBatch& batch,
                                     graph::BufferHandle results, bool any_hit) {
    graph::Pass pass = graph.add_pass(fmt::format("{} rays: naive", rays::name(batch.kind)));
    rays::read_batch(pass, scene, batch, graph::Access::storage_read);
    results = rays::write_results(pass, batch, results);
    pass.execute([=, this, &scene](graph::Resources& r) {
        gpu::Defines defines = scene.alpha_tested() ? scene.defines() : gpu::Defines();
        if (batch.list) defines.set("HALFLIGHT_LIST");
        const gpu::Program& program = bound(r.programs(), defines, r.buffer(batch.rays), any_hit, r.buffer(results));
        if (scene.alpha_tested()) {
            scene.bind();
            program.bind_uniform("FrameBlock", r.buffer(batch.frame_constants));
            program.set("alpha_salt", batch.alpha_salt);
        }
        if (batch.list) {
            program.bind_storage("List", r.buffer(batch.list));
            program.bind_storage("Header", r.buffer(batch.list_header));
            program.dispatch_indirect(r.buffer(batch.list_header), (batch.capacity + 63) / 64);
        } else {
            program.set("capacity", batch.capacity);
            program.dispatch((batch.capacity + 63) / 64);
        }
    });
    return results;
}

}  // namespace halflight::bench
