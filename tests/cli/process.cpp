#include "tests/cli/process.h"

#include <fcntl.h>
#include <poll.h>
#include <pty.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <fstream>
#include <stdexcept>

namespace halflight::test {
namespace {

namespace fs = std::filesystem;

/// Replaces the child by the program.
[[noreturn]] void start(const std::vector<std::string>& arguments, const RunOptions& options) {
    for (const std::string& variable : options.environment) {
        const auto equals = variable.find('=');
        setenv(variable.substr(0, equals).c_str(), variable.substr(equals + 1).c_str(), 1);
    }
    if (options.in_child) options.in_child();
    std::vector<char*> argv = {const_cast<char*>("halflight")};
    for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
    argv.push_back(nullptr);
    execv(HALFLIGHT_PROGRAM, argv.data());
    _exit(127);
}

/// Appends what can be read; false at the end. (A terminal whose other side has gone says EIO.)
bool read_some(int fd, std::string& text) {
    std::array<char, 4096> buffer;
    const ssize_t count = read(fd, buffer.data(), buffer.size());
    if (count > 0) text.append(buffer.data(), static_cast<std::size_t>(count));
    return count > 0;
}

void wait_for(pid_t child, Outcome& outcome) {
    int status = 0;
    rusage used{};
    wait4(child, &status, 0, &used);
    outcome.status = WIFSIGNALED(status) ? 128 + WTERMSIG(status) : WEXITSTATUS(status);
    const auto seconds = [](const timeval& t) { return double(t.tv_sec) + 1e-6 * double(t.tv_usec); };
    outcome.cpu_seconds = seconds(used.ru_utime) + seconds(used.ru_stime);
    outcome.peak_bytes = std::size_t{1024} * static_cast<std::size_t>(used.ru_maxrss);
}

Outcome run_on_terminal(const std::vector<std::string>& arguments, const RunOptions& options) {
    winsize size{};
    size.ws_row = 24, size.ws_col = 80;
    int master = -1;
    const pid_t child = forkpty(&master, nullptr, nullptr, &size);
    if (child < 0) throw std::runtime_error("forkpty failed");
    if (child == 0) start(arguments, options);
    Outcome outcome;
    while (read_some(master, outcome.err)) {
    }
    close(master);
    wait_for(child, outcome);
    return outcome;
}

}  // namespace

Outcome run_program(const std::vector<std::string>& arguments, const RunOptions& options) {
    if (options.terminal) return run_on_terminal(arguments, options);
    std::array<int, 2> out, err;
    if (pipe2(out.data(), O_CLOEXEC) != 0 || pipe2(err.data(), O_CLOEXEC) != 0) throw std::runtime_error("no pipe");
    const pid_t child = fork();
    if (child < 0) throw std::runtime_error("fork failed");
    if (child == 0) {
        const int to = options.stdout_path.empty() ? out[1] : open(options.stdout_path.c_str(), O_WRONLY);
        dup2(to, STDOUT_FILENO);
        dup2(err[1], STDERR_FILENO);
        start(arguments, options);
    }
    close(out[1]);
    close(err[1]);
    Outcome outcome;
    std::array<pollfd, 2> open_ends = {{{out[0], POLLIN, 0}, {err[0], POLLIN, 0}}};
    while (open_ends[0].fd >= 0 || open_ends[1].fd >= 0) {
        poll(open_ends.data(), open_ends.size(), -1);
        if (open_ends[0].revents && !read_some(out[0], outcome.out)) open_ends[0].fd = -1;
        if (open_ends[1].revents && !read_some(err[0], outcome.err)) open_ends[1].fd = -1;
        if (open_ends[1].revents && options.watch) options.watch(child, outcome.err);
    }
    close(out[0]);
    close(err[0]);
    wait_for(child, outcome);
    return outcome;
}

TemporaryFolder::TemporaryFolder() {
    std::string name = (fs::temp_directory_path() / "halflight-test-XXXXXX").string();
    if (!mkdtemp(name.data())) throw std::runtime_error("no temporary folder");
    path = name;
}

TemporaryFolder::~TemporaryFolder() {
    std::error_code ignored;
    fs::remove_all(path, ignored);
}

std::vector<std::string> TemporaryFolder::entries() const {
    std::vector<std::string> names;
    for (const auto& entry : fs::directory_iterator(path)) names.push_back(entry.path().filename());
    std::ranges::sort(names);
    return names;
}

void write_text(const fs::path& path, const std::string& text) {
    std::ofstream(path, std::ios::binary) << text;
}

std::string read_text(const fs::path& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}

fs::path copy_room(const fs::path& folder, bool lit) {
    for (const char* name : {"room.gltf", "room.bin"})
        fs::copy_file(fs::path(HALFLIGHT_SOURCE_DIR) / "tests/cli/room" / name, folder / name,
                      fs::copy_options::overwrite_existing);
    const fs::path scene = folder / "room.gltf";
    if (!lit) {
        const std::string emission = R"("emissiveFactor": [1, 1, 1],)";
        std::string text = read_text(scene);
        write_text(scene, text.erase(text.find(emission), emission.size()));
    }
    return scene;
}

}  // namespace halflight::test
