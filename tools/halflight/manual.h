// Man pages, and completions of command lines by shells, from the options that CLI11 knows.
#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace halflight {

/// An option or a positional argument.
struct ManualOption {
    std::vector<std::string> names;   // "--samples", "-s"; one for a positional
    std::string metavar;              // placeholder of the value; empty: a flag
    std::string description;          // its text in the help
    std::string group;                // heading in help texts
    std::vector<std::string> values;  // values that shells offer
    bool list = false;                // values may be joined by commas
    bool repeated = false;            // may be given several times
    bool required = false;
    bool takes_file() const { return metavar.find("FILE") != std::string::npos; }
    bool takes_folder() const { return metavar == "DIR"; }
};

struct ManualCommand {
    std::string name;         // "render"
    std::string description;  // one sentence without its full stop
    std::string footer;       // paragraph below the options; may be empty
    std::vector<ManualOption> positionals;
    std::vector<ManualOption> options;
};

/// Returns the commands of the program. The first one has no name: it holds the options before a command.
std::vector<ManualCommand> manual_commands(const CLI::App& app);

/// Returns the man page of a command; the first of `commands` has that of the program.
std::string man_page(const ManualCommand& command, const std::vector<ManualCommand>& commands);
std::string bash_completion(const std::vector<ManualCommand>& commands);
std::string zsh_completion(const std::vector<ManualCommand>& commands);
std::string fish_completion(const std::vector<ManualCommand>& commands);

/// Returns all these files, by their path below a folder such as /usr/share.
std::map<std::filesystem::path, std::string> manual_files(const CLI::App& app);

}  // namespace halflight
