#include <fmt/format.h>

#include <algorithm>

#include "engine/graph/compile.h"

namespace halflight::graph {
namespace {

std::string escaped(std::string_view text) {
    std::string result;
    for (const char c : text) {
        if (c == '"' || c == '\\') result += '\\';
        result += c;
    }
    return result;
}

std::string size_text(std::size_t bytes) {
    if (bytes >= 1u << 20) return fmt::format("{:.1f} MiB", static_cast<double>(bytes) / (1 << 20));
    if (bytes >= 1u << 10) return fmt::format("{:.1f} KiB", static_cast<double>(bytes) / (1 << 10));
    return fmt::format("{} B", bytes);
}

class DotWriter {
  public:
    explicit DotWriter(const CompiledGraph& plan) : plan_(plan), seen_(plan.resources.size()) {}

    std::string write() {
        out_ = fmt::format("digraph frame {{\n    rankdir=LR;\n    label=\"transients: {}, aliased: {}\";\n",
                           size_text(plan_.transient_bytes), size_text(plan_.slot_bytes));
        for (std::size_t p = 0; p < plan_.passes.size(); ++p) {
            const PlannedPass& pass = plan_.passes[p];
            const std::string barrier = pass.barriers == 0 ? "" : fmt::format("\\nbarrier {:#x}", pass.barriers);
            add_pass(fmt::format("pass{}", p), fmt::format("{}. {}{}", p, escaped(pass.name), barrier), pass.uses, "");
        }
        for (std::size_t c = 0; c < plan_.culled.size(); ++c) {
            const CulledPass& pass = plan_.culled[c];
            add_pass(fmt::format("culled{}", c), escaped(pass.name) + "\\n" + escaped(pass.reason), pass.uses,
                     ", style=dashed");
        }
        return out_ + "}\n";
    }

  private:
    void add_pass(const std::string& id, const std::string& label, const std::vector<Use>& uses, const char* style) {
        out_ += fmt::format("    {} [shape=box, label=\"{}\"{}];\n", id, label, style);
        for (const Use& use : uses) {
            const auto edge = [&](const std::string& from, const std::string& to) {
                out_ += fmt::format("    {} -> {} [label=\"{}\"{}];\n", from, to, name(use.access), style);
            };
            if (!use.write) edge(version_node(use.resource, use.version), id);
            if (use.keeps) edge(version_node(use.resource, use.version - 1), id);
            if (use.write) edge(id, version_node(use.resource, use.version));
        }
    }

    /// Returns the name of a version's node, which is written on first use.
    std::string version_node(std::uint32_t index, std::uint32_t version) {
        const std::string id = fmt::format("r{}v{}", index, version);
        auto& seen = seen_[index];
        if (std::find(seen.begin(), seen.end(), version) != seen.end()) return id;
        seen.push_back(version);
        const PlannedResource& resource = plan_.resources[index];
        const std::size_t bytes =
            resource.node.is_texture ? gpu::texture_bytes(resource.node.texture) : resource.node.buffer.bytes;
        std::string label = fmt::format("{} v{}\\n{}", escaped(resource.node.name), version, size_text(bytes));
        if (resource.slot != PlannedResource::kNoSlot) label += fmt::format(", slot {}", resource.slot);
        if (resource.node.kind == ResourceKind::imported) label += ", imported";
        if (resource.node.kind == ResourceKind::history_now) label += ", history";
        if (resource.node.kind == ResourceKind::carried) label += ", carried";
        const bool output = resource.node.output && version == resource.node.current();
        const char* style = output ? ", peripheries=2" : resource.used ? "" : ", style=dashed";
        out_ += fmt::format("    {} [shape=ellipse, label=\"{}\"{}];\n", id, label, style);
        return id;
    }

    const CompiledGraph& plan_;
    std::vector<std::vector<std::uint32_t>> seen_;  // per resource: versions that have a node
    std::string out_;
};

}  // namespace

std::string to_dot(const CompiledGraph& compiled) {
    return DotWriter(compiled).write();
}

}  // namespace halflight::graph
