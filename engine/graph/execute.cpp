#include "engine/graph/execute.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "engine/core/error.h"
#include "engine/core/steps.h"
#include "engine/gpu/context.h"

namespace halflight::graph {
namespace {

/// Debug group that names the commands of a pass for profilers and debuggers.
class DebugGroup {
  public:
    explicit DebugGroup(const std::string& name) {
        glPushDebugGroup(GL_DEBUG_SOURCE_APPLICATION, 0, static_cast<GLsizei>(name.size()), name.data());
    }
    ~DebugGroup() { glPopDebugGroup(); }
    DebugGroup(const DebugGroup&) = delete;
    DebugGroup& operator=(const DebugGroup&) = delete;
};

constexpr std::uint32_t kPoison = 0xffffffffu;  // NaN in every float format, "no such thing" as an index

void poison_texture(gpu::Texture& texture) {
    const gpu::TexelKind kind = gpu::format_info(texture.desc().format).kind;
    const float nan = std::numeric_limits<float>::quiet_NaN();
    if (kind == gpu::TexelKind::integer) {
        texture.clear_uint(kPoison);
    } else if (kind == gpu::TexelKind::color) {
        texture.clear(nan, nan, nan, nan);
    }  // depth is clamped to [0, 1], so it cannot be poisoned
}

bool is_attachment(const Use& use) {
    return use.access == Access::color_attachment || use.access == Access::depth_attachment;
}

}  // namespace

// --- Resources ------------------------------------------------------------------------------------------------------

std::uint32_t Resources::checked(std::uint32_t graph, std::uint32_t resource) const {
    const bool declared = graph == graph_.serial && std::any_of(pass_.uses.begin(), pass_.uses.end(),
                                                                [&](const Use& u) { return u.resource == resource; });
    if (declared) return resource;
    const bool known = graph == graph_.serial && resource < graph_.resources.size();
    throw Error("pass '" + pass_.name + "'", "uses {} without having declared it",
                known ? "'" + graph_.resources[resource].node.name + "'" : "a handle of another graph");
}

gpu::Buffer& Resources::buffer(BufferHandle handle) {
    return *executor_.buffer_of_[checked(handle.graph, handle.resource)];
}

gpu::Texture& Resources::texture(TextureHandle handle) {
    return *executor_.texture_of_[checked(handle.graph, handle.resource)];
}

const gpu::Framebuffer& Resources::framebuffer(std::initializer_list<TextureHandle> colors, TextureHandle depth) {
    std::vector<const gpu::Texture*> attachments;
    std::vector<std::uint64_t> key;
    for (const TextureHandle color : colors) attachments.push_back(color ? &texture(color) : nullptr);
    const gpu::Texture* depth_attachment = depth ? &texture(depth) : nullptr;
    for (const gpu::Texture* texture : attachments) key.push_back(texture ? texture->serial() : 0);
    key.push_back(depth_attachment ? depth_attachment->serial() : 0);
    auto found = executor_.framebuffers_.find(key);
    if (found == executor_.framebuffers_.end()) {
        found =
            executor_.framebuffers_.emplace(std::move(key), gpu::Framebuffer(pass_.name, attachments, depth_attachment))
                .first;
    }
    return found->second;
}

const gpu::Program& Resources::bound(const Kernel& kernel, const gpu::Program& program) {
    if (kernel.bind) kernel.bind(*this, program);
    for (const Use& use : pass_.uses) {
        const auto& [name, format] = use.shader_name;
        if (name.empty()) continue;
        if (!program.declares(name)) {
            throw Error("pass '" + pass_.name + "'", "binds '{}' to '{}', which {} does not declare",
                        graph_.resources[use.resource].node.name, name, program.name());
        }
        const gpu::Buffer* buffer = executor_.buffer_of_[use.resource];
        const gpu::Texture* texture = executor_.texture_of_[use.resource];
        switch (use.access) {
            case Access::storage_read:
            case Access::storage_write:
            case Access::storage_read_write:
                program.bind_storage(name, *buffer);
                break;
            case Access::uniform_read:
                program.bind_uniform(name, *buffer);
                break;
            case Access::texture_read:
                texture ? program.bind_texture(name, *texture) : program.bind_texture(name, *buffer, format);
                break;
            case Access::image_read:
            case Access::image_write:
                program.bind_image(name, *texture);
                break;
            default:  // accesses without a shader name
                break;
        }
    }
    return program;
}

const gpu::Program& Resources::kernel(const Kernel& kernel) {
    gpu::ProgramCache& programs = executor_.programs_;
    return bound(kernel, kernel.fragment ? programs.graphics(kernel.source, *kernel.fragment, kernel.defines)
                                         : programs.compute(kernel.source, kernel.defines));
}

const gpu::Program& Resources::kernel() {
    if (!pass_.kernel) throw Error("pass '" + pass_.name + "'", "has declared no kernel");
    return kernel(*pass_.kernel);
}

gpu::ProgramCache& Resources::programs() {
    return executor_.programs_;
}

// --- History --------------------------------------------------------------------------------------------------------

void History::invalidate(std::string reason) {
    for (auto& [name, pair] : pairs_) {
        for (gpu::Buffer& buffer : pair.buffers) buffer.clear();
        for (gpu::Texture& texture : pair.textures) texture.zero();
        pair.written = false;
    }
    reason_ = std::move(reason);
}

std::size_t History::bytes() const {
    std::size_t sum = 0;
    for (const auto& [name, pair] : pairs_) {
        for (const gpu::Buffer& buffer : pair.buffers) sum += buffer.bytes();
        for (const gpu::Texture& texture : pair.textures) sum += gpu::texture_bytes(texture.desc());
    }
    return sum;
}

/// Returns the pair of this node, created on demand. The `now` of the last run becomes `previous` of this run.
History::Pair& History::turn(const ResourceNode& node) {
    Pair& pair = pairs_[node.name];
    const bool fits = node.is_texture ? pair.textures.size() == 2 && pair.textures[0].desc() == node.texture
                                      : pair.buffers.size() == 2 && pair.buffers[0].bytes() == node.buffer.bytes;
    if (!fits) {
        pair = Pair();
        for (int i = 0; i < 2; ++i) {
            if (node.is_texture) {
                pair.textures.emplace_back(node.name, node.texture);
            } else {
                pair.buffers.emplace_back(node.name, node.buffer.bytes);
            }
        }
    }
    if (std::exchange(pair.written, false)) pair.now ^= 1;
    return pair;
}

gpu::Buffer& History::carried(const ResourceNode& node) {
    Pair& pair = pairs_[node.name];
    if (pair.buffers.size() != 1 || pair.buffers[0].bytes() != node.buffer.bytes) {
        pair = Pair();
        pair.buffers.emplace_back(node.name, node.buffer.bytes);
    }
    return pair.buffers[0];
}

// --- Executor -------------------------------------------------------------------------------------------------------

void Executor::allocate(const CompiledGraph& graph) {
    const bool same = std::equal(graph.slots.begin(), graph.slots.end(), slots_.begin(), slots_.end(),
                                 [](const Slot& wanted, const Memory& have) { return have.fits(wanted); });
    if (same) return;
    std::vector<Memory> old = std::exchange(slots_, {});
    for (const Slot& slot : graph.slots) {
        const auto found = std::find_if(old.begin(), old.end(), [&](const Memory& m) { return m.fits(slot); });
        if (found != old.end()) {
            slots_.push_back(std::exchange(*found, {}));
        } else {
            slots_.emplace_back();
        }
    }
    // Memory without use is freed before anything new is allocated: there may not be room for both.
    old.clear();
    framebuffers_.clear();
    for (std::size_t s = 0; s < graph.slots.size(); ++s) {
        const Slot& slot = graph.slots[s];
        if (slots_[s].fits(slot)) continue;
        const std::string name = fmt::format("slot {}: {}", s, graph.resources[slot.tenants.front()].node.name);
        if (slot.is_texture) {
            slots_[s].texture = std::make_unique<gpu::Texture>(name, slot.texture);
        } else {
            slots_[s].buffer = std::make_unique<gpu::Buffer>(name, slot.buffer.bytes);
        }
    }
}

bool Executor::Memory::fits(const Slot& slot) const {
    if (slot.is_texture) return texture && texture->desc() == slot.texture;
    return buffer && buffer->bytes() == slot.buffer.bytes;
}

void Executor::place(const CompiledGraph& graph) {
    allocate(graph);
    if (serial_ != graph.serial) {
        nodes_.clear();
        for (const PlannedResource& resource : graph.resources) nodes_.push_back(resource.node);
        serial_ = graph.serial;
    }
    buffer_of_.assign(graph.resources.size(), nullptr);
    texture_of_.assign(graph.resources.size(), nullptr);
    for (std::size_t r = 0; r < graph.resources.size(); ++r) {
        const PlannedResource& resource = graph.resources[r];
        const ResourceNode& node = resource.node;
        if (node.kind == ResourceKind::imported) {
            buffer_of_[r] = node.imported_buffer;
            texture_of_[r] = node.imported_texture;
        } else if (node.kind == ResourceKind::carried && resource.used) {
            buffer_of_[r] = &history_.carried(node);
        } else if (resource.slot != PlannedResource::kNoSlot) {
            buffer_of_[r] = slots_[resource.slot].buffer.get();
            texture_of_[r] = slots_[resource.slot].texture.get();
        } else if (node.kind == ResourceKind::history_now && (resource.used || graph.resources[node.partner].used)) {
            History::Pair& pair = history_.turn(node);
            for (const std::uint32_t half : {pair.now, pair.now ^ 1}) {
                const std::size_t index = half == pair.now ? r : node.partner;
                if (node.is_texture) {
                    texture_of_[index] = &pair.textures[half];
                } else {
                    buffer_of_[index] = &pair.buffers[half];
                }
            }
        }
    }
}

void Executor::run_pass(const CompiledGraph& graph, const PlannedPass& pass) {
    if (!pass.execute) throw Error("pass '" + pass.name + "'", "has no execute function");
    const DebugGroup group(pass.name);
    if (pass.barriers != 0) glMemoryBarrier(pass.barriers);
    if (poison_) {
        for (const std::uint32_t r : pass.fresh) {
            if (buffer_of_[r] != nullptr) buffer_of_[r]->fill(kPoison);
            if (texture_of_[r] != nullptr) poison_texture(*texture_of_[r]);
        }
    }
    if (std::any_of(pass.uses.begin(), pass.uses.end(), is_attachment)) gpu::default_state();
    Resources resources(*this, graph, pass);
    if (!measure_) {
        pass.execute(resources);
        return;
    }
    const double seconds = gpu::timed([&] { pass.execute(resources); });
    auto time = std::find_if(times_.begin(), times_.end(), [&](const PassTime& t) { return t.name == pass.name; });
    if (time == times_.end()) time = times_.insert(times_.end(), {pass.name, 0, 0});
    ++time->count;
    time->seconds += seconds;
}

void Executor::start_ahead(const CompiledGraph& graph) {
    std::vector<gpu::ExpectedProgram> programs;
    for (const PlannedPass& pass : graph.passes)
        if (pass.kernel && !pass.kernel->fragment)
            programs.push_back({pass.kernel->source, pass.kernel->defines, [&](const gpu::Program& program) {
                                    Resources(*this, graph, pass).bound(*pass.kernel, program);
                                }});
    programs_.compile_ahead(std::move(programs));
}

void Executor::run(const CompiledGraph& graph) {
    const bool is_new = serial_ != graph.serial;
    place(graph);
    // Later runs and readers outside the graph must see the shaders' writes, also those of a run that an exception
    // ends.
    struct Barrier {
        ~Barrier() { glMemoryBarrier(GL_ALL_BARRIER_BITS); }
    } const barrier;
    struct EndAhead {
        gpu::ProgramCache& programs;
        ~EndAhead() { programs.end_ahead(); }
    } const end{programs_};
    if (ahead_ && is_new) start_ahead(graph);
    WorkParts parts(graph.passes.size());
    for (const PlannedPass& pass : graph.passes) {
        parts.begin_next();
        run_pass(graph, pass);
    }
    for (const PlannedResource& resource : graph.resources) {
        if (resource.node.kind != ResourceKind::history_now || !resource.used) continue;
        history_.pairs_.find(resource.node.name)->second.written = true;
    }
}

std::uint32_t Executor::output_index(std::uint32_t graph, std::uint32_t resource) const {
    if (graph != serial_ || resource >= nodes_.size()) throw Error("output", "is not of the graph that ran last");
    const ResourceNode& node = nodes_[resource];
    if (!node.output && node.kind != ResourceKind::imported) throw Error("output", "'{}' is not an output", node.name);
    return resource;
}

gpu::Buffer& Executor::buffer(BufferHandle handle) {
    return *buffer_of_[output_index(handle.graph, handle.resource)];
}

gpu::Texture& Executor::texture(TextureHandle handle) {
    return *texture_of_[output_index(handle.graph, handle.resource)];
}

}  // namespace halflight::graph
