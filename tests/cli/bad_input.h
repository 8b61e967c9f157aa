// Runs each bad input in its own process with limits. The program must load it, or refuse it in one line.
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/support/process.h"

namespace halflight::test {

/// Limit of CPU time, seconds. With sanitizers it is four times as long, as those of whole tests are
/// (tests/CMakeLists.txt).
#ifdef HALFLIGHT_SANITIZED
inline constexpr double kMaxCpuSeconds = 40;
#else
inline constexpr double kMaxCpuSeconds = 10;
#endif
inline constexpr std::size_t kMaxBytes = std::size_t{1} << 30;  ///< limit of resident memory, bytes

enum class Fate {
    loaded,   // exit status 0
    refused,  // exit status 1 or 2, one line on stderr
    untidy,   // refused, but with several lines or none
    crashed,
    hung,
    greedy,  // memory beyond kMaxBytes
};

struct Verdict {
    Fate fate = Fate::loaded;
    std::string line;  // message on stderr
};

/// Runs the program under the limits. If the environment variable HALFLIGHT_BAD_INPUT_TABLE is set, a table with a row
/// per case is printed at the end.
Verdict judge(const std::string& name, const std::vector<std::string>& arguments);

/// Prints a fate in messages of gtest.
std::ostream& operator<<(std::ostream& out, Fate fate);

/// Returns the command line that renders 4 x 4 pixels with a scene, an environment or a colour config.
std::vector<std::string> with_scene(const std::string& scene);
std::vector<std::string> with_environment(const std::string& map);
std::vector<std::string> with_config(const std::string& config);

/// Returns lengths at which a file of `size` bytes is truncated. The first fields, the middle and the last byte are
/// cut. test_fuzz_regressions reads files of many more lengths in its own process.
std::vector<std::size_t> prefix_lengths(std::size_t size);

/// Expects a refusal whose message contains all of `words`: the file, the element, and the fault.
void expect_refused(const std::string& name, const std::vector<std::string>& arguments,
                    const std::vector<std::string>& words);
void expect_loaded(const std::string& name, const std::vector<std::string>& arguments);

}  // namespace halflight::test
