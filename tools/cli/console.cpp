#include "tools/cli/console.h"

#include <fcntl.h>
#include <fmt/chrono.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <memory>
#include <mutex>
#include <system_error>

#include "engine/core/error.h"
#include "engine/io/file_kind.h"
#include "engine/io/files.h"

namespace halflight {
namespace {

constexpr std::array<std::string_view, 4> kLevels = {"error", "warning", "note", "detail"};

struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
};
std::mutex log_mutex;
std::unique_ptr<std::FILE, Close> log_file;
std::string log_name;
int log_error = 0;  // errno of the first message that was not written

/// Appends a message to the log file, if there is one.
void write_log(LogLevel level, std::string_view line) {
    const std::lock_guard lock(log_mutex);
    if (!log_file) return;
    const auto now = std::chrono::floor<std::chrono::seconds>(std::chrono::system_clock::now());
    const std::string text = fmt::format("{:%Y-%m-%dT%H:%M:%SZ} {}: {}\n", fmt::gmtime(now),
                                         kLevels[static_cast<std::size_t>(level)], one_line(line));
    const bool whole = std::fwrite(text.data(), 1, text.size(), log_file.get()) == text.size();
    if ((!whole || std::fflush(log_file.get()) != 0) && log_error == 0) log_error = errno;
}

LogLevel level_of(Log::Kind kind) {
    switch (kind) {
        case Log::Kind::detail:
            return LogLevel::detail;
        case Log::Kind::note:
            return LogLevel::note;
        case Log::Kind::warning:
            break;
    }
    return LogLevel::warning;
}

}  // namespace

std::optional<LogLevel> log_level_named(std::string_view name) {
    for (std::size_t i = 0; i < kLevels.size(); ++i)
        if (name == kLevels[i]) return static_cast<LogLevel>(i);
    return std::nullopt;
}

void put(std::FILE* stream, std::string_view text) {
    std::fwrite(text.data(), 1, text.size(), stream);
}

int fail(int status, std::string_view what) {
    put(stderr, fmt::format("halflight: {}\n", one_line(what)));
    write_log(LogLevel::error, what);
    return status;
}

int fail(int status, const std::system_error& error) {
    const bool threads = error.code() == std::errc::resource_unavailable_try_again;
    return fail(status, threads ? "no further thread can be started (ulimit -u, ulimit -v, pids.max of the cgroup)"
                                : std::string_view(error.what()));
}

void open_log(const std::filesystem::path& file) {
    make_folder_of(file);
    check_takes_text(file);
    // Without O_NONBLOCK, the call would wait for a reader of a named pipe.
    const int descriptor = open(file.c_str(), O_WRONLY | O_APPEND | O_CREAT | O_NONBLOCK | O_CLOEXEC, 0666);
    if (descriptor >= 0) fcntl(descriptor, F_SETFL, O_APPEND);  // a slow reader is waited for
    std::unique_ptr<std::FILE, Close> opened(descriptor >= 0 ? fdopen(descriptor, "a") : nullptr);
    if (const int why = errno; !opened) {
        if (descriptor >= 0) close(descriptor);
        throw Error(file.string(), "cannot write: {}", std::generic_category().message(why));
    }
    const std::lock_guard lock(log_mutex);
    log_file = std::move(opened), log_name = file.string();
}

void check_log() {
    const std::lock_guard lock(log_mutex);
    if (log_error != 0) throw Error(log_name, "cannot write: {}", std::generic_category().message(log_error));
}

void hold_standard_streams() {
    for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})  // open() returns the lowest free number
        if (fcntl(stream, F_GETFD) == -1) open("/dev/null", O_RDONLY);
}

Console::Console(LogLevel level)
    : Log([level](Kind kind, std::string_view line) {
          const LogLevel own = level_of(kind);
          write_log(own, line);
          if (own > level) return;
          put(stderr, fmt::format("halflight: {}{}\n", kind == Kind::warning ? "warning: " : "", one_line(line)));
      }) {}

}  // namespace halflight
