// Render graph: passes declare what they read and write; the graph culls, orders, places and executes them.
//
//   Graph g;
//   Pass p = g.add_pass("diffuse");                      // setup runs now
//   BufferHandle rays = p.write(g.create_buffer("diffuse rays", {bytes}), Access::storage_write);
//   p.read(surface, Access::storage_read);
//   p.execute([=](Resources& r) { ... r.buffer(rays) ... });   // runs later, maybe many times, maybe never
//   g.output(rays);                                      // what is not needed for an output is culled
//   CompiledGraph c = compile(g);                        // pure: no OpenGL
//   Executor e; e.run(c, ...);
//
// A handle names one version of a resource. write() returns the next version and retires the old one: reading or writing
// a retired version afterwards throws Error naming pass and resource, and so does a read of what nobody has written.
// An execute function may capture handles, values, and references to what outlives the graph; never other passes' data.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "engine/gpu/buffer.h"
#include "engine/gpu/texture.h"

namespace halflight::graph {

/// How a pass touches a resource; barriers follow from it and from nothing else.
enum class Access : std::uint8_t {
    storage_read,        // shader storage block
    storage_write,       // shader storage block; the old content is lost
    storage_read_write,  // shader storage block; the old content is kept
    texture_read,        // sampler, samplerBuffer
    uniform_read,        // uniform block
    indirect_read,       // indirect dispatch or draw arguments
    image_write,         // imageStore
    color_attachment,    // rendered to
    depth_attachment,    // depth tested and written
    transfer_read,       // copied from, read back
    transfer_write,      // copied to, cleared; the old content is lost
};

struct BufferDesc {
    std::size_t bytes = 0;
    bool operator==(const BufferDesc&) const = default;
};

/// Typed index of one version of one resource.
template <class Tag>
struct Handle {
    std::uint32_t resource = ~0u;
    std::uint32_t version = 0;
    explicit operator bool() const { return resource != ~0u; }
    bool operator==(const Handle&) const = default;
};
using BufferHandle = Handle<struct BufferTag>;
using TextureHandle = Handle<struct TextureTag>;

/// State carried from one run to the next, owned by the executor's History. `previous` is what `now` was in the last run
/// (zeros in the first run and after an invalidation).
template <class H>
struct HistoryPair {
    H now;
    H previous;
};

class Graph;
class Resources;

/// A pass under construction; cheap to copy, valid as long as its graph.
class Pass {
  public:
    BufferHandle read(BufferHandle, Access);
    TextureHandle read(TextureHandle, Access);
    [[nodiscard]] BufferHandle write(BufferHandle, Access);
    [[nodiscard]] TextureHandle write(TextureHandle, Access);
    /// The pass is kept although nothing reads what it writes (it reports to the outside world).
    void keep();
    void execute(std::function<void(Resources&)>);
    // private part: see the implementation
  private:
    friend class Graph;
    Pass(Graph& graph, std::uint32_t index) : graph_(&graph), index_(index) {}
    Graph* graph_;
    std::uint32_t index_;
};

class Graph {
  public:
    Pass add_pass(std::string name);
    BufferHandle create_buffer(std::string name, BufferDesc);
    TextureHandle create_texture(std::string name, gpu::TextureDesc);
    /// Owned by somebody else and outliving every run; may be written in place (its content survives runs).
    BufferHandle import_buffer(std::string name, gpu::Buffer&);
    TextureHandle import_texture(std::string name, gpu::Texture&);
    HistoryPair<BufferHandle> history_buffer(std::string name, BufferDesc);
    HistoryPair<TextureHandle> history_texture(std::string name, gpu::TextureDesc);
    void output(BufferHandle);
    void output(TextureHandle);
    // ... the graph room's owner completes this: data for compile(), CompiledGraph, Executor, History, dot dump.
};

}  // namespace halflight::graph
