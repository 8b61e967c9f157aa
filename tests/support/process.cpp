#include "tests/support/process.h"

#include <fcntl.h>
#include <poll.h>
#include <pty.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <set>
#include <utility>

#include "engine/core/error.h"
#include "engine/core/process.h"
#include "engine/core/stopwatch.h"

namespace halflight::test {
namespace {

namespace fs = std::filesystem;

/// Owns a file descriptor.
class Descriptor {
  public:
    explicit Descriptor(int fd, const std::string& name) : fd_(fd) {
        if (fd < 0) throw Error(name, "cannot be opened");
    }
    Descriptor(Descriptor&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
    ~Descriptor() { shut(); }
    void shut() {
        if (fd_ >= 0) close(std::exchange(fd_, -1));
    }
    int get() const { return fd_; }

  private:
    int fd_;
};

struct Ends {
    Descriptor read;
    Descriptor write;
};

Ends make_pipe() {
    std::array<int, 2> ends{-1, -1};
    if (pipe2(ends.data(), O_CLOEXEC) != 0) throw Error("pipe", "cannot be made");
    return {Descriptor(ends[0], "pipe"), Descriptor(ends[1], "pipe")};
}

Ends make_terminal() {
    winsize size{};
    size.ws_row = 24, size.ws_col = 80;
    int master = -1, slave = -1;
    if (openpty(&master, &slave, nullptr, nullptr, &size) != 0) throw Error("terminal", "cannot be made");
    for (const int fd : {master, slave}) fcntl(fd, F_SETFD, FD_CLOEXEC);
    return {Descriptor(master, "terminal"), Descriptor(slave, "terminal")};
}

/// Appends available bytes; returns false at the end, which a terminal reports as EIO.
bool read_some(int fd, std::string& text) {
    std::array<char, 4096> buffer;
    const ssize_t count = read(fd, buffer.data(), buffer.size());
    if (count > 0) text.append(buffer.data(), static_cast<std::size_t>(count));
    return count > 0;
}

}  // namespace

Outcome run(const std::vector<std::string>& command, const RunOptions& options) {
    std::vector<std::string> arguments = options.wrapper;
    arguments.insert(arguments.end(), command.begin(), command.end());
    Ends out = make_pipe(), err = options.terminal ? make_terminal() : make_pipe();
    const auto target = [](const std::string& path, Ends& ends) {
        if (path.empty()) return std::move(ends.write);
        ends.write.shut();
        return Descriptor(open(path.c_str(), O_WRONLY | O_CLOEXEC), path);
    };
    Descriptor output = target(options.stdout_path, out), errors = target(options.stderr_path, err);
    std::vector<std::string> environment = options.environment;
    if (options.terminal) environment.emplace_back("TERM=xterm");
    Process process(arguments, {.environment = environment,
                                .output = options.terminal ? errors.get() : output.get(),
                                .errors = errors.get(),
                                .own_group = false});
    output.shut();
    errors.shut();

    const Stopwatch watch;
    bool warned = false;
    Outcome outcome;
    std::array<pollfd, 2> ends = {{{out.read.get(), POLLIN, 0}, {err.read.get(), POLLIN, 0}}};
    while (ends[0].fd >= 0 || ends[1].fd >= 0) {
        poll(ends.data(), ends.size(), options.most_seconds > 0 ? 100 : -1);
        if (ends[0].revents && !read_some(ends[0].fd, outcome.out)) ends[0].fd = -1;
        if (ends[1].revents && !read_some(ends[1].fd, outcome.err)) ends[1].fd = -1;
        if (ends[1].revents && options.watch) options.watch(process.id(), outcome.err);
        if (options.most_seconds > 0 && watch.seconds() > options.most_seconds && !std::exchange(warned, true))
            kill(process.id(), SIGALRM);
    }
    const ProcessEnd end = process.wait();
    outcome.status = end.status;
    outcome.cpu_seconds = end.cpu_seconds;
    outcome.peak_bytes = end.peak_bytes;
    return outcome;
}

std::vector<std::string> on_test_device(std::vector<std::string> arguments) {
    static const std::set<std::string> kRendering = {"render", "merge", "view", "converge", "bench"};
    const auto given = [&](const char* option) {
        return std::ranges::any_of(arguments, [&](const std::string& a) { return a.starts_with(option); });
    };
    if (!arguments.empty() && kRendering.contains(arguments[0]) && !given("--device") && !given("--help"))
        arguments.insert(arguments.begin() + 1, {"--device", test_device()});
    return arguments;
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
