// Signals that ask the program to stop: SIGINT, SIGTERM, SIGHUP.
#pragma once

namespace halflight {

/// From now on the first such signal is remembered, and the second ends the program at once.
void catch_stop_signals();

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
