// Signal handling; SIGINT, SIGTERM, SIGHUP and SIGXCPU (the limit of CPU seconds) ask the program to stop.
#pragma once

namespace halflight {

/// Installs the handlers: the first of these signals is remembered. Another one ends the program at once unless it
/// comes within half a second or is SIGXCPU, which comes in every second of the CPU. A write beyond the limit of file
/// sizes, or to a pipe without a reader, becomes an error instead of a signal.
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
