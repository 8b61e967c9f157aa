// Signal handling; SIGINT, SIGTERM and SIGHUP ask the program to stop.
#pragma once

namespace halflight {

/// Installs the handlers: the first SIGINT, SIGTERM or SIGHUP is remembered, and a second one ends the program at once.
/// A write beyond the limit of file sizes, or to a pipe without a reader, becomes an error instead of a signal.
void handle_signals();

/// Returns the signal that asks to stop; 0: none.
int stop_signal();

/// Guards the writing of files: during its lifetime no signal ends the program.
class WritingFiles {
  public:
    WritingFiles();
    WritingFiles(const WritingFiles&) = delete;
    WritingFiles& operator=(const WritingFiles&) = delete;
    ~WritingFiles();
};

}  // namespace halflight
