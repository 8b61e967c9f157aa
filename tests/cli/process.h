// Runs the program as a user would, and makes small scenes for it.
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace halflight::test {

struct Outcome {
    int status = -1;  // exit status, or 128 + signal
    std::string out;  // stdout
    std::string err;  // stderr; of a terminal: both
    double cpu_seconds = 0;
    std::size_t peak_bytes = 0;  // resident
};

struct RunOptions {
    std::vector<std::string> environment{};                      // "NAME=value" on top of the test's own
    std::string stdout_path{};                                   // instead of a pipe
    bool terminal = false;                                       // stdout and stderr are a terminal of 80 columns
    std::function<void()> in_child{};                            // before the program starts
    std::function<void(pid_t, const std::string& err)> watch{};  // called whenever stderr has said something
};

/// Runs build/halflight with these arguments, in the folder that is current, until it ends.
Outcome run_program(const std::vector<std::string>& arguments, const RunOptions& options = {});

/// A folder that is new, and gone with the object.
class TemporaryFolder {
  public:
    TemporaryFolder();
    TemporaryFolder(const TemporaryFolder&) = delete;
    TemporaryFolder& operator=(const TemporaryFolder&) = delete;
    ~TemporaryFolder();

    std::filesystem::path path;
    std::filesystem::path operator/(const std::string& name) const { return path / name; }
    std::vector<std::string> entries() const;  ///< names, sorted
};

void write_text(const std::filesystem::path& path, const std::string& text);
std::string read_text(const std::filesystem::path& path);

/// A copy of tests/cli/room in `folder`: a floor under a square lamp, cameras "front" (square) and "above" (2:1). The
/// lamp is dark unless `lit`. Returns the path of room.gltf.
std::filesystem::path copy_room(const std::filesystem::path& folder, bool lit = true);

}  // namespace halflight::test
