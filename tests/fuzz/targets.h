// What is fuzzed, for libFuzzer (driver.cpp) and for the plain test that keeps its findings (test_regressions.cpp).
#pragma once

#include <stdexcept>
#include <string_view>

namespace halflight::fuzz {

/// A promise about bad input was broken.
struct Broken : std::logic_error {
    using std::logic_error::logic_error;
};

/// Each takes any bytes. What is wrong with them must come as Error, of one line that begins with the file's name;
/// what loads must be as its header promises. Throws Broken otherwise.
void gltf(std::string_view input);         ///< a .gltf or .glb; or JSON, a NUL and the binary chunk, made a .glb
void environment(std::string_view input);  ///< an OpenEXR or Radiance file
void color(std::string_view input);        ///< lines: display, view, look, colour space; the rest is a config
void arguments(std::string_view input);    ///< lines: a list of frames, then the words of a command line
void settings(std::string_view input);     ///< what a file of settings holds, without the file

}  // namespace halflight::fuzz
