// Runs programs as a user would, and provides small scenes for them.
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "tests/support/test_device.h"
#include "tools/common/temporary_folder.h"

namespace halflight::test {

struct Outcome {
    int status = -1;             // exit status, or 128 + signal
    std::string out;             // stdout
    std::string err;             // stderr; on a terminal stdout, too
    double cpu_seconds = 0;      // user and system time, seconds
    std::size_t peak_bytes = 0;  // greatest resident memory, bytes
};

struct RunOptions {
    std::vector<std::string> environment{};  // "NAME=value" sets a variable, "NAME" removes it; others are inherited
    std::vector<std::string> wrapper{};      // command that runs the program, given as its last arguments, e.g. prlimit
    std::string stdout_path{};               // file that becomes stdout; empty: Outcome::out
    std::string stderr_path{};               // file that becomes stderr; empty: Outcome::err
    bool terminal = false;                   // whether stdout and stderr are a terminal of 80 columns
    int most_seconds = 0;                    // wall time after which the program gets SIGALRM, seconds; 0: no limit
    std::function<void(pid_t, const std::string& err)> watch{};  // called whenever stderr has received something
};

/// Runs command[0] in the current folder until it ends; a name without slash is looked up in PATH. Throws Error if the
/// command cannot be started.
Outcome run(const std::vector<std::string>& command, const RunOptions& options = {});

/// Inserts `--device` and the device of the tests (test_device.h) after a command of halflight that renders. Arguments
/// that choose a device or ask for help stay unchanged.
std::vector<std::string> on_test_device(std::vector<std::string> arguments);

#ifdef HALFLIGHT_PROGRAM
/// Runs the program of this test (PROGRAM in CMakeLists.txt) on the device of the tests.
inline Outcome run_program(const std::vector<std::string>& arguments, const RunOptions& options = {}) {
    std::vector<std::string> command = on_test_device(arguments);
    command.insert(command.begin(), HALFLIGHT_PROGRAM);
    return run(command, options);
}
#endif

void write_text(const std::filesystem::path& path, const std::string& text);
std::string read_text(const std::filesystem::path& path);

/// Copies tests/cli/room into `folder`: a floor under a square lamp, cameras "front" (square) and "above" (2:1). The
/// lamp is dark unless `lit`. Returns the path of room.gltf.
std::filesystem::path copy_room(const std::filesystem::path& folder, bool lit = true);

}  // namespace halflight::test
