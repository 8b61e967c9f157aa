// All variants of programs that a renderer uses, each compiled once.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "engine/gpu/program.h"

namespace halflight::gpu {

/// A compute program that will be asked for soon.
struct ExpectedProgram {
    ShaderSource source;
    Defines defines;
    /// Binds the textures that the program will have. It is not empty, and is called on another thread, with another
    /// context.
    std::function<void(const Program&)> bind;
};
/// Returns whether programs can be compiled ahead: the driver of the current context is llvmpipe, it may use two
/// threads, and Mesa keeps its machine code on disk.
bool can_compile_ahead();

/// Owner of every variant of a program. References stay valid as long as the cache, or until end_period(); reload()
/// replaces the programs that they refer to.
class ProgramCache {
  public:
    /// Creates a cache. `binaries` is as for Program and must outlive the cache.
    explicit ProgramCache(const ProgramBinaries* binaries = nullptr);
    ~ProgramCache();

    const Program& compute(const ShaderSource& source, const Defines& defines = {});
    const Program& graphics(const ShaderSource& vertex, const ShaderSource& fragment, const Defines& defines = {});

    /// Compiles programs on a second thread until end_ahead(), those with the most defines first, while the caller uses
    /// others. The driver translates a program at its first dispatch, into machine code for the formats of the bound
    /// textures, and keeps the code on disk. Programs are therefore dispatched, too, without workgroups. Until
    /// end_ahead(), what `programs` refers to must stay valid, and their textures must not be replaced.
    ///
    /// Each program is compiled ahead at most once. Nothing happens if can_compile_ahead() is false, if there is no
    /// store of binaries, or if the store has the first program, as it then has the others.
    void compile_ahead(std::vector<ExpectedProgram> programs);
    /// Waits for the program that is being compiled. Those that were not asked for are dropped.
    void end_ahead();

    /// Ends a period, such as that of a scene, and removes programs that nobody asked for in the last few.
    /// Precondition: nobody has references to programs, and none is compiled ahead.
    void end_period();
    /// Recompiles the programs whose shaders have changed (HALFLIGHT_SHADERS), and returns their number. They lose the
    /// values of their uniforms. Programs of earlier periods are removed instead. Throws what Program throws for the
    /// first program that fails; then all programs stay as they were.
    std::size_t reload();

    std::size_t count() const { return entries_.size(); }
    /// Returns the seconds that callers waited for compiling, linking and loading.
    double seconds() const { return seconds_; }
    /// Returns the part of seconds() that was spent on programs that the store did not have.
    double compile_seconds() const { return compile_seconds_; }

  private:
    struct Entry {
        std::vector<ShaderSource> stages;  // a compute shader, or a vertex and a fragment shader
        Defines defines;
        std::unique_ptr<Program> program;
        int age = 0;  // calls of end_period() since it was asked for
    };
    class Ahead;
    template <class... Stages>
    const Program& get(const Defines& defines, const Stages&... stages);
    std::unique_ptr<Program> made(const std::string& key, const Entry& entry);
    void remove_older(int age);
    std::unordered_map<std::string, Entry> entries_;
    const ProgramBinaries* binaries_;
    double seconds_ = 0, compile_seconds_ = 0;
    std::unordered_set<std::string> tried_;  // keys of programs that were compiled ahead
    std::unique_ptr<Ahead> ahead_;
};

}  // namespace halflight::gpu
