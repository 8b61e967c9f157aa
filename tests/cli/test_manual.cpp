// Tests the man pages and completions that `halflight info --write-manual` writes, against the help texts and the
// parser.
#include <fmt/format.h>

#include <map>
#include <regex>
#include <set>

#include "tests/cli/command_test.h"
#include "tools/halflight/arguments.h"

namespace halflight::test {
namespace {

const Strings kCommands = {"render", "merge", "view", "thumbnail", "converge", "info", "pack", "bench", "compare"};

std::string replaced(const std::string& text, const char* pattern, const char* by) {
    return std::regex_replace(text, std::regex(pattern), by);
}

/// An option of a help text: its names, the longest one last, and its text.
struct HelpOption {
    Strings names;
    std::string text;
};

/// Loads completions of programs; Debian's package is bash-completion.
const std::filesystem::path kBashCompletion = "/usr/share/bash-completion/bash_completion";

class ManualTest : public CommandTest {
  protected:
    ManualTest() { done({"info", "--write-manual", folder.path}); }

    /// Returns the options of `halflight COMMAND --help`. Texts begin in a column, on the next line if names are
    /// long.
    static std::vector<HelpOption> help_options(const std::string& command) {
        constexpr std::size_t kColumn = 30;
        std::istringstream help(done({command, "--help"}).out);
        std::vector<HelpOption> options;
        for (std::string line; std::getline(help, line);) {
            if (line.starts_with(std::string(kColumn, ' ')) && !options.empty())
                options.back().text = line.substr(kColumn);
            if (!line.starts_with("  -")) continue;
            std::istringstream list(line.substr(2, line.find(' ', 2) - 2));
            options.emplace_back();
            for (std::string name; std::getline(list, name, ',');) options.back().names.push_back(name);
            if (line.size() > kColumn) options.back().text = line.substr(kColumn);
        }
        return options;
    }
    /// Returns the names of all options of a command, sorted.
    static std::set<std::string> names(const std::string& command) {
        std::set<std::string> all;
        for (const HelpOption& option : help_options(command)) all.insert(option.names.begin(), option.names.end());
        return all;
    }
    /// Returns what fish offers at the end of each command line.
    std::vector<std::set<std::string>> fish(const Strings& command_lines) const {
        std::string script = fmt::format("set PATH {} $PATH\nsource {}\n", program_folder(),
                                         file("fish/vendor_completions.d/halflight.fish"));
        for (std::size_t i = 0; i < command_lines.size(); ++i)
            script += fmt::format("complete -C '{}' | string replace -r '\\t.*' '' >{}\n", command_lines[i],
                                  file(fmt::format("offered.{}", i + 1)));
        write_text(file("test.fish"), script);
        run({"fish", "--no-config", file("test.fish")}, {.environment = {"HOME=" + folder.path.string()}});
        return offered(command_lines.size());
    }
    /// Returns the lines of the files "offered.1", "offered.2", ..., which are removed.
    std::vector<std::set<std::string>> offered(std::size_t count) const {
        std::vector<std::set<std::string>> all;
        for (std::size_t i = 1; i <= count; ++i) {
            const std::string name = file(fmt::format("offered.{}", i));
            all.push_back(std::filesystem::exists(name) ? lines(read_text(name)) : std::set<std::string>());
            std::filesystem::remove(name);
        }
        return all;
    }
    /// Returns what zsh offers at the end of each command line. Only its line editor completes, which needs a terminal:
    /// before it reads the first key, a function lists the completions of all lines and ends the shell.
    std::vector<std::set<std::string>> zsh(const Strings& command_lines) const {
        std::string quoted;
        for (const std::string& line : command_lines) quoted += fmt::format("'{}' ", line);
        write_text(file(".zshrc"), fmt::format(R"(
            PATH={}:$PATH
            fpath=({} $fpath)
            autoload -Uz compinit
            compinit -u -D
            compadd() {{
                if [[ ${{@[1,(i)(-|--)]}} == *-(O|A|D)\ * ]]; then
                    builtin compadd "$@"
                    return
                fi
                local -a hits
                builtin compadd -A hits "$@"
                print -rl -- $hits >>{}.$number
                builtin compadd "$@"
            }}
            zle -C offers list-choices _main_complete
            zle-line-init() {{
                for BUFFER in {}; do
                    ((++number))
                    CURSOR=$#BUFFER
                    zle offers
                done
                exit
            }}
            zle -N zle-line-init
            )",
                                               program_folder(), file("zsh/site-functions"), file("offered"), quoted));
        run({"zsh", "-f", "-c", "zmodload zsh/zpty; zpty shell zsh -i; while zpty -r shell; do :; done"},
            {.environment = {"ZDOTDIR=" + folder.path.string(), "HOME=" + folder.path.string(), "TERM=xterm"}});
        return offered(command_lines.size());
    }
    static std::string program_folder() { return std::filesystem::path(HALFLIGHT_PROGRAM).parent_path().string(); }

