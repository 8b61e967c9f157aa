// GLSL text: where it comes from and how includes and defines get into it. Needs no context.
//
// All of shaders/ (*.glsl *.comp *.vert *.frag, shared/*.h) is part of the library. The environment variable
// HALFLIGHT_SHADERS names a folder that is read instead, for development: the one that holds lib/ and shared/.
// `#include "shaders/lib/x.glsl"` is relative to the root and includes a file once per shader, wherever the compiler
// comes by it first: an include under a condition (#if) that does not hold is none. `#version 450 core` and the defines
// are put in front; a #version line of a file itself is ignored.
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

/// A file of shaders/, named from the root ("shaders/gbuffer.vert"), or a text of one's own, which may include such
/// files.
struct ShaderSource {
    ShaderSource(const char* file) : name(file) {}
    ShaderSource(std::string file) : name(std::move(file)) {}
    ShaderSource(std::string own_name, std::string own_text) : name(std::move(own_name)), text(std::move(own_text)) {}

    std::string name;
    std::string text;  // empty: that of the file
};

/// Names and values of macros; order does not matter.
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
    std::vector<std::pair<std::string, std::string>> values_;  // sorted by name, each once
};

/// What the compiler sees, and where each line of it comes from. (#line would say it, too, but Mesa loses the file.)
struct ExpandedSource {
    struct Line {
        std::size_t file;    // index into files
        std::size_t number;  // from 1
    };
    std::string text;
    std::vector<Line> lines;
    std::vector<std::string> files;
};
/// Throws Error naming file and line of an include that cannot be found.
ExpandedSource expand(const ShaderSource& source, const Defines& defines = {});

/// The first error of a compiler's log with the place it speaks of, "shaders/x.comp:12" (just the shader's name where
/// the log has no place), for Mesa's ("0:12(5): error: ...") and NVIDIA's ("0(12) : error C1008: ...") way of telling
/// it.
struct CompileMessage {
    std::string place;
    std::string what;
};
CompileMessage first_message(std::string_view log, const ExpandedSource& source);

/// Whether files of HALFLIGHT_SHADERS have changed, come or gone, by their sizes and times.
class ShaderWatch {
  public:
    /// Of what is there now. Without HALFLIGHT_SHADERS nothing ever changes.
    ShaderWatch();
    bool watching() const { return !folder_.empty(); }
    bool changed();  ///< since the last call, or construction

  private:
    using Files = std::map<std::filesystem::path, std::pair<std::filesystem::file_time_type, std::uintmax_t>>;
    Files files() const;

    std::filesystem::path folder_;  // empty: none
    Files known_;
};

/// Names of all shaders that are part of the library, sorted.
std::vector<std::string_view> embedded_shaders();

}  // namespace halflight::gpu
