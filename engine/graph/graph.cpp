#include "engine/graph/graph.h"

#include <algorithm>
#include <atomic>
#include <cassert>
#include <utility>

#include "engine/core/error.h"

namespace halflight::graph {
namespace {

bool fits(Access access, bool is_texture) {
    switch (access) {
        case Access::storage_read:
        case Access::storage_write:
        case Access::storage_read_write:
        case Access::uniform_read:
        case Access::indirect_read:
            return !is_texture;
        case Access::image_read:
        case Access::image_write:
        case Access::color_attachment:
        case Access::depth_attachment:
            return is_texture;
        case Access::texture_read:
        case Access::transfer_read:
        case Access::transfer_write:
            return true;
    }
    return false;
}

/// Returns whether resources with this access have a name in the shader.
bool has_shader_name(Access access) {
    switch (access) {
        case Access::storage_read:
        case Access::storage_write:
        case Access::storage_read_write:
        case Access::texture_read:
        case Access::uniform_read:
        case Access::image_read:
        case Access::image_write:
            return true;
        default:
            return false;
    }
}

void check_shader_name(const std::string& who, const ResourceNode& node, Access access, const ShaderName& shader) {
    if (!shader.name.empty() && !has_shader_name(access))
        throw Error(who, "names '{}' for shaders, but uses it by {}", node.name, name(access));
    const bool texels = !shader.name.empty() && access == Access::texture_read && !node.is_texture;
    if (texels != (shader.format != 0))
        throw Error(who, "reads '{}' by {} {} a texel format", node.name, name(access), texels ? "without" : "with");
}

/// Returns whether earlier contents may remain after a write by this access.
bool may_keep(Access access) {
    return access == Access::storage_read_write || access == Access::image_write ||
           access == Access::color_attachment || access == Access::depth_attachment;
}

std::string quoted(const char* what, const std::string& name) {
    return fmt::format("{} '{}'", what, name);
}

}  // namespace

const char* name(Access access) {
    switch (access) {
        case Access::storage_read:
            return "storage_read";
        case Access::storage_write:
            return "storage_write";
        case Access::storage_read_write:
            return "storage_read_write";
        case Access::texture_read:
            return "texture_read";
        case Access::uniform_read:
            return "uniform_read";
        case Access::indirect_read:
            return "indirect_read";
        case Access::image_read:
            return "image_read";
        case Access::image_write:
            return "image_write";
        case Access::color_attachment:
            return "color_attachment";
        case Access::depth_attachment:
            return "depth_attachment";
        case Access::transfer_read:
            return "transfer_read";
        case Access::transfer_write:
            return "transfer_write";
    }
    return "";
}

bool writes(Access access) {
    return may_keep(access) || access == Access::storage_write || access == Access::transfer_write;
}

// --- Uses ------------------------------------------------------------------------------------------------------------

template <class H>
void Graph::read(std::uint32_t pass, const H& handle, Access access, const ShaderName& shader_name) {
    std::string who;
    PassNode& reader = open_pass(pass, who);
    const ResourceNode& node = checked(who, handle.graph, handle.resource, handle.version);
    if (writes(access) || !fits(access, node.is_texture)) {
        throw Error(who, "reads '{}' by {}", node.name, name(access));
    }
    check_shader_name(who, node, access, shader_name);
    const std::uint32_t writer = node.writers[handle.version];
    if (writer == ResourceNode::kNobody) throw Error(who, "reads '{}', which nobody has written", node.name);
    if (writer == pass) throw Error(who, "reads '{}', which it writes itself", node.name);
    reader.uses.push_back({handle.resource, handle.version, access, false, false, shader_name});
}

template <class H>
H Graph::write(std::uint32_t pass, H handle, Access access, const ShaderName& shader_name) {
    std::string who;
    PassNode& writer = open_pass(pass, who);
    ResourceNode& node = checked(who, handle.graph, handle.resource, handle.version);
    const auto refuse = [&](const char* why) {
        throw Error(who, "writes '{}' by {}: {}", node.name, name(access), why);
    };
    if (!writes(access)) refuse("that is a way to read");
    if (!fits(access, node.is_texture)) refuse(node.is_texture ? "it is a texture" : "it is a buffer");
    if (node.kind == ResourceKind::history_previous) refuse("the past is only read");
    if (node.output) refuse("it is an output already");
    if (node.writers[handle.version] == pass) refuse("it has written it before");
    for (const Use& use : writer.uses) {
        if (use.resource == handle.resource) refuse("it reads it, too; to update in place is storage_read_write");
    }
    check_shader_name(who, node, access, shader_name);
    const bool has_content = node.writers[handle.version] != ResourceNode::kNobody;
    if (access == Access::storage_read_write && !has_content) refuse("nobody has written it before");
    node.writers.push_back(pass);
    handle.version = node.current();
    writer.uses.push_back(
        {handle.resource, handle.version, access, true, may_keep(access) && has_content, shader_name});
    return handle;
}

// --- Pass -----------------------------------------------------------------------------------------------------------

BufferHandle Pass::read(BufferHandle handle, Access access, const ShaderName& shader_name) {
    graph_->read(index_, handle, access, shader_name);
    return handle;
}
TextureHandle Pass::read(TextureHandle handle, Access access, const ShaderName& shader_name) {
    graph_->read(index_, handle, access, shader_name);
    return handle;
}
BufferHandle Pass::write(BufferHandle handle, Access access, const ShaderName& shader_name) {
    return graph_->write(index_, handle, access, shader_name);
}
TextureHandle Pass::write(TextureHandle handle, Access access, const ShaderName& shader_name) {
    return graph_->write(index_, handle, access, shader_name);
}
void Pass::keep() {
    graph_->passes_[index_].kept = true;
}
void Pass::kernel(Kernel kernel) {
    graph_->passes_[index_].kernel = std::move(kernel);
}
void Pass::execute(std::function<void(Resources&)> function) {
    graph_->passes_[index_].execute = std::move(function);
}

// --- Graph ----------------------------------------------------------------------------------------------------------

Graph::Graph() {
    static std::atomic<std::uint32_t> next_serial = 1;
    serial_ = next_serial++;
}

Pass Graph::add_pass(std::string pass_name) {
    passes_.push_back({std::move(pass_name), {}, false, {}});
    return Pass(*this, static_cast<std::uint32_t>(passes_.size() - 1));
}

std::uint32_t Graph::add_resource(ResourceNode node) {
    node.writers = {ResourceNode::kNobody};
    resources_.push_back(std::move(node));
    return static_cast<std::uint32_t>(resources_.size() - 1);
}

BufferHandle Graph::create_buffer(std::string resource_name, BufferDesc desc) {
    ResourceNode node;
    node.name = std::move(resource_name);
    node.buffer = desc;
    return {add_resource(std::move(node)), 0, serial_};
}

TextureHandle Graph::create_texture(std::string resource_name, gpu::TextureDesc desc) {
    ResourceNode node;
    node.name = std::move(resource_name);
    node.is_texture = true;
    node.texture = desc;
    return {add_resource(std::move(node)), 0, serial_};
}

BufferHandle Graph::import_buffer(std::string resource_name, gpu::Buffer& buffer) {
    const BufferHandle handle = create_buffer(std::move(resource_name), {buffer.bytes()});
    ResourceNode& node = resources_.back();
    node.kind = ResourceKind::imported;
    node.imported_buffer = &buffer;
    node.writers = {ResourceNode::kOutside};
    return handle;
}

TextureHandle Graph::import_texture(std::string resource_name, gpu::Texture& texture) {
    const TextureHandle handle = create_texture(std::move(resource_name), texture.desc());
    ResourceNode& node = resources_.back();
    node.kind = ResourceKind::imported;
    node.imported_texture = &texture;
    node.writers = {ResourceNode::kOutside};
    return handle;
}

void Graph::check_history_name(std::uint32_t resource) const {
    for (std::uint32_t i = 0; i < resource; ++i) {
        const ResourceNode& other = resources_[i];
        const bool is_history = other.kind == ResourceKind::history_now || other.kind == ResourceKind::carried;
        if (is_history && other.name == resources_[resource].name) {
            throw Error(quoted("history", other.name), "is declared twice");
        }
    }
}

template <class H>
HistoryPair<H> Graph::make_pair(H now, H previous) {
    ResourceNode& first = resources_[now.resource];
    ResourceNode& second = resources_[previous.resource];
    check_history_name(now.resource);
    first.kind = ResourceKind::history_now;
    first.partner = previous.resource;
    second.kind = ResourceKind::history_previous;
    second.partner = now.resource;
    second.writers = {ResourceNode::kOutside};
    return {now, previous};
}

HistoryPair<BufferHandle> Graph::history_buffer(std::string resource_name, BufferDesc desc) {
    const BufferHandle now = create_buffer(resource_name, desc);
    return make_pair(now, create_buffer(resource_name + " (previous)", desc));
}

HistoryPair<TextureHandle> Graph::history_texture(std::string resource_name, gpu::TextureDesc desc) {
    const TextureHandle now = create_texture(resource_name, desc);
    return make_pair(now, create_texture(resource_name + " (previous)", desc));
}

BufferHandle Graph::carried_buffer(std::string resource_name, BufferDesc desc) {
    const BufferHandle handle = create_buffer(std::move(resource_name), desc);
    check_history_name(handle.resource);
    resources_[handle.resource].kind = ResourceKind::carried;
    resources_[handle.resource].writers = {ResourceNode::kOutside};
    return handle;
}

void Graph::mark_output(std::uint32_t graph, std::uint32_t resource, std::uint32_t version) {
    ResourceNode& node = checked("output", graph, resource, version);
    if (node.writers[version] == ResourceNode::kNobody) {
        throw Error("output", "nobody has written '{}'", node.name);
    }
    node.output = true;
}
void Graph::output(BufferHandle handle) {
    mark_output(handle.graph, handle.resource, handle.version);
}
void Graph::output(TextureHandle handle) {
    mark_output(handle.graph, handle.resource, handle.version);
}

BufferDesc Graph::desc(BufferHandle handle) const {
    assert(handle.graph == serial_);
    return resources_[handle.resource].buffer;
}
gpu::TextureDesc Graph::desc(TextureHandle handle) const {
    assert(handle.graph == serial_);
    return resources_[handle.resource].texture;
}

/// Returns the resource. Throws Error unless the handle is its current version in this graph.
ResourceNode& Graph::checked(const std::string& who, std::uint32_t graph, std::uint32_t resource,
                             std::uint32_t version) {
    if (resource == ~0u) throw Error(who, "uses an empty handle");
    if (graph != serial_) throw Error(who, "uses a handle of another graph (resource {})", resource);
    ResourceNode& node = resources_[resource];
    if (version != node.current()) {
        throw Error(who, "uses '{}' as it was before pass '{}' wrote it", node.name,
                    passes_[node.writers[version + 1]].name);
    }
    return node;
}

PassNode& Graph::open_pass(std::uint32_t pass, std::string& who) {
    who = quoted("pass", passes_[pass].name);
    if (pass + 1 != passes_.size()) {
        throw Error(who, "declares a use after pass '{}' was added", passes_[pass + 1].name);
    }
    return passes_[pass];
}

}  // namespace halflight::graph
