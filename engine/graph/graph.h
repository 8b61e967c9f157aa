// Render graph: passes declare what they read and write; the graph culls, orders, places and executes them.
//
//   Graph g;
//   Pass p = g.add_pass("diffuse");                            // setup runs now
//   BufferHandle rays = p.write(g.create_buffer("diffuse rays", {bytes}), Access::storage_write, "Rays");
//   p.read(surfaces, Access::storage_read, "Surfaces");        // bound to `buffer Surfaces { ... };` of the kernel
//   p.kernel({"shaders/diffuse.comp", defines});               // may be compiled before the pass runs
//   p.execute([=](Resources& r) {                              // runs later, maybe many times, maybe never
//       r.kernel().dispatch(groups);
//   });
//   g.output(rays);                                            // passes that no output needs are culled
//   CompiledGraph c = compile(g);                              // compile.h; pure: no OpenGL
//   Executor e(programs); e.run(c);                            // execute.h
//
// A handle names one version of a resource. write() returns the next version and retires the old one. Reading or
// writing a retired version throws Error naming pass and resource, and so does reading a resource that has no content
// yet. A pass is closed when the next one is added: passes therefore run in the order of their declaration, and no
// cycle can be declared. A pass that needs its own output is two passes; a pass that updates in place declares
// storage_read_write.
//
// An execute function may capture handles, values, and references to objects that outlive the graph; never other
// passes' data.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "engine/gpu/buffer.h"
#include "engine/gpu/shader_source.h"
#include "engine/gpu/texture.h"

namespace halflight::gpu {
class Program;
}

namespace halflight::graph {

/// Use of a resource by a pass. Barriers follow from the declared accesses alone.
enum class Access : std::uint8_t {
    storage_read,        // shader storage block
    storage_write,       // shader storage block; the old content is lost
    storage_read_write,  // shader storage block; the old content is kept
    texture_read,        // sampler, samplerBuffer
    uniform_read,        // uniform block
    indirect_read,       // indirect dispatch or draw arguments
    image_read,          // imageLoad
    image_write,         // imageStore; old content is kept
    color_attachment,    // rendered to; old content is kept
    depth_attachment,    // depth tested and written; old content is kept
    transfer_read,       // copied from, read back
    transfer_write,      // copied to, cleared; the old content is lost
};
const char* name(Access access);
bool writes(Access access);

/// Name of a resource in the kernels of a pass: of a storage or uniform block, a sampler or an image. If it is empty,
/// the pass binds the resource itself.
struct ShaderName {
    ShaderName() = default;
    /// Names a resource; `texels` is the sized format of a buffer read as a texture buffer, else 0.
    ShaderName(const char* shader_name, GLenum texels = 0) : name(shader_name), format(texels) {}
    std::string name;
    GLenum format = 0;
};

struct BufferDesc {
    std::size_t bytes = 0;
    bool operator==(const BufferDesc&) const = default;
};

/// Typed index of one version of one resource of one graph.
template <class Tag>
struct Handle {
    std::uint32_t resource = ~0u;
    std::uint32_t version = 0;
    std::uint32_t graph = 0;
    explicit operator bool() const { return resource != ~0u; }
    bool operator==(const Handle&) const = default;
};
using BufferHandle = Handle<struct BufferTag>;
using TextureHandle = Handle<struct TextureTag>;

/// A resource whose content is carried from one run to the next, owned by the executor's History under its name.
/// `previous` holds the content of `now` from the last run of a graph with this pair: zeros in the first run and after
/// an invalidation. It is read-only. `now` starts unwritten. A live reader of `previous` keeps the writers of `now`
/// alive.
template <class H>
struct HistoryPair {
    H now;
    H previous;
};

enum class ResourceKind : std::uint8_t { transient, imported, history_now, history_previous, carried };

/// A declared resource. `is_texture` tells which of the two descriptors is valid.
struct ResourceNode {
    std::string name;
    ResourceKind kind = ResourceKind::transient;
    bool is_texture = false;
    BufferDesc buffer;
    gpu::TextureDesc texture;
    gpu::Buffer* imported_buffer = nullptr;
    gpu::Texture* imported_texture = nullptr;
    std::uint32_t partner = ~0u;  // history: the other half of the pair
    bool output = false;
    std::vector<std::uint32_t> writers;  // pass index of the writer of version i, or kNobody, or kOutside

