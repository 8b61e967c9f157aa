// The program's commands. Each returns when all that was asked for is done, and throws Error otherwise.
#pragma once

#include "tools/halflight/arguments.h"

namespace halflight {

/// Asked to stop by a signal before the work was done; nothing was written.
class Interrupted : public Error {
  public:
    Interrupted(int by_signal, std::string_view subject, std::string_view what)
        : Error(subject, what), signal(by_signal) {}
    int signal;
};

void run_render(const RenderArguments& arguments);
/// Becomes `halflight-view` with the same command line, a program of its own so that this one needs no window system.
/// Throws Error where it is not beside this one.
[[noreturn]] void start_viewer(char** argv);
void run_converge(const ConvergeArguments& arguments);
void run_info(const InfoArguments& arguments);
void run_bench(const BenchArguments& arguments);

}  // namespace halflight
