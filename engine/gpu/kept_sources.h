// Copies of final shader sources, which tests give to compilers of other vendors.
#pragma once

#include <initializer_list>
#include <string_view>
#include <utility>

namespace halflight::gpu {

/// Writes the sources of a linked program into the folder that the environment variable HALFLIGHT_SHADER_SOURCES names;
/// does nothing if it is not set. A stage is its extension (comp, vert, frag) and its text. The stages of a program
/// become files NAME-HASH.EXTENSION that differ in their extension alone. The hash tells variants apart. Throws Error
/// naming the folder if a file cannot be written.
void keep_sources(std::string_view program,
                  std::initializer_list<std::pair<std::string_view, std::string_view>> stages);

}  // namespace halflight::gpu
