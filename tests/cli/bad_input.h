// Runs each bad input in its own process with limits. The program must load it, or refuse it in one line.
#pragma once

#include <string>
#include <vector>

#include "tests/cli/command_test.h"

namespace halflight::test {

enum class Fate {
    loaded,   // exit status 0
    refused,  // exit status 1 or 2, one line on stderr
    untidy,   // refused, but with several lines or none
    crashed,
    hung,
    greedy,  // memory beyond 1 GiB
};

struct Verdict {
    Fate fate = Fate::loaded;
    std::string line;  // message on stderr
};

/// Runs the program under the limits. If the environment variable HALFLIGHT_BAD_INPUT_TABLE is set, a table with a row
/// per case is printed at the end.
Verdict judge(const std::string& name, const Strings& arguments);

/// Prints a fate in messages of gtest.
std::ostream& operator<<(std::ostream& out, Fate fate);

/// Returns the command line that renders 4 x 4 pixels with a scene, an environment or a colour config.
Strings with_scene(const std::string& scene);
Strings with_environment(const std::string& map);
Strings with_config(const std::string& config);

/// Returns the `info` command that reads what a `render` command reads, and takes less time since it needs no device.
/// Commands that read more, or have a budget of memory, stay as they are.
Strings reading(const Strings& arguments);

/// Returns lengths at which a file of `size` bytes is truncated. test_fuzz_regressions reads files of many more lengths
/// in its own process.
std::vector<std::size_t> prefix_lengths(std::size_t size);

/// Expects that reading() is refused with a message that contains all of `parts`: the file, the element, and the fault.
void expect_refused(const std::string& name, const Strings& arguments, const Strings& parts);
void expect_loaded(const std::string& name, const Strings& arguments);

}  // namespace halflight::test
