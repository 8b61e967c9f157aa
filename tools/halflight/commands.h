// The program's commands. Each returns when all requested work is done, and throws Error otherwise.
#pragma once

#include <functional>

#include "tools/halflight/arguments.h"

namespace halflight {

/// Error for a signal that asked to stop before the work was done; nothing was written.
class Interrupted : public Error {
  public:
    Interrupted(int by_signal, std::string_view subject, std::string_view what)
        : Error(subject, what), signal(by_signal) {}
    int signal;
};

/// Prints the versions of the program, the driver and the libraries.
void print_version();
void write_manual(const Manual& manual);
/// reread: parses the command line anew, with the settings file as it is now, for --watch.
void run_render(const RenderArguments& arguments, const std::function<RenderArguments()>& reread = {});
void run_denoise(const DenoiseArguments& arguments);
/// Renders under the limits of the arguments. Does not return if the time is up.
void run_thumbnail(const ThumbnailArguments& arguments);
/// Replaces the process by `halflight-view` with the same command line, so that this program needs no window system.
/// Throws Error if that program is not in the same folder.
[[noreturn]] void start_viewer(char** argv);
void run_converge(const ConvergeArguments& arguments);
void run_info(const InfoArguments& arguments);
void run_pack(const PackArguments& arguments);
void run_bench(const BenchArguments& arguments);

}  // namespace halflight