    static constexpr std::uint32_t kNobody = ~0u;   // there is no content yet
    static constexpr std::uint32_t kOutside = ~1u;  // there is content from before the run
    std::uint32_t current() const { return static_cast<std::uint32_t>(writers.size()) - 1; }
};

/// One declared use of a resource. A write makes `version`; it depends on version - 1 if `keeps` is set.
struct Use {
    std::uint32_t resource = 0;
    std::uint32_t version = 0;
    Access access = Access::storage_read;
    bool write = false;
    bool keeps = false;
    ShaderName shader_name;
};

class Graph;
class Resources;

/// The program of a pass: a compute kernel, or with `fragment` a vertex and a fragment shader.
struct Kernel {
    gpu::ShaderSource source;
    gpu::Defines defines{};
    /// Binds the resources that Resources::kernel() does not bind by itself; may be empty.
    std::function<void(Resources&, const gpu::Program&)> bind{};
    std::optional<gpu::ShaderSource> fragment{};
};

struct PassNode {
    std::string name;
    std::vector<Use> uses;  // uses in order of declaration
    bool kept = false;
    std::optional<Kernel> kernel{};
    std::function<void(Resources&)> execute{};
};

/// A pass under construction. It is cheap to copy, and valid as long as its graph is not moved.
class Pass {
  public:
    /// Declares a read and returns the handle unchanged. Resources::kernel() binds the resource to `shader_name`.
    /// Throws Error on a retired or unwritten version.
    BufferHandle read(BufferHandle handle, Access access, const ShaderName& shader_name = {});
    TextureHandle read(TextureHandle handle, Access access, const ShaderName& shader_name = {});
    /// Declares a write and returns the next version. Throws Error on a retired version, on a `previous`, on an output,
    /// and on storage_read_write of a resource without content.
    [[nodiscard]] BufferHandle write(BufferHandle handle, Access access, const ShaderName& shader_name = {});
    [[nodiscard]] TextureHandle write(TextureHandle handle, Access access, const ShaderName& shader_name = {});
    /// Keeps the pass although nothing reads its outputs, for passes that report to the outside.
    void keep();
    /// Declares the program that the pass runs (Resources::kernel()). Compute kernels can then be compiled ahead of
    /// time.
    void kernel(Kernel kernel);
    void execute(std::function<void(Resources&)> function);

  private:
    friend class Graph;
    Pass(Graph& graph, std::uint32_t index) : graph_(&graph), index_(index) {}
    Graph* graph_;
    std::uint32_t index_;
};

class Graph {
  public:
    Graph();
    Graph(const Graph&) = delete;
    Graph& operator=(const Graph&) = delete;

    /// Starts a pass and closes the one before. Passes may share a name; their times are then added up.
    Pass add_pass(std::string name);
    /// Declares a transient resource; its content is undefined until written. The buffer that a pass gets may be larger
    /// than declared, as transients share memory: kernels must not rely on .length().
    BufferHandle create_buffer(std::string name, BufferDesc desc);
    TextureHandle create_texture(std::string name, gpu::TextureDesc desc);
    /// Declares a resource that is owned elsewhere and outlives every run. It has content and may be written in place.
    /// Its writers are culled unless its last version is an output.
    BufferHandle import_buffer(std::string name, gpu::Buffer& buffer);
    TextureHandle import_texture(std::string name, gpu::Texture& texture);
    /// Declares a history pair. Throws Error if another pair has the name.
    HistoryPair<BufferHandle> history_buffer(std::string name, BufferDesc desc);
    HistoryPair<TextureHandle> history_texture(std::string name, gpu::TextureDesc desc);
    /// Declares state that is updated in place (storage_read_write). It takes half the memory of a pair, and suits
    /// buffers whose elements depend on their own past alone, such as sums. History owns it like a pair; it holds zeros
    /// in the first run and after an invalidation. Its writers are culled unless its last version is an output. Throws
    /// Error if the name is taken.
    BufferHandle carried_buffer(std::string name, BufferDesc desc);
    /// Marks a resource as an output, readable after a run (Executor::buffer, Executor::texture). The handle must be
    /// its last version.
    void output(BufferHandle handle);
    void output(TextureHandle handle);

    const std::vector<PassNode>& passes() const { return passes_; }
    const std::vector<ResourceNode>& resources() const { return resources_; }
    std::uint32_t serial() const { return serial_; }  ///< Returns Handle::graph of the graph's handles.
    BufferDesc desc(BufferHandle handle) const;
    gpu::TextureDesc desc(TextureHandle handle) const;

  private:
    friend class Pass;
    std::uint32_t add_resource(ResourceNode node);
    void mark_output(std::uint32_t graph, std::uint32_t resource, std::uint32_t version);
    template <class H>
    void read(std::uint32_t pass, const H& handle, Access access, const ShaderName& shader_name);
    template <class H>
    H write(std::uint32_t pass, H handle, Access access, const ShaderName& shader_name);
    ResourceNode& checked(const std::string& who, std::uint32_t graph, std::uint32_t resource, std::uint32_t version);
    PassNode& open_pass(std::uint32_t pass, std::string& who);
    template <class H>
    HistoryPair<H> make_pair(H now, H previous);
    void check_history_name(std::uint32_t resource) const;

    std::uint32_t serial_;
    std::vector<PassNode> passes_;
    std::vector<ResourceNode> resources_;
};

}  // namespace halflight::graph
