// From a declared graph to a plan: which passes run, where their resources lie, which barriers stand between them.
#pragma once

#include <string>
#include <vector>

#include "engine/graph/graph.h"

namespace halflight::graph {

/// A pass of the plan.
struct PlannedPass {
    std::string name;
    std::vector<Use> uses;
    GLbitfield barriers = 0;           // for glMemoryBarrier, before the pass; 0: none
    std::vector<std::uint32_t> fresh;  // transients whose content is undefined when the pass starts and that it writes
    std::function<void(Resources&)> execute;
};

struct CulledPass {
    std::string name;
    std::string reason;
    std::vector<Use> uses;
};

/// A resource of the plan, at the index that its handles have.
struct PlannedResource {
    ResourceNode node;
    bool used = false;        // by a pass of the plan
    std::uint32_t first = 0;  // pass of the plan; inclusive
    std::uint32_t last = 0;   // pass of the plan; inclusive; outputs last until the end
    std::uint32_t slot = kNoSlot;
    static constexpr std::uint32_t kNoSlot = ~0u;  // imported, history, or not used
};

/// A piece of memory that transients share in turn.
struct Slot {
    bool is_texture = false;
    BufferDesc buffer;                   // the largest of its tenants
    gpu::TextureDesc texture;            // that of all its tenants
    std::vector<std::uint32_t> tenants;  // resources, in order of first use
    std::size_t bytes() const { return is_texture ? gpu::texture_bytes(texture) : buffer.bytes; }
};

struct CompiledGraph {
    std::uint32_t serial = 0;  // of the graph
    std::vector<PlannedPass> passes;
    std::vector<CulledPass> culled;
    std::vector<PlannedResource> resources;
    std::vector<Slot> slots;
    std::size_t transient_bytes = 0;  // of all used transients, had each its own memory
    std::size_t slot_bytes = 0;       // what they take
};

struct CompileOptions {
    bool alias = true;  // off: each transient has memory of its own, and exactly the size that was asked for
};

/// Pure. A pass runs if it is kept, or if a running pass or an output needs what it writes. Throws Error if a history
/// is read but never written.
CompiledGraph compile(const Graph& graph, const CompileOptions& options = {});

/// Graphviz: passes as boxes (culled ones dashed, with the reason), resource versions as ellipses with their slot.
std::string to_dot(const CompiledGraph& compiled);

}  // namespace halflight::graph
