#include "engine/graph/compile.h"

#include <algorithm>
#include <map>
#include <utility>

#include "engine/core/error.h"

namespace halflight::graph {
namespace {

constexpr std::uint32_t kNone = ~0u;

// --- Which passes run -----------------------------------------------------------------------------------------------

class Liveness {
  public:
    explicit Liveness(const Graph& graph) : graph_(graph), live_(graph.passes().size(), false) {
        for (std::uint32_t p = 0; p < live_.size(); ++p) {
            if (graph.passes()[p].kept) need_pass(p);
        }
        for (std::uint32_t r = 0; r < graph.resources().size(); ++r) {
            if (graph.resources()[r].output) need(r, graph.resources()[r].current());
        }
        while (!pending_.empty()) {
            const std::uint32_t p = pending_.back();
            pending_.pop_back();
            for (const Use& use : graph.passes()[p].uses) follow(use);
        }
    }
    bool operator[](std::uint32_t pass) const { return live_[pass]; }

  private:
    void need_pass(std::uint32_t pass) {
        if (live_[pass]) return;
        live_[pass] = true;
        pending_.push_back(pass);
    }

    void need(std::uint32_t resource, std::uint32_t version) {
        const std::uint32_t writer = graph_.resources()[resource].writers[version];
        if (writer != ResourceNode::kOutside && writer != ResourceNode::kNobody) need_pass(writer);
    }

    void follow(const Use& use) {
        if (!use.write) need(use.resource, use.version);
        if (use.keeps) need(use.resource, use.version - 1);
        const ResourceNode& node = graph_.resources()[use.resource];
        if (node.kind != ResourceKind::history_previous) return;
        const ResourceNode& now = graph_.resources()[node.partner];
        if (now.current() == 0) throw Error("history '" + now.name + "'", "is read but never written");
        need(node.partner, now.current());
    }

    const Graph& graph_;
    std::vector<bool> live_;
    std::vector<std::uint32_t> pending_;
};

/// Returns why a pass is culled: nobody reads its results, or only culled passes do.
std::string cull_reason(const Graph& graph, std::uint32_t pass) {
    std::string results, readers;
    for (const Use& written : graph.passes()[pass].uses) {
        if (!written.write) continue;
        const std::string& name = graph.resources()[written.resource].name;
        results += (results.empty() ? "'" : ", '") + name + "'";
        for (const PassNode& other : graph.passes()) {
            for (const Use& use : other.uses) {
                const std::uint32_t read = use.write ? use.version - 1 : use.version;
                const bool depends =
                    use.resource == written.resource && read == written.version && (!use.write || use.keeps);
                if (depends) readers += (readers.empty() ? "'" : ", '") + other.name + "'";
            }
        }
    }
    if (results.empty()) return "writes nothing and is not kept";
    if (readers.empty()) return "nothing reads " + results;
    return "only culled passes read " + results + ": " + readers;
}

// --- Memory of resources -------------------------------------------------------------------------------------------

void find_lifetimes(CompiledGraph& plan) {
    for (std::uint32_t p = 0; p < plan.passes.size(); ++p) {
        for (const Use& use : plan.passes[p].uses) {
            PlannedResource& resource = plan.resources[use.resource];
            if (!resource.used) resource.first = p;
            resource.used = true;
            resource.last = p;
        }
    }
    for (PlannedResource& resource : plan.resources) {
        if (resource.used && resource.node.output) resource.last = static_cast<std::uint32_t>(plan.passes.size());
    }
}

/// Returns the slot, among those free from `first` on, that fits best: the smallest that is large enough, else the
/// largest, which then grows.
std::uint32_t best_slot(const CompiledGraph& plan, const std::vector<std::uint32_t>& busy_until,
                        const PlannedResource& resource) {
    std::uint32_t best = kNone;
    for (std::uint32_t s = 0; s < plan.slots.size(); ++s) {
        const Slot& slot = plan.slots[s];
        if (busy_until[s] >= resource.first || slot.is_texture != resource.node.is_texture) continue;
        if (slot.is_texture) {
            if (slot.texture == resource.node.texture) return s;
            continue;
        }
        const std::size_t wanted = resource.node.buffer.bytes;
        const auto worse = [&](const Slot& a, const Slot& b) {
            const bool a_fits = a.buffer.bytes >= wanted, b_fits = b.buffer.bytes >= wanted;
            if (a_fits != b_fits) return b_fits;
            return a_fits ? a.buffer.bytes > b.buffer.bytes : a.buffer.bytes < b.buffer.bytes;
        };
        if (best == kNone || worse(plan.slots[best], slot)) best = s;
    }
    return best;
}

void assign_slots(CompiledGraph& plan, bool alias) {
    std::vector<std::uint32_t> order;
    for (std::uint32_t r = 0; r < plan.resources.size(); ++r) {
        if (plan.resources[r].used && plan.resources[r].node.kind == ResourceKind::transient) order.push_back(r);
    }
    std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
        return plan.resources[a].first < plan.resources[b].first;
    });
    std::vector<std::uint32_t> busy_until;  // per slot: last pass of its last transient
    for (const std::uint32_t r : order) {
        PlannedResource& resource = plan.resources[r];
        std::uint32_t s = alias ? best_slot(plan, busy_until, resource) : kNone;
        if (s == kNone) {
            s = static_cast<std::uint32_t>(plan.slots.size());
            plan.slots.push_back({resource.node.is_texture, {}, resource.node.texture, {}});
            busy_until.push_back(0);
        }
        Slot& slot = plan.slots[s];
        slot.buffer.bytes = std::max(slot.buffer.bytes, resource.node.buffer.bytes);
        slot.tenants.push_back(r);
        busy_until[s] = resource.last;
        resource.slot = s;
        plan.transient_bytes +=
            slot.is_texture ? gpu::texture_bytes(resource.node.texture) : resource.node.buffer.bytes;
    }
    for (const Slot& slot : plan.slots) plan.slot_bytes += slot.bytes();
}

