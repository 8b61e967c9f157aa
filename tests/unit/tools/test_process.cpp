// Tests child processes and temporary folders.
#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <fstream>
#include <thread>

#include "engine/core/process.h"
#include "tests/support/error_message.h"
#include "tests/support/process.h"
#include "tests/unit/core/environment_variable.h"

namespace halflight {
namespace {

using Strings = std::vector<std::string>;

/// Returns what a shell script prints on stdout.
std::string output_of(const std::string& script, ProcessOptions options = {}) {
    const Spool out;
    options.output = out.descriptor();
    EXPECT_EQ(Process({"sh", "-c", script}, options).wait().status, 0);
    return out.text();
}

TEST(Process, ArgumentsArriveAsTheyAre) {
    const Spool out;
    Process({"printf", "[%s]", "", "a b", "'\"$(id)\\", "*"}, {.output = out.descriptor()}).wait();
    EXPECT_EQ(out.text(), "[][a b]['\"$(id)\\][*]");
    EXPECT_THROW(out.text(3), Error);
}

TEST(Process, SpoolsAreNotInherited) {
    const Spool other;
    EXPECT_EQ(output_of(fmt::format("test -e /proc/self/fd/{} && echo open; true", other.descriptor())), "");
}

TEST(Process, TellsHowItEnds) {
    const ProcessEnd exited = Process({"sh", "-c", "exit 3"}).wait();
    EXPECT_EQ(exited.status, 3);
    EXPECT_EQ(exited.signal, 0);
    EXPECT_GT(exited.peak_bytes, 100000u);
    const ProcessEnd killed = Process({"sh", "-c", "kill -TERM $$"}).wait();
    EXPECT_EQ(killed.signal, SIGTERM);
    EXPECT_EQ(killed.status, 128 + SIGTERM);
    EXPECT_GT(Process({"sh", "-c", "i=0; while [ $i -lt 20000 ]; do i=$((i + 1)); done"}).wait().cpu_seconds, 0.001);
}

TEST(Process, StreamsAndEnvironmentAreThoseAskedFor) {
    EXPECT_EQ(output_of("cat; echo heard >&2; readlink /proc/self/fd/0"), "/dev/null\n");
    const test::EnvironmentVariable a("HALFLIGHT_TEST_A", "old"), b("HALFLIGHT_TEST_B", "kept");
    const std::string script = "echo ${HALFLIGHT_TEST_A-none} ${HALFLIGHT_TEST_B-none} ${HALFLIGHT_TEST_C-none}";
    EXPECT_EQ(output_of(script), "old kept none\n");
    EXPECT_EQ(output_of(script, {.environment = {"HALFLIGHT_TEST_A=new=er", "HALFLIGHT_TEST_C="}}), "new=er kept\n");
    EXPECT_EQ(output_of(script, {.environment = {"HALFLIGHT_TEST_A"}}), "none kept none\n");
}

TEST(Process, ProgramsThatCannotBeStartedAreNamed) {
    for (const char* program : {"no such program", "/no/such", "/dev/null"})
        EXPECT_TRUE(error_message([&] { Process({program}); }).starts_with(std::string(program) + ": ")) << program;
    const TemporaryFolder folder;
    std::ofstream(folder / "no folder") << "x";
    const test::EnvironmentVariable path("PATH", (folder / "no folder").c_str());
    EXPECT_EQ(error_message([] { Process({"no such program"}); }), "no such program: is no program in PATH");
}

/// Returns whether a process has ended; nobody may have waited for it yet.
bool has_ended(const std::string& id) {
    std::ifstream file("/proc/" + id + "/stat");
    std::string state;
    std::getline(file, state);
    return state.empty() || state.find(") Z ") != std::string::npos;
}

TEST(Process, IsKilledWithItsGroup) {
    for (const bool waits : {true, false}) {  // whether the script waits for its child, or leaves it behind
        const Spool out;
        {
            const std::string script = "sleep 60 & echo $!";
            Process process({"sh", "-c", script + (waits ? "; wait" : "")}, {.output = out.descriptor()});
            if (!waits) process.wait();
            while (!out.text().ends_with('\n')) std::this_thread::sleep_for(std::chrono::milliseconds(1));
        }
        const std::string child = last_line(out.text());
        for (int i = 0; i < 10000 && !has_ended(child); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(1));
        EXPECT_TRUE(has_ended(child)) << child;
    }
}

TEST(Process, PulseCanEndTheWait) {
    int pulses = 0;
    Process process({"sleep", "60"});
    const auto stop = [&] {
        if (++pulses == 3) throw Error("test", "stop");
    };
    EXPECT_THROW(process.wait(stop), Error);
    EXPECT_EQ(pulses, 3);
    EXPECT_EQ(kill(process.id(), 0), 0) << "it still runs";
}

TEST(Process, CommandsAreSplitAsAShellQuotesThem) {
    const std::pair<const char*, Strings> cases[] = {{"", {}},
                                                     {" \t\n", {}},
                                                     {"a  b\tc\n", {"a", "b", "c"}},
                                                     {R"('a b' "c d" e\ f '' "")", {"a b", "c d", "e f", "", ""}},
                                                     {R"(a'b'"c"\'d)", {"abc'd"}},
                                                     {R"("a \" \\ \n $x" '\')", {R"(a " \ \n $x)", "\\"}},
                                                     {"a \\\n b\\\nc \"d\\\ne\" 'f\\\ng'", {"a", "bc", "de", "f\\\ng"}},
                                                     {"a | b; c > $(d)", {"a", "|", "b;", "c", ">", "$(d)"}}};
    for (const auto& [command, words] : cases) EXPECT_EQ(split_command(command), words);
    for (const char* open : {"a 'b", "a \"b'"}) EXPECT_THROW(split_command(open), Error);
}

TEST(Process, LastLines) {
    EXPECT_EQ(last_line(""), "");
    EXPECT_EQ(last_line("\n \n"), "");
    EXPECT_EQ(last_line("one"), "one");
    EXPECT_EQ(last_line("one\ntwo \r\n\n"), "two");
}

TEST(TemporaryFolders, AreNewAndGoWithTheObject) {
    std::filesystem::path path;
    {
        const TemporaryFolder folder, other;
        path = folder.path;
        EXPECT_NE(path, other.path);
        EXPECT_EQ(std::filesystem::status(path).permissions(), std::filesystem::perms::owner_all);
        EXPECT_EQ(folder.entries(), Strings{});
        test::write_text(folder / "b", "");
        std::filesystem::create_directories(folder / "a" / "c");
        EXPECT_EQ(folder.entries(), (Strings{"a", "b"}));
    }
    EXPECT_FALSE(std::filesystem::exists(path));
}

}  // namespace
}  // namespace halflight
