// Bad input, each in a process of its own with limits: it loads, or is refused in one line; nothing else is right.
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/cli/process.h"

namespace halflight::test {

inline constexpr double kMaxCpuSeconds = 10;                    ///< more is a hang
inline constexpr std::size_t kMaxBytes = std::size_t{1} << 30;  ///< resident; more is a failure

enum class Fate {
    loaded,   // exit status 0
    refused,  // exit status 1 or 2, one line on stderr
    untidy,   // refused otherwise: several lines, or none
    crashed,
    hung,
    greedy,  // more memory than kMaxBytes
};

struct Verdict {
    Fate fate = Fate::loaded;
    std::string line;  // what stderr said
};

/// Runs the program under the limits. Each case becomes a row of the table that is printed at the end where the
/// environment variable HALFLIGHT_BAD_INPUT_TABLE is set.
Verdict judge(const std::string& name, const std::vector<std::string>& arguments);

/// For messages of gtest.
std::ostream& operator<<(std::ostream& out, Fate fate);

/// The command lines that take a scene, an environment or a colour config into a picture of 4 x 4 pixels.
std::vector<std::string> with_scene(const std::string& scene);
std::vector<std::string> with_environment(const std::string& map);
std::vector<std::string> with_config(const std::string& config);

/// Lengths to cut a file of `size` bytes to: within magic numbers and first fields, spread over the rest, one short.
std::vector<std::size_t> prefix_lengths(std::size_t size);

/// Expectations; `words` must all be in the line: the file, the element, what is wrong.
void expect_refused(const std::string& name, const std::vector<std::string>& arguments,
                    const std::vector<std::string>& words);
void expect_loaded(const std::string& name, const std::vector<std::string>& arguments);

}  // namespace halflight::test
