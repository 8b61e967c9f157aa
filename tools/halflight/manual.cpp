#include "tools/halflight/manual.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <regex>
#include <vector>

#include "engine/core/error.h"
#include "engine/core/names.h"
#include "engine/io/files.h"
#include "tools/halflight/commands.h"

namespace halflight {
namespace {

/// Returns the values that a help text lists at its end, ": box, blackman-harris (default box)", or that a placeholder
/// lists, "text|json".
std::vector<std::string> values_of(const std::string& metavar, const std::string& description) {
    static const std::regex kWord("[a-z0-9][a-z0-9_-]*");
    static const std::regex kEnd(
        R"(: ([a-z][a-z0-9_-]*(?: \(not part of all\))?(?:, [a-z][a-z0-9_-]*(?: \(not part of all\))?)*))"
        R"((?:, (?:a|or) .*)?(?: \(default[^()]*\))?$)");
    std::vector<std::string> values;
    for (const std::string& part : split_names(metavar, "|"))
        if (metavar.find('|') != std::string::npos && std::regex_match(part, kWord)) values.push_back(part);
    std::smatch match;
    if (std::regex_search(description, match, kEnd))
        for (const std::string& part :
             split_names(std::regex_replace(match[1].str(), std::regex(R"( \([^()]*\)| )"), "")))
            values.push_back(part);
    return values;
}

ManualOption manual_option(const CLI::Option& option) {
    ManualOption o;
    for (const std::string& name : option.get_lnames()) o.names.push_back("--" + name);
    for (const std::string& name : option.get_snames()) o.names.push_back("-" + name);
    if (option.get_positional()) o.names = {option.get_name(true)};
    if (option.get_type_size() > 0) o.metavar = option.get_type_name();
    o.description = option.get_description();
    o.group = option.get_group();
    // CLI11 appends the values of its own checks: "TEXT:{naive,plain} ...".
    if (const std::size_t brace = o.metavar.find(":{"); brace != std::string::npos) {
        o.values = split_names(o.metavar.substr(brace + 2, o.metavar.find('}') - brace - 2));
        o.metavar.resize(brace);
        o.description += fmt::format(": {}", fmt::join(o.values, ", "));
        if (brace == 0) o.metavar = "NAME";
    } else {
        o.metavar = o.metavar.substr(0, o.metavar.find(':'));
        o.values = values_of(o.metavar, o.description);
    }
    o.list = o.metavar.ends_with(",...");
    o.repeated = option.get_expected_max() > 1 || option.get_multi_option_policy() == CLI::MultiOptionPolicy::TakeAll;
    o.required = option.get_required();
    return o;
}

ManualCommand manual_command(const CLI::App& app, const std::string& name) {
    ManualCommand command{name, app.get_description(), app.get_footer(), {}, {}};
    for (const std::string& group : app.get_groups())
        for (const CLI::Option* option : app.get_options())
            if (!option->get_positional() && option->get_group() == group)
                command.options.push_back(manual_option(*option));
    for (const CLI::Option* option : app.get_options())
        if (option->get_positional()) command.positionals.push_back(manual_option(*option));
    return command;
}

/// Returns text for roff. What stands between backquotes becomes bold.
std::string roff(const std::string& text) {
    std::string result;
    bool bold = false, joins = false;
    for (const char c : text) {
        if (joins && c != ' ') result += "\\:";  // long lists without blanks may break here
        joins = c == ',' || c == '|';
        if (c == '`') {
            bold = !bold;
            result += bold ? "\\fB" : "\\fR";
        } else if (c == '-') {
            result += "\\-";
        } else if (c == '\\') {
            result += "\\e";
        } else {
            result += c;
        }
    }
    if (result.starts_with('.') || result.starts_with('\'')) result.insert(0, "\\&");
    return result;
}

std::string roff_option(const ManualOption& o) {
    std::vector<std::string> names = o.names;
    std::ranges::sort(names, {}, [](const std::string& name) { return name.starts_with("--"); });
    std::string text = fmt::format(".TP\n\\fB{}\\fR", roff(fmt::format("{}", fmt::join(names, ", "))));
    if (!o.metavar.empty()) text += fmt::format(" \\fI{}\\fR", roff(o.metavar));
    return text + "\n" + roff(o.description) + "\n";
}

constexpr const char* kProgramSections = R"(.SH EXIT STATUS
.TP
.B 0
The command has done what was asked.
.TP
.B 1
It failed; a line on standard error names the file or element and what is wrong.
.TP
.B 2
The command line cannot be used.
.TP
.B 128 + N
Signal N has ended it.
.PP
\fBhalflight\-compare\fR(1) has a table of its own.
.SH ENVIRONMENT
.TP
.B OCIO
OpenColorIO config, where \fB\-\-ocio\fR names none.
.TP
.B XDG_CACHE_HOME
Folder of caches: compiled shaders, page files and references are in its folder \fIhalflight\fR.
.TP
.B LP_NUM_THREADS
Most threads of the software driver.
.SH EXAMPLES
.EX
halflight render scene.glb picture.exr picture.png \-\-samples 64 \-\-denoise
halflight info scene.glb \-\-names
halflight view scene.glb
.EE
)";

/// Removes the man pages that earlier versions have written for commands that are no more.
void remove_old_pages(const std::filesystem::path& folder, const Manual& manual) {
    constexpr std::uint64_t kMostBytes = 1 << 20;
    std::error_code none;
    std::vector<std::filesystem::path> old;
    for (const auto& entry : std::filesystem::directory_iterator(folder, none)) {
        const std::string name = entry.path().filename().string();
        if (!name.starts_with("halflight-") || !name.ends_with(".1") || manual.files.contains(entry.path())) continue;
        try {
            if (read_file(entry.path(), kMostBytes).starts_with(".TH HALFLIGHT\\-")) old.push_back(entry.path());
        } catch (const Error&) {  // no page that this program has written
        }
    }
    for (const auto& page : old) std::filesystem::remove(page, none);
}

}  // namespace

