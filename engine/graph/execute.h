// Runs a compiled graph on the current context.
#pragma once

#include <initializer_list>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "engine/gpu/framebuffer.h"
#include "engine/gpu/program.h"
#include "engine/graph/compile.h"

namespace halflight::graph {

class Executor;

/// What an execute function may touch: the resources that its pass declared. Anything else throws Error.
class Resources {
  public:
    gpu::Buffer& buffer(BufferHandle handle);
    gpu::Texture& texture(TextureHandle handle);
    /// Of textures that the pass declared as attachments; made once and kept.
    const gpu::Framebuffer& framebuffer(std::initializer_list<TextureHandle> colors, TextureHandle depth = {});
    /// Return the program with all resources bound that the pass declared with a shader name. Throw Error naming pass
    /// and resource where the program does not declare the name.
    const gpu::Program& compute(const gpu::ShaderSource& source, const gpu::Defines& defines = {});
    const gpu::Program& graphics(const gpu::ShaderSource& vertex, const gpu::ShaderSource& fragment,
                                 const gpu::Defines& defines = {});
    gpu::ProgramCache& programs();  ///< for passes that bind their resources themselves

  private:
    friend class Executor;
    Resources(Executor& executor, const CompiledGraph& graph, const PlannedPass& pass)
        : executor_(executor), graph_(graph), pass_(pass) {}
    std::uint32_t checked(std::uint32_t graph, std::uint32_t resource) const;
    const gpu::Program& bound(const gpu::Program& program) const;
    Executor& executor_;
    const CompiledGraph& graph_;
    const PlannedPass& pass_;
};

/// All state that is carried from one run to the next. Pairs are found by name, turned once per run of a graph that has
/// them; carried buffers stay as they are. All is forgotten in one place: invalidate(). What changes its descriptor
/// starts from zeros again.
class History {
  public:
    /// Resize, camera cut, scene change: every `previous` reads as zeros in the next run.
    void invalidate(std::string reason);
    const std::string& last_reason() const { return reason_; }  ///< of the last invalidation; empty: there was none
    std::size_t bytes() const;

  private:
    friend class Executor;
    struct Pair {
        std::vector<gpu::Buffer> buffers;    // two, none, or one that is carried
        std::vector<gpu::Texture> textures;  // two, or none
        std::uint32_t now = 0;               // which of the two
        bool written = false;                // `now` was completed in the last run
    };
    Pair& turn(const ResourceNode& node);
    gpu::Buffer& carried(const ResourceNode& node);
    std::map<std::string, Pair, std::less<>> pairs_;
    std::string reason_;
};

struct PassTime {
    std::string name;
    std::uint64_t count = 0;
    double seconds = 0;  // CPU clock around glFinish, total
};

/// Memory is allocated in the first run of a compiled graph and kept until another one is run.
class Executor {
  public:
    explicit Executor(gpu::ProgramCache& programs) : programs_(programs) {}
    Executor(const Executor&) = delete;
    Executor& operator=(const Executor&) = delete;

    /// Throws what the passes throw; Error if a pass has no execute function.
    void run(const CompiledGraph& graph);

    /// An output (or imported resource) of the graph that ran last. Throw Error for others.
    gpu::Buffer& buffer(BufferHandle handle);
    gpu::Texture& texture(TextureHandle handle);
    /// All elements of an output that fit into the size it was declared with.
    template <class T>
    std::vector<T> read(BufferHandle handle) {
        return buffer(handle).read<T>(0, nodes_[handle.resource].buffer.bytes / sizeof(T));
    }

    History& history() { return history_; }

    /// Wait before and after each pass and add up its time. Off at first: it costs the overlap of passes.
    void measure(bool on) { measure_ = on; }
    const std::vector<PassTime>& times() const { return times_; }  ///< in the order of first execution
    void reset_times() { times_.clear(); }

    /// For tests: fill what is undefined with 0xff (NaN) before a pass writes it, so that reading it shows.
    void poison(bool on) { poison_ = on; }

  private:
    friend class Resources;
    struct Memory {  // of a slot: one of the two
        std::unique_ptr<gpu::Buffer> buffer;
        std::unique_ptr<gpu::Texture> texture;
        bool fits(const Slot& slot) const;
    };
    void allocate(const CompiledGraph& graph);
    void place(const CompiledGraph& graph);
    void run_pass(const CompiledGraph& graph, const PlannedPass& pass);
    std::uint32_t output_index(std::uint32_t graph, std::uint32_t resource) const;

    gpu::ProgramCache& programs_;
    History history_;
    std::vector<Memory> slots_;
    std::uint32_t serial_ = 0;               // of the graph that ran last
    std::vector<ResourceNode> nodes_;        // its resources
    std::vector<gpu::Buffer*> buffer_of_;    // by resource
    std::vector<gpu::Texture*> texture_of_;  // by resource
    std::map<std::vector<std::uint64_t>, gpu::Framebuffer> framebuffers_;
    std::vector<PassTime> times_;
    bool measure_ = false;
    bool poison_ = false;
};

}  // namespace halflight::graph
