// Compilation of a declared graph to a plan: running passes, memory of resources, barriers.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "engine/graph/graph.h"

namespace halflight::graph {

/// A pass of the plan, its barriers and its undefined transients.
struct PlannedPass {
    std::string name;
    std::vector<Use> uses;
    GLbitfield barriers = 0;           // bits for glMemoryBarrier() before the pass; 0: none
    std::vector<std::uint32_t> fresh;  // transients written by the pass whose contents are undefined at its start
    std::optional<Kernel> kernel{};
    std::function<void(Resources&)> execute{};
};

struct CulledPass {
    std::string name;
    std::string reason;
    std::vector<Use> uses;
};

/// A resource of the plan, at the index of its handles.
struct PlannedResource {
    ResourceNode node;
    bool used = false;        // true: a pass of the plan uses the resource
    std::uint32_t first = 0;  // index of the first pass of the plan that uses the resource
    std::uint32_t last = 0;   // index of the last pass that uses the resource; outputs last until the end
    std::uint32_t slot = kNoSlot;
    static constexpr std::uint32_t kNoSlot = ~0u;  // slot of imported, history and unused resources
};

/// Memory that several transients use one after the other.
struct Slot {
    bool is_texture = false;
    BufferDesc buffer;                   // description of the largest transient
    gpu::TextureDesc texture;            // description that all its transients share
    std::vector<std::uint32_t> tenants;  // transients, in order of first use
    std::size_t bytes() const { return is_texture ? gpu::texture_bytes(texture) : buffer.bytes; }
};

struct CompiledGraph {
    std::uint32_t serial = 0;  // serial number of the graph
    std::vector<PlannedPass> passes;
    std::vector<CulledPass> culled;
    std::vector<PlannedResource> resources;
    std::vector<Slot> slots;
    std::size_t transient_bytes = 0;  // bytes of all used transients without aliasing
    std::size_t slot_bytes = 0;       // bytes of all slots
};

struct CompileOptions {
    bool alias = true;  // false: each transient has its own memory of exactly its size
};

/// Compiles a graph; a pure function. A pass runs if it is kept, or if a running pass or an output needs its results.
/// Throws Error if a history is read but never written.
CompiledGraph compile(const Graph& graph, const CompileOptions& options = {});

/// Returns the plan for Graphviz: passes as boxes (culled ones dashed, with the reason), resource versions as ellipses
/// with their slot.
std::string to_dot(const CompiledGraph& compiled);

}  // namespace halflight::graph
