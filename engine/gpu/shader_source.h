// GLSL sources: embedded files, includes and defines. No context is needed.
//
// The library embeds all of shaders/ (*.glsl *.comp *.vert *.frag, shared/*.h). For development, the environment
// variable HALFLIGHT_SHADERS names a folder that is read instead; it contains lib/ and shared/.
//
// `#include "shaders/lib/x.glsl"` is relative to the root, and includes a file once per shader, at the first place that
// the preprocessor does not skip (#if). `#version 450 core` and the defines are prepended; #version lines of files are
// ignored. Defines that a shader does not mention are left out: variants that differ in these alone have the same text,
// which drivers and the store of binaries compile once.
//
// A feature is a macro HALFLIGHT_X. It is 0 unless a variant defines it. Kernels name it once, as a constant, and
// branch on that: branches and functions that a variant leaves out are removed before the driver sees them
// (dead_code.h).
//
//     const bool kVolume = HALFLIGHT_VOLUME != 0;
//     OPTIONAL(HALFLIGHT_VOLUME) layout(std430) buffer Media { vec4 media[]; };
//     ...
//     if (kVolume) media[path] = medium;
//
// A block is active even if no code uses it. OPTIONAL declares a block under a condition of the preprocessor. Without
// the block, variables have the names of its members, so that code which is left out compiles; arrays have one element.
// Atomic functions take only members of blocks, so blocks with counters have a function with #if in their place.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <initializer_list>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace halflight::gpu {

/// A file of shaders/, named from the root ("shaders/gbuffer.vert"), or a text, which may include such files.
struct ShaderSource {
    ShaderSource(const char* file) : name(file) {}
    ShaderSource(std::string file) : name(std::move(file)) {}
    ShaderSource(std::string own_name, std::string own_text) : name(std::move(own_name)), text(std::move(own_text)) {}

    std::string name;
    std::string text;  // GLSL text; empty: that of the file `name`
};

/// Names and values of macros; their order does not matter.
class Defines {
  public:
    Defines() = default;
    Defines(std::initializer_list<std::pair<std::string, std::string>> values) {
        for (const auto& [name, value] : values) set(name, value);
    }
    void set(std::string name, std::string value);
    void set(std::string name, long long value = 1) { set(std::move(name), std::to_string(value)); }
    const std::vector<std::pair<std::string, std::string>>& values() const { return values_; }

  private:
    std::vector<std::pair<std::string, std::string>> values_;  // names and values, sorted by name, unique
};

/// The text for the compiler, and the origin of each line. #line is not used because Mesa drops the file.
struct ExpandedSource {
    struct Line {
        std::size_t file;    // index into `files`
        std::size_t number;  // >= 1
    };
    std::string text;
    std::vector<Line> lines;
    std::vector<std::string> files;
};
/// Returns whether identifiers of GLSL may contain a character.
bool in_identifier(char c);
/// Expands includes and defines. Throws Error naming file and line of an include that cannot be found.
ExpandedSource expand(const ShaderSource& source, const Defines& defines = {});

/// The first error of a compiler's log with its place, "shaders/x.comp:12", or the shader's name if the log has no
/// place. Logs of Mesa ("0:12(5): error: ...") and NVIDIA ("0(12) : error C1008: ...") are understood.
struct CompileMessage {
    std::string place;
    std::string what;
};
CompileMessage first_message(std::string_view log, const ExpandedSource& source);

/// Watch for changed, added and removed files of HALFLIGHT_SHADERS, by their sizes and times.
class ShaderWatch {
  public:
    /// Records the current files. Without HALFLIGHT_SHADERS nothing ever changes.
    ShaderWatch();
    bool watching() const { return !folder_.empty(); }
    bool changed();  ///< Returns whether files have changed since the last call or construction.

  private:
    using Files = std::map<std::filesystem::path, std::pair<std::filesystem::file_time_type, std::uintmax_t>>;
    Files files() const;

    std::filesystem::path folder_;  // watched folder; empty: none
    Files known_;
};

/// Returns the names of all embedded shaders, sorted.
std::vector<std::string_view> embedded_shaders();

}  // namespace halflight::gpu