void find_fresh(CompiledGraph& plan) {
    for (PlannedPass& pass : plan.passes) {
        for (const Use& use : pass.uses) {
            const ResourceKind kind = plan.resources[use.resource].node.kind;
            const bool ours = kind == ResourceKind::transient || kind == ResourceKind::history_now;
            if (use.write && !use.keeps && ours) pass.fresh.push_back(use.resource);
        }
    }
}

// --- Barriers -------------------------------------------------------------------------------------------------------
// OpenGL 4.5 core, 7.13.2: writes by shaders (storage blocks, images) are not ordered with later commands, all other
// writes are. A barrier bit names how memory is used *after* it, so the bits follow from the later access. Such writes
// also wait for earlier reads, except for transfers, which have finished when the next command starts.

bool unordered_write(Access access) {
    return access == Access::storage_write || access == Access::storage_read_write || access == Access::image_write;
}

bool ordered(Access access) {
    return access == Access::transfer_read || access == Access::transfer_write || access == Access::color_attachment ||
           access == Access::depth_attachment;
}

GLbitfield barrier_bits(Access access, bool is_texture) {
    const GLbitfield transfer = is_texture ? GL_TEXTURE_UPDATE_BARRIER_BIT | GL_FRAMEBUFFER_BARRIER_BIT
                                           : static_cast<GLbitfield>(GL_BUFFER_UPDATE_BARRIER_BIT);
    switch (access) {
        case Access::storage_read:
            return GL_SHADER_STORAGE_BARRIER_BIT;
        case Access::storage_write:
            return GL_SHADER_STORAGE_BARRIER_BIT | transfer;  // the pass may clear the resource first
        case Access::storage_read_write:
            return GL_SHADER_STORAGE_BARRIER_BIT;
        case Access::texture_read:
            return GL_TEXTURE_FETCH_BARRIER_BIT;
        case Access::uniform_read:
            return GL_UNIFORM_BARRIER_BIT;
        case Access::indirect_read:
            return GL_COMMAND_BARRIER_BIT;
        case Access::image_read:
            return GL_SHADER_IMAGE_ACCESS_BARRIER_BIT;
        case Access::image_write:
            return GL_SHADER_IMAGE_ACCESS_BARRIER_BIT | transfer;
        case Access::color_attachment:
        case Access::depth_attachment:
            return GL_FRAMEBUFFER_BARRIER_BIT;
        case Access::transfer_read:
        case Access::transfer_write:
            return transfer;
    }
    return 0;
}

void derive_barriers(CompiledGraph& plan) {
    struct Memory {
        int last_unordered_write = -1;
        int last_unordered_use = -1;
    };
    std::map<const void*, Memory> memories;
    const auto memory_of = [&](const PlannedResource& resource) -> Memory& {
        const void* identity = &resource;
        if (resource.slot != PlannedResource::kNoSlot) identity = &plan.slots[resource.slot];
        if (resource.node.imported_buffer != nullptr) identity = resource.node.imported_buffer;
        if (resource.node.imported_texture != nullptr) identity = resource.node.imported_texture;
        return memories[identity];
    };
    std::map<GLbitfield, int>
        issued;  // single bit -> last pass before which the bit was issued; a run starts with all bits issued
    for (int p = 0; p < static_cast<int>(plan.passes.size()); ++p) {
        PlannedPass& pass = plan.passes[static_cast<std::size_t>(p)];
        for (const Use& use : pass.uses) {
            const PlannedResource& resource = plan.resources[use.resource];
            const Memory& memory = memory_of(resource);
            const int hazard = unordered_write(use.access) ? memory.last_unordered_use : memory.last_unordered_write;
            const GLbitfield bits = barrier_bits(use.access, resource.node.is_texture);
            for (GLbitfield rest = bits; rest != 0; rest &= rest - 1) {
                const GLbitfield bit = rest & ~(rest - 1);
                if (issued[bit] <= hazard) pass.barriers |= bit;
            }
        }
        for (GLbitfield rest = pass.barriers; rest != 0; rest &= rest - 1) issued[rest & ~(rest - 1)] = p;
        for (const Use& use : pass.uses) {
            Memory& memory = memory_of(plan.resources[use.resource]);
            if (!ordered(use.access)) memory.last_unordered_use = p;
            if (unordered_write(use.access)) memory.last_unordered_write = p;
        }
    }
}

}  // namespace

CompiledGraph compile(const Graph& graph, const CompileOptions& options) {
    const Liveness live(graph);
    CompiledGraph plan;
    plan.serial = graph.serial();
    for (const ResourceNode& node : graph.resources()) plan.resources.push_back({node});
    for (std::uint32_t p = 0; p < graph.passes().size(); ++p) {
        const PassNode& pass = graph.passes()[p];
        if (live[p]) {
            plan.passes.push_back({pass.name, pass.uses, 0, {}, pass.kernel, pass.execute});
        } else {
            plan.culled.push_back({pass.name, cull_reason(graph, p), pass.uses});
        }
    }
    find_lifetimes(plan);
    assign_slots(plan, options.alias);
    find_fresh(plan);
    derive_barriers(plan);
    return plan;
}

}  // namespace halflight::graph