std::vector<ManualCommand> manual_commands(const CLI::App& app) {
    std::vector<ManualCommand> commands = {manual_command(app, "")};
    for (const CLI::App* command : app.get_subcommands({}))
        commands.push_back(manual_command(*command, command->get_name()));
    return commands;
}

std::string man_page(const ManualCommand& command, const std::vector<ManualCommand>& commands) {
    const std::string title = command.name.empty() ? "halflight" : "halflight-" + command.name;
    std::string summary = command.description;
    summary[0] = static_cast<char>(std::tolower(static_cast<unsigned char>(summary[0])));
    while (summary.ends_with('.')) summary.pop_back();
    std::string capitals = title;
    std::ranges::transform(capitals, capitals.begin(), [](unsigned char c) { return std::toupper(c); });
    // Long names cannot be adjusted to both margins. Macros of groff 1.23 set the adjustment of AD again.
    std::string page =
        fmt::format(".TH {} 1 {} \"halflight {}\" \"User Commands\"\n.ds AD l\n.ad l\n.nh\n.SH NAME\n{} \\- {}\n",
                    roff(capitals), HALFLIGHT_DATE, HALFLIGHT_VERSION, roff(title), roff(summary));
    page += fmt::format(".SH SYNOPSIS\n\\fBhalflight{}\\fR", command.name.empty() ? "" : " " + command.name);
    if (command.name.empty()) page += " \\fICOMMAND\\fR";
    for (const ManualOption& o : command.positionals) {
        const std::string name = fmt::format("\\fI{}{}\\fR", o.names[0], o.repeated ? "..." : "");
        page += o.required ? " " + name : " [" + name + "]";
    }
    page += " [\\fIOPTION\\fR...]\n";
    if (!command.positionals.empty()) page += ".SH ARGUMENTS\n";
    for (const ManualOption& o : command.positionals)
        page += fmt::format(".TP\n\\fI{}\\fR\n{}\n", o.names[0], roff(o.description));
    if (command.name.empty()) {
        page += ".SH COMMANDS\nEach command has a page of its own.\n";
        for (const ManualCommand& c : commands)
            if (!c.name.empty())
                page += fmt::format(".TP\n\\fBhalflight\\-{}\\fR(1)\n{}\n", c.name, roff(c.description));
    }
    page += ".SH OPTIONS\n";
    std::string group = "Options";
    for (const ManualOption& o : command.options) {
        if (o.group != group) page += fmt::format(".SS {}\n", roff(o.group));
        group = o.group;
        page += roff_option(o);
    }
    if (command.name.empty()) page += kProgramSections;
    if (!command.footer.empty()) page += ".SH NOTES\n" + roff(command.footer) + "\n";
    page += ".SH SEE ALSO\n";
    if (!command.name.empty()) page += "\\fBhalflight\\fR(1), ";
    return page + "the documents of the project, which packages install in \\fI/usr/share/doc/halflight\\fR\n";
}

std::map<std::filesystem::path, std::string> manual_files(const CLI::App& app) {
    const std::vector<ManualCommand> commands = manual_commands(app);
    std::map<std::filesystem::path, std::string> files = {
        {"bash-completion/completions/halflight", bash_completion(commands)},
        // Below /usr, Debian's zsh reads the first of these; below /usr/local, and elsewhere, it reads the second.
        {"zsh/vendor-completions/_halflight", zsh_completion(commands)},
        {"zsh/site-functions/_halflight", zsh_completion(commands)},
        {"fish/vendor_completions.d/halflight.fish", fish_completion(commands)},
    };
    for (const ManualCommand& c : commands)
        files[fmt::format("man/man1/halflight{}{}.1", c.name.empty() ? "" : "-", c.name)] = man_page(c, commands);
    return files;
}

void write_manual(const Manual& manual) {
    for (const auto& [path, text] : manual.files) {
        make_folder_of(path);
        write_file(path, text);
    }
    for (const auto& [path, text] : manual.files)
        if (path.extension() == ".1") return remove_old_pages(path.parent_path(), manual);
}

}  // namespace halflight
