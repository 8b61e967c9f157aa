// All variants of programs that a renderer uses, each compiled once.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <unordered_map>
#include <vector>

#include "engine/gpu/program.h"

namespace halflight::gpu {

/// A compute program that will be asked for soon.
struct ExpectedProgram {
    ShaderSource source;
    Defines defines;
    /// Binds the textures that the program will have. It is called on another thread, with another context.
    std::function<void(const Program&)> bind;
};

/// Owner of every variant of a program. References stay valid as long as the cache; reload() replaces the programs that
/// they refer to.
class ProgramCache {
  public:
    /// Creates a cache. `binaries` is as for Program and must outlive the cache.
    explicit ProgramCache(const ProgramBinaries* binaries = nullptr);
    ~ProgramCache();

    const Program& compute(const ShaderSource& source, const Defines& defines = {});
    const Program& graphics(const ShaderSource& vertex, const ShaderSource& fragment, const Defines& defines = {});

    /// Compiles programs on a second thread until end_ahead(), those with the most defines first, while the caller uses
    /// others. Mesa's software driver translates a program at its first dispatch, into machine code for the formats of
    /// the bound textures, and keeps the code on disk; so programs are dispatched, too, without workgroups. Nothing
    /// happens with other drivers, without a store of binaries, and where that store has the first program, as it then
    /// has the others. What `programs` refers to must stay valid, and their textures must not be replaced, until
    /// end_ahead().
    void compile_ahead(std::vector<ExpectedProgram> programs);
    /// Waits for the program that is being compiled. Those that were not asked for are dropped.
    void end_ahead();

    /// Recompiles the programs whose shaders have changed (HALFLIGHT_SHADERS), and returns their number. They lose the
    /// values of their uniforms. Throws what Program throws for the first program that fails; then all programs stay as
    /// they were.
    std::size_t reload();

    std::size_t count() const { return entries_.size(); }
    double seconds() const { return seconds_; }  ///< Returns the CPU time of compiling and linking, seconds.

  private:
    struct Entry {
        std::vector<ShaderSource> stages;  // a compute shader, or a vertex and a fragment shader
        Defines defines;
        std::unique_ptr<Program> program;
    };
    class Ahead;
    template <class... Stages>
    const Program& get(const Defines& defines, const Stages&... stages);
    std::unique_ptr<Program> made(const std::string& key, const Entry& entry);
    std::unordered_map<std::string, Entry> entries_;
    const ProgramBinaries* binaries_;
    double seconds_ = 0;
    std::unique_ptr<Ahead> ahead_;
};

}  // namespace halflight::gpu
