// Tests child processes, temporary folders, and the runner of the tests' programs.
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
    ASSERT_EQ(setenv("HALFLIGHT_TEST_A", "old", 1), 0);
    ASSERT_EQ(setenv("HALFLIGHT_TEST_B", "kept", 1), 0);
    const std::string script = "echo ${HALFLIGHT_TEST_A-none} ${HALFLIGHT_TEST_B-none} ${HALFLIGHT_TEST_C-none}";
    EXPECT_EQ(output_of(script), "old kept none\n");
    EXPECT_EQ(output_of(script, {.environment = {"HALFLIGHT_TEST_A=new=er", "HALFLIGHT_TEST_C="}}), "new=er kept\n");
    EXPECT_EQ(output_of(script, {.environment = {"HALFLIGHT_TEST_A"}}), "none kept none\n");
}

TEST(Process, ProgramsThatCannotBeStartedAreNamed) {
    EXPECT_EQ(error_message([] { Process({"no such program"}); }), "no such program: is no program in PATH");
    {
        const TemporaryFolder folder;
        std::ofstream(folder / "no folder") << "x";
        const std::string path = std::getenv("PATH") ? std::getenv("PATH") : "";
        setenv("PATH", (folder / "no folder").c_str(), 1);
        EXPECT_EQ(error_message([] { Process({"no such program"}); }), "no such program: is no program in PATH");
        setenv("PATH", path.c_str(), 1);
    }
    EXPECT_EQ(error_message([] { Process({"/no/such"}); }), "/no/such: cannot be started: No such file or directory");
    EXPECT_EQ(error_message([] { Process({"/dev/null"}); }), "/dev/null: cannot be started: Permission denied");
}

TEST(Process, IsKilledWithItsGroup) {
    TemporaryFolder folder;
    const std::string late = folder / "late", script = "(sleep 3; touch '" + late + "') & ";
    { Process killed({"sh", "-c", script + "wait"}); }
    Process({"sh", "-c", script}).wait();  // the script ends at once and leaves a child behind
    std::this_thread::sleep_for(std::chrono::milliseconds(3500));
    EXPECT_FALSE(std::filesystem::exists(late));
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
    EXPECT_EQ(split_command(""), Strings{});
    EXPECT_EQ(split_command(" \t\n"), Strings{});
    EXPECT_EQ(split_command("a  b\tc\n"), (Strings{"a", "b", "c"}));
    EXPECT_EQ(split_command(R"('a b' "c d" e\ f '' "")"), (Strings{"a b", "c d", "e f", "", ""}));
    EXPECT_EQ(split_command(R"(a'b'"c"\'d)"), Strings{"abc'd"});
    EXPECT_EQ(split_command(R"("a \" \\ \n $x" '\')"), (Strings{R"(a " \ \n $x)", "\\"}));
    EXPECT_EQ(split_command("a \\\n b\\\nc \"d\\\ne\" 'f\\\ng'"), (Strings{"a", "bc", "de", "f\\\ng"}));
    EXPECT_EQ(split_command("a | b; c > $(d)"), (Strings{"a", "|", "b;", "c", ">", "$(d)"}));
    EXPECT_EQ(error_message([] { split_command("a 'b"); }), "a 'b: has a ' that is not closed");
    EXPECT_EQ(error_message([] { split_command("a \"b'"); }), "a \"b': has a \" that is not closed");
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

TEST(TestRunner, GivesBackWhatProgramsPrint) {
    const test::Outcome outcome = test::run({"sh", "-c", "echo one; echo two >&2; exit 4"});
    EXPECT_EQ(outcome.status, 4);
    EXPECT_EQ(outcome.out, "one\n");
    EXPECT_EQ(outcome.err, "two\n");
    EXPECT_EQ(test::run({"sh", "-c", "stty size <&1; test -t 2"}, {.terminal = true}).err, "24 80\r\n");
    EXPECT_EQ(test::run({"sh", "-c", "echo $X"}, {.environment = {"X=1"}, .wrapper = {"env", "X=2"}}).out, "2\n");
    EXPECT_EQ(test::run({"sleep", "60"}, {.most_seconds = 1}).status, 128 + SIGALRM);
    const test::Outcome full = test::run({"sh", "-c", "echo x; test $? != 0"}, {.stdout_path = "/dev/full"});
    EXPECT_EQ(full.status, 0) << full.err;
}

TEST(TestDevice, IsInsertedWhereACommandRenders) {
    const std::string device = test::test_device();
    EXPECT_EQ(test::on_test_device({"render", "a.glb"}), (Strings{"render", "--device", device, "a.glb"}));
    for (const Strings& same : {Strings{}, Strings{"info", "a.glb"}, Strings{"render", "--help"},
                                Strings{"render", "a.glb", "--device", "0"}, Strings{"view", "--device=0"}})
        EXPECT_EQ(test::on_test_device(same), same);
}

}  // namespace
}  // namespace halflight
