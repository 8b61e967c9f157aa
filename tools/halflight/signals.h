// Signals; those that ask the program to stop are SIGINT, SIGTERM, SIGHUP.
#pragma once

namespace halflight {

/// From now on the first such signal is remembered, and the second ends the program at once. A file that would grow
/// beyond the limit of its size is an error of writing, not a death by SIGXFSZ.
void handle_signals();

/// The signal that asks to stop; 0: none.
int stop_signal();

/// While one lives, files are being written: no signal ends the program.
class WritingFiles {
  public:
    WritingFiles();
    WritingFiles(const WritingFiles&) = delete;
    WritingFiles& operator=(const WritingFiles&) = delete;
    ~WritingFiles();
};

}  // namespace halflight
