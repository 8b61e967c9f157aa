// Completions of command lines, for bash, zsh and fish.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "tools/halflight/manual.h"

namespace halflight {
namespace {

/// An option whose values are names in the scene.
struct SceneNames {
    const char* option;
    const char* lines;  // option whose lines of `halflight info SCENE --names` have the names
    const char* words;  // other values
};
constexpr SceneNames kSceneNames[] = {
    {"--camera", "--camera", "inside outside"},
    {"--hide", "--hide", ""},
    {"--light", "--light", ""},
    {"--material", "--material", ""},
    {"--node", "--node", ""},
    {"--shadow-catcher", "--hide", ""},
    {"--variant", "--variant", ""},
};

/// Filters lines of `halflight info SCENE --names` by option $1: without quotes, up to the first "=".
constexpr const char* kNameFilter = R"(sed -n "s/^$1 //; T; s/^\x27//; s/\x27\$//; s/=.*/=/; p" | sort -u)";

const SceneNames* names_option(const ManualOption& o) {
    const auto found =
        std::ranges::find(kSceneNames, o.names[0], [](const auto& row) { return std::string(row.option); });
    return found == std::end(kSceneNames) ? nullptr : found;
}

std::string joined(const std::vector<std::string>& words, const char* separator = " ") {
    return fmt::format("{}", fmt::join(words, separator));
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
    for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size())
        text.replace(at, from.size(), to);
    return text;
}

/// Returns a description that fits beside an option: up to its first list, condition or default.
std::string brief(const std::string& description) {
    constexpr std::size_t kMost = 76;  // characters
    std::size_t end = description.size();
    for (const char* mark : {": ", "; ", ". ", " (default"}) end = std::min(end, description.find(mark));
    if (end > kMost) end = description.rfind(' ', kMost);
    std::string text = replaced(description.substr(0, end), "`", "");
    while (text.ends_with(',') || text.ends_with('.')) text.pop_back();
    return text;
}

std::vector<std::string> names_of(const ManualCommand& command) {
    std::vector<std::string> names;
    for (const ManualOption& o : command.options) names.insert(names.end(), o.names.begin(), o.names.end());
    return names;
}

std::vector<std::string> command_names(const std::vector<ManualCommand>& commands) {
    std::vector<std::string> names;
    for (const ManualCommand& c : commands)
        if (!c.name.empty()) names.push_back(c.name);
    return names;
}

/// Returns the statement that completes the value of an option in bash.
std::string bash_action(const ManualOption& o) {
    std::string action;
    if (const SceneNames* of = names_option(o))
        action = fmt::format("_halflight_names {} {}", of->lines, of->words);
    else if (o.list && !o.values.empty())
        action = "_halflight_list " + joined(o.values);
    else if (!o.values.empty())
        action = fmt::format("COMPREPLY=($(compgen -W \"{}\" -- \"$cur\"))", joined(o.values));
    if (o.takes_file() || o.takes_folder())
        action += std::string(action.empty() ? "" : "; ") + (o.takes_file() ? "_filedir" : "_filedir -d");
    return action.empty() ? ":" : action;
}

std::string zsh_quoted(const std::string& text) {
    return "'" + replaced(text, "'", "'\\''") + "'";
}

std::string zsh_action(const ManualOption& o) {
    // After a blank, zsh calls the action without arguments of its own.
    if (const SceneNames* of = names_option(o)) return fmt::format(" _halflight_names {} {}", of->lines, of->words);
    const std::string values =
        o.list ? fmt::format("_values -s , value {}", joined(o.values)) : fmt::format("compadd {}", joined(o.values));
    if (o.takes_file()) return o.values.empty() ? "_files" : fmt::format("{{{}; _files}}", values);
    if (o.takes_folder()) return "_files -/";
    if (o.values.empty()) return " ";
    return o.list ? "{" + values + "}" : fmt::format("({})", joined(o.values));
}

std::string zsh_option(const ManualOption& o) {
    const std::string escaped = replaced(replaced(brief(o.description), "[", "\\["), "]", "\\]");
    std::string rest = "[" + escaped + "]";
    if (!o.metavar.empty())
        rest += fmt::format(":{}:{}", replaced(o.metavar, ":", "\\:"), replaced(zsh_action(o), "'", "\""));
    std::string text;
    for (const std::string& name : o.names) {
        const std::string form = o.metavar.empty() ? name : name + (name.starts_with("--") ? "=" : "+");
        const std::string others = o.repeated ? "*" : fmt::format("({})", joined(o.names));
        text += fmt::format(" \\\n            {}", zsh_quoted(others + form + rest));
    }
    return text;
}

std::string fish_quoted(const std::string& text) {
    return "'" + replaced(replaced(text, "\\", "\\\\"), "'", "\\'") + "'";
}

std::string fish_option(const ManualCommand& command, const ManualOption& o) {
    std::string line = "complete -c halflight";
    line += command.name.empty() ? " -n __fish_use_subcommand" : fmt::format(" -n '__halflight_is {}'", command.name);
    for (const std::string& name : o.names)
        line += name.starts_with("--") ? " -l " + name.substr(2) : " -s " + name.substr(1);
    line += " -d " + fish_quoted(brief(o.description));
    if (o.metavar.empty()) return line + " -f\n";
    line += o.takes_file() ? " -r -F" : " -x";
    const std::string values = joined(o.values);
    if (const SceneNames* of = names_option(o))
        line += fmt::format(" -a '{} (__halflight_names {})'", of->words, of->lines);
    else if (o.takes_folder())
        line += " -a '(__fish_complete_directories)'";
    else if (o.list && !values.empty())
        line += fmt::format(" -a '(__fish_append , {})'", values);
    else if (!values.empty())
        line += " -a " + fish_quoted(values);
    return line + "\n";
}

constexpr const char* kBashStart =
    R"bash(# Completion of halflight for bash; `halflight info --write-manual DIR` writes it.

# _halflight_names OPTION WORD...: offers the words, and the names in the scene of the command line. A scene may come from
# anywhere, so its names are never expanded by the shell.
_halflight_names() {
    local scene name typed=${cur//[\\\"\']/}
    for scene in "${words[@]:2}"; do
        [[ $scene != *.@(glb|gltf) ]] || break
    done
    while IFS= read -r name; do
        [[ $name != "$typed"* ]] || COMPREPLY+=("$name")
    done < <(
        [ $# = 1 ] || printf '%s\n' "${@:2}"
        scene=${scene//[\\\"\']/}
        timeout 2 halflight info "${scene/#\~\//$HOME/}" --names 2>/dev/null </dev/null | NAMES
    )
    compopt -o filenames # quotes blanks
    [[ ${COMPREPLY[0]-} != *= ]] || compopt -o nospace
    __ltrim_colon_completions "$cur"
}

# _halflight_list WORD...: offers the words as the next one of a list with commas.
_halflight_list() {
    local before=
    [[ $cur != *,* ]] || before=${cur%,*},
    COMPREPLY=($(compgen -P "$before" -W "$*" -- "${cur##*,}"))
    compopt -o nospace
}

_halflight() {
    local cur prev words cword split
    _init_completion -s -n : || return
)bash";

constexpr const char* kZshStart = R"zsh(#compdef halflight
# Completion of halflight for zsh; `halflight info --write-manual DIR` writes it.

# _halflight_names OPTION WORD...: offers the words, and the names in the scene of the command line.
_halflight_names() {
    local -a scenes=(${(M)words:#*.(glb|gltf)})
    local -a names=(${(f)"$(timeout 2 halflight info ${${(Q)scenes[1]}/#\~\//$HOME/} --names 2>/dev/null </dev/null | NAMES)"})
    compadd -- ${@:2} ${names:#*=}
    compadd -S '' -- ${(M)names:#*=}
}

_halflight() {
    local curcontext=$curcontext state line
    typeset -A opt_args
)zsh";

constexpr const char* kFishStart =
    R"fish(# Completion of halflight for fish; `halflight info --write-manual DIR` writes it.

function __halflight_is
    set -l words (commandline -opc)
    test (count $words) -gt 1; and test $words[2] = $argv[1]
end

# __halflight_names OPTION: prints the names in the scene of the command line.
function __halflight_names
    for word in (commandline -opc)
        if string match -qr '\.(glb|gltf)$' -- $word
            sh -c 'timeout 2 halflight info "$2" --names 2>/dev/null </dev/null | NAMES' sh $argv[1] (string replace -r '^~/' $HOME/ -- $word)
            return
        end
    end
end

)fish";

}  // namespace

std::string bash_completion(const std::vector<ManualCommand>& commands) {
    // Options that are completed alike are one case.
    std::vector<std::pair<std::string, std::vector<std::string>>> cases;
    for (const ManualCommand& c : commands) {
        for (const ManualOption& o : c.options) {
            if (c.name.empty() || o.metavar.empty()) continue;
            const std::string action = bash_action(o);
            auto found = std::ranges::find(cases, action, &decltype(cases)::value_type::first);
            if (found == cases.end()) found = cases.insert(cases.end(), {action, {}});
            for (const std::string& name : o.names) found->second.push_back(fmt::format("'{} {}'", c.name, name));
        }
    }
    std::string text = replaced(kBashStart, "NAMES", kNameFilter);
    text += fmt::format(
        "    if ((cword == 1)); then\n        COMPREPLY=($(compgen -W \"{} {}\" -- \"$cur\"))\n"
        "        return\n    fi\n    case \"${{words[1]}} $prev\" in\n",
        joined(command_names(commands)), joined(names_of(commands[0])));
    for (const auto& [action, patterns] : cases)
        text += fmt::format("    {})\n        {}\n        return\n        ;;\n", joined(patterns, " | "), action);
    text +=
        "    esac\n    if [[ $cur != -* ]]; then\n        _filedir\n        return\n    fi\n    local options=\n"
        "    case ${words[1]} in\n";
    for (const ManualCommand& c : commands)
        if (!c.name.empty()) text += fmt::format("    {}) options=\"{}\" ;;\n", c.name, joined(names_of(c)));
    return text +
           "    esac\n    COMPREPLY=($(compgen -W \"$options\" -- \"$cur\"))\n}\n\ncomplete -F _halflight halflight\n";
}

std::string zsh_completion(const std::vector<ManualCommand>& commands) {
    std::string text = replaced(kZshStart, "NAMES", kNameFilter);
    text += "    if ((CURRENT == 2)); then\n        local -a commands=(";
    for (const ManualCommand& c : commands)
        if (!c.name.empty()) text += fmt::format("\n            {}", zsh_quoted(c.name + ":" + brief(c.description)));
    text += "\n        )\n        [[ $PREFIX == -* ]] || _describe command commands\n        _arguments";
    for (const ManualOption& o : commands[0].options) text += zsh_option(o);
    text +=
        "\n        return\n    fi\n    local command=$words[2]\n    shift words\n    ((CURRENT--))\n    case $command "
        "in\n";
    for (const ManualCommand& c : commands) {
        if (c.name.empty()) continue;
        text += fmt::format("    {})\n        _arguments", c.name);
        for (const ManualOption& o : c.options) text += zsh_option(o);
        text += " \\\n            '*:file:_files'\n        ;;\n";
    }
    return text + "    esac\n}\n\n_halflight \"$@\"\n";
}

std::string fish_completion(const std::vector<ManualCommand>& commands) {
    std::string text = replaced(kFishStart, "NAMES", kNameFilter);
    for (const ManualCommand& c : commands)
        if (!c.name.empty())
            text += fmt::format("complete -c halflight -n __fish_use_subcommand -f -a {} -d {}\n", c.name,
                                fish_quoted(brief(c.description)));
    for (const ManualCommand& c : commands)
        for (const ManualOption& o : c.options) text += fish_option(c, o);
    return text;
}

}  // namespace halflight
