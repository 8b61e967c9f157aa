// Execution of a compiled graph on the current context.
#pragma once

#include <initializer_list>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "engine/gpu/framebuffer.h"
#include "engine/gpu/program_cache.h"
#include "engine/graph/compile.h"

namespace halflight::graph {

class Executor;

/// Access of an execute function to the resources that its pass declared. Throws Error for any other resource.
class Resources {
  public:
    gpu::Buffer& buffer(BufferHandle handle);
    gpu::Texture& texture(TextureHandle handle);
    /// Returns the framebuffer of textures that the pass declared as attachments; made once and kept.
    const gpu::Framebuffer& framebuffer(std::initializer_list<TextureHandle> colors, TextureHandle depth = {});
    /// Returns the program that the pass declared by Pass::kernel(), with all resources bound that the pass declared
    /// with a shader name. Throws Error naming pass and resource if the program does not declare the name.
    const gpu::Program& kernel();
    /// Returns the program of another kernel, which is known only when the pass runs.
    const gpu::Program& kernel(const Kernel& kernel);
    gpu::ProgramCache& programs();  ///< Serves passes that bind their resources themselves.

  private:
    friend class Executor;
    Resources(Executor& executor, const CompiledGraph& graph, const PlannedPass& pass)
        : executor_(executor), graph_(graph), pass_(pass) {}
    std::uint32_t checked(std::uint32_t graph, std::uint32_t resource) const;
    const gpu::Program& bound(const Kernel& kernel, const gpu::Program& program);
    Executor& executor_;
    const CompiledGraph& graph_;
    const PlannedPass& pass_;
};

/// Owns all state that is carried from one run to the next, by name. The two halves of a pair are swapped once per run
/// of a graph that has it; carried buffers stay as they are. State whose descriptor changes starts from zeros again.
class History {
  public:
    /// Sets all state to zeros, on a resize, camera cut or scene change.
    void invalidate(std::string reason);
    const std::string& last_reason() const {
        return reason_;
    }  ///< reason of the last invalidation; empty before the first
    std::size_t bytes() const;

  private:
    friend class Executor;
    struct Pair {
        std::vector<gpu::Buffer> buffers;    // two buffers for a pair, one for a carried buffer, else none
        std::vector<gpu::Texture> textures;  // two textures for a pair, else none
        std::uint32_t now = 0;               // index of the current one of the two
        bool written = false;                // true: `now` was completed in the last run
    };
    Pair& turn(const ResourceNode& node);
    gpu::Buffer& carried(const ResourceNode& node);
    std::map<std::string, Pair, std::less<>> pairs_;
    std::string reason_;
};

struct PassTime {
    std::string name;
    std::uint64_t count = 0;
    double seconds = 0;  // total seconds, CPU clock around glFinish()
};

/// Executor of compiled graphs. It owns their memory from the first run of a graph until another graph runs.
class Executor {
  public:
    explicit Executor(gpu::ProgramCache& programs) : programs_(programs) {}
    Executor(const Executor&) = delete;
    Executor& operator=(const Executor&) = delete;

    /// Makes the memory of a graph, as run() does first, so that carried buffers can be filled before its first run.
    void place(const CompiledGraph& graph);
    /// Runs the graph. Throws what the passes throw, and Error if a pass has no execute function.
    void run(const CompiledGraph& graph);

    /// Returns an output or imported resource of the graph that ran last. Throws Error for others.
    gpu::Buffer& buffer(BufferHandle handle);
    gpu::Texture& texture(TextureHandle handle);
    /// Returns all elements of an output that fit into its declared size.
    template <class T>
    std::vector<T> read(BufferHandle handle) {
        return buffer(handle).read<T>(0, nodes_[handle.resource].buffer.bytes / sizeof(T));
    }

    History& history() { return history_; }

    /// Switches timing of passes, off by default: the executor then waits before and after each pass, so that passes
    /// no longer overlap.
    void measure(bool on) { measure_ = on; }
    const std::vector<PassTime>& times() const { return times_; }  ///< Returns times in order of first run.
    void reset_times() { times_.clear(); }

    /// Switches compiling of kernels ahead of their passes (ProgramCache::compile_ahead()), off by default. Resources
    /// that kernels bind by themselves must not be replaced during a run.
    void compile_ahead(bool on) { ahead_ = on; }

    /// Switches poisoning, for tests. Undefined content is filled with 0xff (NaN) before a pass writes it. Results that
    /// depend on it then show NaN.
    void poison(bool on) { poison_ = on; }

  private:
    friend class Resources;
    struct Memory {  // buffer or texture of a slot
        std::unique_ptr<gpu::Buffer> buffer;
        std::unique_ptr<gpu::Texture> texture;
        bool fits(const Slot& slot) const;
    };
    void allocate(const CompiledGraph& graph);
    void start_ahead(const CompiledGraph& graph);
    void run_pass(const CompiledGraph& graph, const PlannedPass& pass);
    std::uint32_t output_index(std::uint32_t graph, std::uint32_t resource) const;

    gpu::ProgramCache& programs_;
    History history_;
    std::vector<Memory> slots_;
    std::uint32_t serial_ = 0;               // serial of the last graph
    std::vector<ResourceNode> nodes_;        // resources of the last graph
    std::vector<gpu::Buffer*> buffer_of_;    // buffers by resource; null: none
    std::vector<gpu::Texture*> texture_of_;  // textures by resource; null: none
    std::map<std::vector<std::uint64_t>, gpu::Framebuffer> framebuffers_;
    std::vector<PassTime> times_;
    bool measure_ = false;
    bool ahead_ = false;
    bool poison_ = false;
};

}  // namespace halflight::graph
