// Child processes: another program with its arguments, never a shell's command line.
#pragma once

#include <sys/types.h>

#include <cstddef>
#include <cstdio>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace halflight {

struct ProcessOptions {
    std::vector<std::string> environment{};  // "NAME=value" sets a variable, "NAME" removes it; others are inherited
    int input = -1;                          // descriptor that becomes stdin; -1: /dev/null
    int output = -1;                         // descriptor that becomes stdout; -1: /dev/null
    int errors = -1;                         // descriptor that becomes stderr; -1: /dev/null
    bool own_group = true;  // true: the program has its own process group, which a terminal's Ctrl-C does not reach
};

/// Result of a process that has ended.
struct ProcessEnd {
    int status = 0;              // exit status, or 128 + signal
    int signal = 0;              // signal that ended the process, or 0
    double cpu_seconds = 0;      // seconds, user and system, of the process and the children that it has waited for
    std::size_t peak_bytes = 0;  // greatest resident memory, bytes
};

/// Throws Error about `subject` unless this is the process `owner`. A process that was forked lacks the threads of the
/// process before, which libraries would wait for without end.
void check_not_forked(pid_t owner, std::string_view subject);

/// A running program. Neither the program nor its own process group, if it has one, outlives the object.
class Process {
  public:
    /// Starts arguments[0], looked up in PATH if it has no slash. Throws Error naming it if it cannot start.
    explicit Process(const std::vector<std::string>& arguments, const ProcessOptions& options = {});
    Process(const Process&) = delete;
    Process& operator=(const Process&) = delete;
    ~Process();

    pid_t id() const { return id_; }
    /// Waits until the program ends, and then kills the rest of its own group. Calls pulse(), if any, every
    /// millisecond; an exception from it leaves the program running. Throws Error if SIGCHLD is ignored.
    ProcessEnd wait(const std::function<void()>& pulse = {});

  private:
    void kill_all() const;

    std::string name_;
    pid_t id_ = -1;
    bool own_group_;
};

/// An unnamed temporary file that receives the output of a process.
class Spool {
  public:
    Spool();  ///< Throws Error if no file can be made.
    int descriptor() const { return fileno(file_.get()); }
    /// Returns the content. Throws Error if it is longer than `limit` bytes.
    std::string text(std::size_t limit = 64 << 20) const;

  private:
    std::unique_ptr<std::FILE, int (*)(std::FILE*)> file_;
};

/// Splits a command line into arguments at its blanks, with the quotes of a POSIX shell: 'as it stands', "with \" and
/// \\", \ before any other character. A \ at the end of a line continues it. Nothing is expanded. Throws Error if a
/// quote is not closed.
std::vector<std::string> split_command(std::string_view line);

/// Returns the last line of `text` that is not blank, without trailing blanks; empty if there is none.
std::string last_line(std::string_view text);

}  // namespace halflight