    /// Runs lines of bash after the completion, with a function `offers WORD...` that prints what is offered for the
    /// last word of a command line.
    Outcome bash(const std::string& lines) const {
        write_text(file("test.sh"), fmt::format(R"(
            set -eu +u
            PATH={}:$PATH
            . {}
            . {}
            compopt() {{ :; }}
            offers() {{
                COMP_WORDS=("$@") COMP_CWORD=$(($# - 1)) COMP_LINE="$*" COMP_TYPE=9 COMPREPLY=()
                COMP_POINT=${{#COMP_LINE}}
                _halflight || :
                printf "${{prefix-}}%s\n" "${{COMPREPLY[@]}}"
            }}
            {})",
                                                program_folder(), kBashCompletion.string(),
                                                file("bash-completion/completions/halflight"), lines));
        return run({"bash", "--noprofile", "--norc", file("test.sh")});
    }
    static std::set<std::string> lines(const std::string& text) {
        std::set<std::string> all;
        std::istringstream stream(text);
        for (std::string line; std::getline(stream, line);)
            if (!line.empty()) all.insert(line);
        return all;
    }
};

TEST_F(ManualTest, PagesHaveTheHelpTexts) {
    for (const std::string& command : kCommands) {
        SCOPED_TRACE(command);
        std::string page = read_text(file("man/man1/halflight-" + command + ".1"));
        page = replaced(replaced(page, R"(\\f[BIR]|\\:)", ""), R"(\\([-&e]))", "$1");
        const std::vector<HelpOption> options = help_options(command);
        EXPECT_GT(options.size(), 4U);
        const std::regex entry("\n\\.TP\n-");
        EXPECT_EQ(static_cast<std::size_t>(std::distance(std::sregex_iterator(page.begin(), page.end(), entry), {})),
                  options.size());
        for (const HelpOption& option : options) {
            expect_has(page, option.names.back());
            expect_has(page, "\n" + replaced(option.text, "`", ""));
        }
    }
    const std::string program = read_text(file("man/man1/halflight.1"));
    for (const std::string& command : kCommands) expect_has(program, "halflight\\-" + command);
}

TEST_F(ManualTest, CompletionsHaveTheOptionsOfTheHelpTexts) {
    const std::string zsh = read_text(file("zsh/site-functions/_halflight"));
    const std::string fish = read_text(file("fish/vendor_completions.d/halflight.fish"));
    for (const std::string& command : kCommands) {
        SCOPED_TRACE(command);
        const std::set<std::string> expected = names(command);
        const std::size_t from = zsh.find("\n    " + command + ")");
        const std::string of_command = zsh.substr(from, zsh.find(";;", from) - from);
        std::set<std::string> in_zsh, in_fish;
        const std::regex zsh_option(R"('(?:\*|\([^)]*\))(--?[\w-]+)[=+]?\[)");
        for (std::sregex_iterator at(of_command.begin(), of_command.end(), zsh_option), end; at != end; ++at)
            in_zsh.insert((*at)[1]);
        EXPECT_EQ(in_zsh, expected);
        const std::regex fish_line("__halflight_is " + command + "'((?: -[ls] [\\w-]+)+)");
        const std::regex fish_name(" -([ls]) ([\\w-]+)");
        for (std::sregex_iterator at(fish.begin(), fish.end(), fish_line), end; at != end; ++at) {
            const std::string list = (*at)[1];
            for (std::sregex_iterator name(list.begin(), list.end(), fish_name); name != end; ++name)
                in_fish.insert(((*name)[1] == "l" ? "--" : "-") + (*name)[2].str());
        }
        EXPECT_EQ(in_fish, expected);
        if (!exists(kBashCompletion)) continue;
        const Outcome offered = bash("offers halflight " + command + " -");
        EXPECT_EQ(lines(offered.out), expected) << offered.err;
    }
}

/// The parser accepts every value that a shell offers for an option.
TEST_F(ManualTest, OfferedValuesAreAccepted) {
    if (!exists(kBashCompletion)) GTEST_SKIP() << "needs bash-completion";
    std::string script;
    for (const char* command : {"render", "view", "info"})
        for (const HelpOption& option : help_options(command))
            script += fmt::format("prefix='{0} {1} '; offers halflight {0} {1} ''\n", command, option.names.back());
    std::filesystem::create_directory(file("empty"));
    const std::set<std::string> offered = lines(bash("cd " + file("empty") + "\n" + script).out);
    std::map<std::string, int> values;
    for (const std::string& line : offered) {
        Strings arguments = words(line.c_str());
        if (arguments.size() < 3 || arguments[2].starts_with('-')) continue;  // flags are followed by options
        ++values[arguments[1]];
        arguments.insert(arguments.begin() + 1, "a.glb");
        if (arguments[0] == "render") add_words(arguments, "a.exr b.png");
        arguments.insert(arguments.begin(), "halflight");
        std::vector<const char*> argv;
        for (const std::string& argument : arguments) argv.push_back(argument.c_str());
        try {
            parse_arguments(static_cast<int>(argv.size()), argv.data());
        } catch (const UsageError& error) {
            // Some values need another option, too.
            EXPECT_FALSE(has(error.what(), "expects") || has(error.what(), "unknown") || has(error.what(), " is no "))
                << line << "\n"
                << error.what();
        }
    }
    for (const char* option : {"--log-level", "--exr-compression", "--aov", "--env", "--tiff-type", "--animation"})
        EXPECT_TRUE(values.contains(option)) << option;
    EXPECT_EQ(values["--log-level"], 8) << "four values in two commands";
}

TEST_F(ManualTest, NamesComeFromTheScene) {
    if (!exists(kBashCompletion)) GTEST_SKIP() << "needs bash-completion";
    const std::string scene = copy_room(folder.path);
    const auto offered = [&](const std::string& words) {
        return lines(bash(fmt::format("offers halflight render {} {}", scene, words)).out);
    };
    EXPECT_EQ(offered("--camera ''"), (std::set<std::string>{"above", "front", "inside", "outside"}));
    EXPECT_EQ(offered("--camera fr"), std::set<std::string>{"front"});
    EXPECT_FALSE(offered("--material ''").empty());
    // Names are data: a shell must not run them.
    std::string text = read_text(scene);
    const std::string evil = "front $(touch run) `touch run`";
    text.replace(text.find("\"front\""), 7, "\"" + evil + "\"");
    write_text(scene, text);
    EXPECT_EQ(offered("--camera fr"), std::set<std::string>{evil});
    EXPECT_FALSE(std::filesystem::exists("run"));
}

/// The command lines of a test, and what every shell offers at their ends.
struct Offer {
    std::string line;
    std::set<std::string> words;
};

std::vector<Offer> offers_of(const std::string& scene, const std::vector<std::set<std::string>>& options) {
    std::vector<Offer> offers = {{"halflight rend", {"render"}},
                                 {"halflight render --log-level ", {"error", "warning", "note", "detail"}},
                                 {"halflight render --log-level wa", {"warning"}},
                                 {"halflight render " + scene + " --camera ", {"above", "front", "inside", "outside"}},
                                 {"halflight render " + scene + " --material floor.r", {"floor.roughness="}},
                                 {"halflight info " + scene.substr(0, scene.size() - 2), {}}};
    for (std::size_t i = 0; i < kCommands.size(); ++i)
        offers.push_back({"halflight " + kCommands[i] + " -", options[i]});
    return offers;
}

TEST_F(ManualTest, ZshAndFishOfferOptionsValuesAndNames) {
    const std::string scene = copy_room(folder.path);
    std::vector<std::set<std::string>> options;
    for (const std::string& command : kCommands) options.push_back(names(command));
    std::vector<Offer> offers = offers_of(scene, options);
    Strings command_lines;
    for (const Offer& offer : offers) command_lines.push_back(offer.line);
    bool tested = false;
    for (const std::string shell : {"zsh", "fish"}) {
        if (run({"sh", "-c", "command -v " + shell}).status != 0) continue;
        tested = true;
        const std::vector<std::set<std::string>> found = shell == "zsh" ? zsh(command_lines) : fish(command_lines);
        for (std::size_t i = 0; i < offers.size(); ++i) {
            SCOPED_TRACE(shell + ": " + offers[i].line);
            const std::set<std::string>& words = found[i];
            if (offers[i].line.ends_with(".gl")) {
                EXPECT_EQ(words.size(), 1u);
                for (const std::string& word : words) expect_has(word, "room.gltf");
                continue;
            }
            EXPECT_EQ(words, offers[i].words);
        }
    }
    if (!tested) GTEST_SKIP() << "needs zsh or fish";
}

TEST_F(ManualTest, PagesHaveNoFaultsAndOldOnesVanish) {
    const std::string old = file("man/man1/halflight-old.1"), other = file("man/man1/halflight-other.1");
    write_text(old, ".TH HALFLIGHT\\-OLD 1\n");
    write_text(other, ".TH OTHER 1\n");
    done({"info", "--write-manual", folder.path});
    EXPECT_FALSE(std::filesystem::exists(old));
    EXPECT_TRUE(std::filesystem::exists(other)) << "another program has written it";
    std::filesystem::remove(other);
    if (run({"sh", "-c", "command -v man"}).status != 0) GTEST_SKIP() << "needs man";
    const Outcome pages = run(
        {"sh", "-c", "cd \"$1\" && for page in *.1; do man --warnings -E UTF-8 -l $page; done", "sh", file("man/man1")},
        {.environment = {"MANWIDTH=80", "LC_ALL=C.UTF-8"}});
    EXPECT_EQ(pages.err, "");
    expect_has(pages.out, "--log-level LEVEL");
}

}  // namespace
}  // namespace halflight::test
