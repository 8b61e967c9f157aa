// The main() of the small programs.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>

namespace halflight {

/// Parses the command line, then calls `run`, which returns the exit status. Returns 2 for an unusable command line and
/// 1 if `run` throws, both after one line "PROGRAM: error" on stderr.
template <class Run>
int tool_main(CLI::App& app, int argc, char** argv, Run run) {
    const auto fail = [&](int status, const std::exception& error) {
        std::fprintf(stderr, "%s: %s\n", app.get_name().c_str(), error.what());
        return status;
    };
    try {
        app.parse(argc, argv);
        return run();
    } catch (const CLI::ParseError& error) {
        return error.get_exit_code() == 0 ? app.exit(error) : fail(2, error);  // 0: --help
    } catch (const std::exception& error) {
        return fail(1, error);
    }
}

}  // namespace halflight
