// Tests progress messages, and what an interrupted run leaves behind.
#include <signal.h>

#include <regex>

#include "tests/cli/output_test.h"

namespace halflight::test {
namespace {

using Progress = Output;

TEST_F(Progress, InLines) {
    const Outcome plain = render(words(file("a.exr"), "--samples 20"));
    EXPECT_TRUE(std::regex_match(plain.err, std::regex("(halflight: .*\n)*"))) << plain.err;
    expect_has(plain.err, "20/20 samples, ");
    EXPECT_LT(std::count(plain.err.begin(), plain.err.end(), '\n'), 15) << plain.err;
}

TEST_F(Progress, ByLevel) {
    const auto told = [&](const char* level) { return render(words(file("a.exr"), level)).err; };
    for (const char* level : {"--quiet", "--log-level error", "--log-level warning"})
        EXPECT_EQ(told(level), "") << level;
    const std::string note = told("--log-level note");
    expect_has(note, "samples, ");
    const char* const detail = "on the device, primary visibility";
    EXPECT_FALSE(has(note, detail));
    for (const char* level : {"--log-level detail", "--verbose"}) expect_has(told(level), detail);
}

TEST_F(Progress, InALogFile) {
    const std::string log = file("logs/a.log");
    const Strings quiet = words("--quiet --log", log);
    render(words(file("a.exr"), quiet, "--threads 1"));
    EXPECT_NE(run_program(words("render", scene, file("b.exr"), "--camera nobody", quiet)).status, 0);
    render(words(file("s.##.exr"), "--frames 1-2", quiet));
    std::istringstream lines(read_text(log));
    std::vector<std::string> all;
    for (std::string line; std::getline(lines, line);) all.push_back(line);
    const std::regex form("[0-9]{4}-[0-9]{2}-[0-9]{2}T[0-9:]{8}Z (error|warning|note|detail): .+");
    for (const std::string& line : all) EXPECT_TRUE(std::regex_match(line, form)) << line;
    const auto count = [&](const char* what) {
        return std::ranges::count_if(all, [&](const std::string& line) { return has(line, what); });
    };
    EXPECT_EQ(count("note: wrote "), 2);
    EXPECT_EQ(count("detail: seconds: "), 1);
    EXPECT_EQ(count("detail: frame "), 2);
    EXPECT_EQ(count("error: "), 1);
    EXPECT_EQ(count("no camera 'nobody'"), 1);
}

TEST_F(Progress, WithAnyNumberOfThreads) {
    /// Returns the greatest number of threads that the program had.
    const auto threads_of = [&](const char* name, const char* more) {
        int most = 0;
        RunOptions counted;
        counted.watch = [&](pid_t child, const std::string&) {
            std::error_code gone;
            int threads = 0;
            for (std::filesystem::directory_iterator at("/proc/" + std::to_string(child) + "/task", gone), end;
                 !gone && at != end; at.increment(gone))
                threads += 1;
            most = std::max(most, threads);
        };
        done(words("render", scene, "-o", file(name), "--width 96 --height 96 --samples 8", more), counted);
        return most;
    };
    threads_of("all.exr", "");
    const int seven = threads_of("seven.exr", "--threads 7"), one = threads_of("one.exr", "--threads 1");
    EXPECT_GE(seven, 7);
    EXPECT_LT(one, seven - 3);
    EXPECT_TRUE(same_pixels(file("all.exr"), file("one.exr")));
    EXPECT_TRUE(same_pixels(file("all.exr"), file("seven.exr")));
}

TEST_F(Progress, AsJson) {
    const Strings quiet = words("--quiet --progress json");
    auto picture = json_lines(render(words(file("a.exr"), "--samples 20", quiet)).err);
    std::erase_if(picture, [](const nlohmann::json& line) { return line.contains("step"); });
    ASSERT_FALSE(picture.empty());
    const nlohmann::json& last = picture.back();
    EXPECT_EQ(last.at("share"), 1);
    EXPECT_EQ(last.at("samples"), 20);
    EXPECT_EQ(last.at("samples_total"), 20);
    EXPECT_EQ(last.at("seconds_remaining"), 0);
    const auto frames = json_lines(render(words(file("f.#.exr"), "--frames 1-2", quiet)).err);
    for (const char* count : {"frame", "made", "frames"}) EXPECT_EQ(frames.back().at(count), 2) << count;
}

TEST_F(Progress, AsABar) {
    if (!std::filesystem::exists("/dev/pts/ptmx")) GTEST_SKIP() << "there are no terminals here";
    RunOptions terminal{.environment = {"TERM=xterm"}, .terminal = true};
    const Strings arguments = command(words(file("a.exr"), "--samples 20"));
    const Outcome bar = done(arguments, terminal);
    EXPECT_TRUE(std::regex_search(bar.err, std::regex(R"(\r\[#*\.*\] [0-9]+/20 samples, 0:[0-9]+ elapsed, )")))
        << bar.err;
    for (std::size_t at = 0; (at = bar.err.find("\r[", at)) != std::string::npos; ++at)
        EXPECT_LT(bar.err.find("\033[K", at) - (at + 1), 80u) << "wider than the terminal";

    expect_has(bar.err, "\rcompiling shaders: 1\033[K");
    terminal.environment = {"TERM=dumb"};
    EXPECT_FALSE(has(run_program(arguments, terminal).err, "\033"));
}

TEST_F(Progress, ClosedOutputsAreNoError) {
    render({file("heard.exr"), "--samples", "10"});
    render({file("closed.exr"), "--samples", "10"}, {.wrapper = {"sh", "-c", "exec \"$@\" <&- >&- 2>&-", "sh"}});
    render({file("full.exr"), "--samples", "10"}, {.stderr_path = "/dev/full"});
    for (const char* name : {"closed.exr", "full.exr"}) EXPECT_TRUE(same_pixels(file("heard.exr"), file(name))) << name;
}

TEST_F(Progress, InterruptedRunsLeaveNothing) {
    const auto files = folder.entries();
    const Strings endless = command(words(file("a.exr"), file("a.png"), "--samples 10000000"));
    for (const int signal : {SIGINT, SIGTERM, SIGKILL}) {
        bool sent = false;
        RunOptions options;
        options.watch = [&](pid_t child, const std::string& err) {
            // The exposure of a .png is metered after the device is reported, and then rendering starts.
            if (!sent && has(err, "pixels, camera")) sent = kill(child, signal) == 0;
        };
        const Outcome outcome = run_program(endless, options);
        EXPECT_EQ(outcome.status, 128 + signal) << outcome.err;
        EXPECT_EQ(folder.entries(), files);
        if (signal == SIGKILL) continue;
        const std::regex told("halflight: .*a.exr: not written: interrupted (before rendering|after .*)\n$");
        EXPECT_TRUE(std::regex_search(outcome.err, told)) << outcome.err;
    }
}

TEST_F(Progress, OldPictureStaysUntilTheNewOneIsComplete) {
    write_text(file("a.exr"), "old");
    refused(1, words("render", scene, file("a.exr"), "--camera rear"), "rear");
    EXPECT_EQ(read_text(file("a.exr")), "old");
    render({file("a.exr")});
    EXPECT_EQ(read_exr(file("a.exr")).width, 32);
}

}  // namespace
}  // namespace halflight::test
