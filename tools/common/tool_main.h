// What the main() of the small programs has in common.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>

namespace halflight {

/// Parses, then calls `run`, which returns the exit status. 2 for a command line that makes no sense, 1 where `run`
/// throws, both with one line "PROGRAM: what" on stderr.
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
