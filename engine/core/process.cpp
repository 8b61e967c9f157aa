#include "engine/core/process.h"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <new>
#include <sstream>
#include <system_error>
#include <thread>
#include <utility>

#include "engine/core/cache_folder.h"
#include "engine/core/error.h"

namespace halflight {
namespace {

namespace fs = std::filesystem;

std::string reason(int error) {
    return std::generic_category().message(error);
}

/// Returns pointers to the strings and a null, as exec() takes them; the strings must outlive them.
std::vector<char*> pointers(const std::vector<std::string>& strings) {
    std::vector<char*> all;
    for (const std::string& s : strings) all.push_back(const_cast<char*>(s.c_str()));
    all.push_back(nullptr);
    return all;
}

std::vector<std::string> changed_environment(const std::vector<std::string>& changes) {
    const auto name = [](const std::string& variable) { return variable.substr(0, variable.find('=')); };
    std::vector<std::string> all;
    for (char** variable = environ; *variable; ++variable)
        if (std::ranges::find(changes, name(*variable), name) == changes.end()) all.emplace_back(*variable);
    for (const std::string& change : changes)
        if (change.find('=') != std::string::npos) all.push_back(change);
    return all;
}

/// Returns whether a folder of PATH has a file of that name.
bool is_in_path(const std::string& name) {
    const char* const path = std::getenv("PATH");
    std::istringstream folders(path ? path : "");
    std::error_code none;
    for (std::string folder; std::getline(folders, folder, ':');)
        if (fs::exists(fs::path(folder) / name, none)) return true;
    return false;
}

double seconds(const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
}

}  // namespace

void check_not_forked(pid_t owner, std::string_view subject) {
    if (owner != getpid())
        throw Error(subject,
                    "this process was forked from one that has used it; multiprocessing has the start method 'spawn'");
}

Process::Process(const std::vector<std::string>& arguments, const ProcessOptions& options)
    : name_(arguments.at(0)), own_group_(options.own_group) {
    posix_spawn_file_actions_t files;
    posix_spawn_file_actions_init(&files);
    const int streams[] = {options.input, options.output, options.errors};
    for (int stream = STDIN_FILENO; stream <= STDERR_FILENO; ++stream) {
        if (streams[stream] < 0)
            posix_spawn_file_actions_addopen(&files, stream, "/dev/null", stream == STDIN_FILENO ? O_RDONLY : O_WRONLY,
                                             0);
        else
            posix_spawn_file_actions_adddup2(&files, streams[stream], stream);
    }
    posix_spawnattr_t attributes;
    posix_spawnattr_init(&attributes);
    sigset_t usual;  // signals that are not ignored in the child, even if this process ignores them
    sigemptyset(&usual);
    for (const int signal : {SIGPIPE, SIGXFSZ}) sigaddset(&usual, signal);
    posix_spawnattr_setsigdefault(&attributes, &usual);
    posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGDEF | (own_group_ ? POSIX_SPAWN_SETPGROUP : 0));
    const std::vector<std::string> environment = changed_environment(options.environment);
    const int error = posix_spawnp(&id_, name_.c_str(), &files, &attributes, pointers(arguments).data(),
                                   pointers(environment).data());
    posix_spawnattr_destroy(&attributes);
    posix_spawn_file_actions_destroy(&files);
    // If a folder of PATH cannot be searched, the system gives that as the reason, although the program is missing.
    if (error != 0 && name_.find('/') == std::string::npos && !is_in_path(name_))
        throw Error(name_, "is no program in PATH");
    if (error != 0) throw Error(name_, "cannot be started: {}", reason(error));
}

Process::~Process() {
    if (id_ < 0) return;
    kill_all();
    while (waitpid(id_, nullptr, 0) < 0 && errno == EINTR) continue;
}

void Process::kill_all() const {
    kill(own_group_ ? -id_ : id_, SIGKILL);
}

ProcessEnd Process::wait(const std::function<void()>& pulse) {
    int status = 0;
    rusage used{};
    for (pid_t ended = 0; ended != id_;) {
        ended = wait4(id_, &status, pulse ? WNOHANG : 0, &used);
        if (ended < 0 && errno != EINTR) throw Error(name_, "cannot be waited for: {}", reason(errno));
        if (ended == id_ || !pulse) continue;
        pulse();
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    if (own_group_) kill_all();
    id_ = -1;
    ProcessEnd end;
    end.signal = WIFSIGNALED(status) ? WTERMSIG(status) : 0;
    end.status = end.signal ? 128 + end.signal : WEXITSTATUS(status);
    end.cpu_seconds = seconds(used.ru_utime) + seconds(used.ru_stime);
    end.peak_bytes = std::size_t{1024} * static_cast<std::size_t>(used.ru_maxrss);
    return end;
}

Spool::Spool() : file_(nullptr, &std::fclose) {
    const fs::path folder = scratch_folder();
    std::string name = folder / "halflight-XXXXXX";
    const int descriptor = mkostemp(name.data(), O_CLOEXEC);
    if (descriptor < 0) throw Error(folder.string(), "a temporary file cannot be made: {}", reason(errno));
    unlink(name.c_str());
    file_.reset(fdopen(descriptor, "w+"));
    if (file_) return;
    close(descriptor);
    throw std::bad_alloc();
}

std::string Spool::text(std::size_t limit) const {
    std::string all;
    char buffer[4096];
    // A child process shares the position in the file, which fread() would move.
    for (off_t at = 0;; at = static_cast<off_t>(all.size())) {
        const ssize_t count = pread(descriptor(), buffer, sizeof(buffer), at);
        if (count <= 0) return all;
        all.append(buffer, static_cast<std::size_t>(count));
        if (all.size() > limit) throw Error("output", "is longer than {} bytes", limit);
    }
}

std::vector<std::string> split_command(std::string_view line) {
    std::vector<std::string> arguments;
    char quote = 0;       // quotation mark that is open, or 0
    bool outside = true;  // the position is between two arguments
    for (std::size_t i = 0; i < line.size(); ++i) {
        const char c = line[i];
        if (quote != '\'' && line.substr(i, 2) == "\\\n") {  // joins the next line
            ++i;
            continue;
        }
        if (!quote && std::string_view(" \t\n").find(c) != std::string_view::npos) {
            outside = true;
            continue;
        }
        if (std::exchange(outside, false)) arguments.emplace_back();
        const bool escapes =
            !quote || (quote == '"' && i + 1 < line.size() && (line[i + 1] == '"' || line[i + 1] == '\\'));
        if (c == '\\' && escapes && i + 1 < line.size())
            arguments.back() += line[++i];
        else if (c == quote)
            quote = 0;
        else if (!quote && (c == '\'' || c == '"'))
            quote = c;
        else
            arguments.back() += c;
    }
    if (quote) throw Error(line, "has a {} that is not closed", quote);
    return arguments;
}

std::string last_line(std::string_view text) {
    const std::size_t end = text.find_last_not_of(" \r\n") + 1;
    text = text.substr(0, end);
    return std::string(text.substr(text.find_last_of('\n') + 1));
}

}  // namespace halflight
