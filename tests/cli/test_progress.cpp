// Tests progress messages, and what an interrupted run leaves behind.
#include <signal.h>

#include <nlohmann/json.hpp>
#include <regex>
#include <sstream>

#include "tests/cli/output_test.h"

namespace halflight::test {
namespace {

using Progress = Output;

TEST_F(Progress, InLines) {
    const Outcome plain = render({file("a.exr"), "--samples", "20"});
    EXPECT_TRUE(std::regex_match(plain.err, std::regex("(halflight: .*\n)*"))) << plain.err;
    EXPECT_NE(plain.err.find("20/20 samples, "), std::string::npos) << plain.err;
    EXPECT_LT(std::count(plain.err.begin(), plain.err.end(), '\n'), 15) << plain.err;
    EXPECT_EQ(render({file("b.exr"), "--quiet"}).err, "");
}

TEST_F(Progress, ByLevel) {
    const auto said = [&](Strings more, const char* what) {
        more.push_back(file("a.exr"));
        return render(more).err.find(what) != std::string::npos;
    };
    for (const char* level : {"error", "warning"})
        EXPECT_EQ(render({file("a.exr"), "--log-level", level}).err, "") << level;
    EXPECT_TRUE(said({"--log-level", "note"}, "samples, "));
    EXPECT_FALSE(said({"--log-level", "note"}, "on the device, primary visibility"));
    for (const Strings& detail : {Strings{"--log-level", "detail"}, Strings{"--verbose"}})
        EXPECT_TRUE(said(detail, "on the device, primary visibility"));
}

TEST_F(Progress, InALogFile) {
    const std::string log = file("logs/a.log");
    render({file("a.exr"), "--quiet", "--log", log, "--threads", "1"});
    EXPECT_NE(run_program({"render", scene, file("b.exr"), "--camera", "nobody", "--quiet", "--log", log}).status, 0);
    render({file("s.##.exr"), "--frames", "1-2", "--quiet", "--log", log});
    std::istringstream lines(read_text(log));
    std::vector<std::string> all;
    for (std::string line; std::getline(lines, line);) all.push_back(line);
    const std::regex form("[0-9]{4}-[0-9]{2}-[0-9]{2}T[0-9:]{8}Z (error|warning|note|detail): .+");
    for (const std::string& line : all) EXPECT_TRUE(std::regex_match(line, form)) << line;
    const auto count = [&](const char* what) {
        return std::ranges::count_if(all, [&](const std::string& line) { return line.find(what) != line.npos; });
    };
    EXPECT_EQ(count("note: wrote "), 2);
    EXPECT_EQ(count("detail: seconds: "), 1);
    EXPECT_EQ(count("detail: frame "), 2);
    EXPECT_EQ(count("error: "), 1);
    EXPECT_EQ(count("no camera 'nobody'"), 1);
}

TEST_F(Progress, WithAnyNumberOfThreads) {
    const Strings size = {"--width", "96", "--height", "96", "--samples", "8"};
    const auto with = [&](Strings arguments) {
        arguments.insert(arguments.end(), size.begin(), size.end());
        return arguments;
    };
    render(with({file("all.exr")}));
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
    Strings seven = {"render", scene, "--output", file("seven.exr"), "--threads", "7"};
    seven.insert(seven.end(), size.begin(), size.end());
    EXPECT_EQ(run_program(seven, counted).status, 0);
    EXPECT_GE(most, 7);
    const int of_seven = std::exchange(most, 0);
    Strings one = {"render", "-o", file("one.exr"), scene, "--threads", "1"};
    one.insert(one.end(), size.begin(), size.end());
    EXPECT_EQ(run_program(one, counted).status, 0);
    EXPECT_LT(most, of_seven - 3);
    EXPECT_TRUE(same_pixels(file("all.exr"), file("one.exr")));
    EXPECT_TRUE(same_pixels(file("all.exr"), file("seven.exr")));
}

TEST_F(Progress, AsJson) {
    const auto objects = [](const std::string& lines) {
        std::vector<nlohmann::json> all;
        std::istringstream stream(lines);
        for (std::string line; std::getline(stream, line);) all.push_back(nlohmann::json::parse(line));
        return all;
    };
    auto picture = objects(render({file("a.exr"), "--samples", "20", "--quiet", "--progress", "json"}).err);
    std::erase_if(picture, [](const nlohmann::json& line) { return line.contains("step"); });
    ASSERT_FALSE(picture.empty());
    const nlohmann::json& last = picture.back();
    EXPECT_EQ(last.at("share"), 1);
    EXPECT_EQ(last.at("samples"), 20);
    EXPECT_EQ(last.at("samples_total"), 20);
    EXPECT_EQ(last.at("seconds_remaining"), 0);
    const auto frames = objects(render({file("f.#.exr"), "--frames", "1-2", "--quiet", "--progress", "json"}).err);
    EXPECT_EQ(frames.back().at("frame"), 2);
    EXPECT_EQ(frames.back().at("made"), 2);
    EXPECT_EQ(frames.back().at("frames"), 2);
    EXPECT_EQ(run_program({"render", scene, file("b.exr"), "--progress", "xml"}).err,
              "halflight: --progress: expects text or json, not 'xml'\n");
}

TEST_F(Progress, AsABar) {
    if (!std::filesystem::exists("/dev/pts/ptmx")) GTEST_SKIP() << "there are no terminals here";
    RunOptions terminal{.environment = {"TERM=xterm"}, .terminal = true};
    const Strings arguments = {"render", scene, file("a.exr"), "--width", "32", "--height", "32", "--samples", "20"};
    const Outcome bar = run_program(arguments, terminal);
    EXPECT_EQ(bar.status, 0) << bar.err;
    EXPECT_TRUE(std::regex_search(bar.err, std::regex(R"(\r\[#*\.*\] [0-9]+/20 samples, 0:[0-9]+ elapsed, )")))
        << bar.err;
    for (std::size_t at = 0; (at = bar.err.find("\r[", at)) != std::string::npos; ++at)
        EXPECT_LT(bar.err.find("\033[K", at) - (at + 1), 80u) << "wider than the terminal";

    EXPECT_NE(bar.err.find("\rcompiling shaders: 1\033[K"), std::string::npos) << bar.err;

    terminal.environment = {"TERM=dumb"};
    const Outcome dumb = run_program(arguments, terminal);
    EXPECT_EQ(dumb.err.find('\033'), std::string::npos) << dumb.err;
}

TEST_F(Progress, ClosedOutputsAreNoError) {
    render({file("heard.exr"), "--samples", "10"});
    render({file("closed.exr"), "--samples", "10"}, {.wrapper = {"sh", "-c", "exec \"$@\" <&- >&- 2>&-", "sh"}});
    render({file("full.exr"), "--samples", "10"}, {.stderr_path = "/dev/full"});
    for (const char* name : {"closed.exr", "full.exr"}) EXPECT_TRUE(same_pixels(file("heard.exr"), file(name))) << name;
}

TEST_F(Progress, InterruptedRunsLeaveNothing) {
    const auto files = folder.entries();
    const Strings endless = {"render", scene,      file("a.exr"), file("a.png"), "--width",
                             "32",     "--height", "32",          "--samples",   "10000000"};
    for (const int signal : {SIGINT, SIGTERM, SIGKILL}) {
        bool sent = false;
        RunOptions options;
        options.watch = [&](pid_t child, const std::string& err) {
            // The exposure of a .png is metered after the device is reported, and then rendering starts.
            if (!sent && err.find("pixels, camera") != std::string::npos) sent = kill(child, signal) == 0;
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
    const Outcome bad = run_program({"render", scene, file("a.exr"), "--camera", "rear"});
    EXPECT_EQ(bad.status, 1);
    EXPECT_EQ(read_text(file("a.exr")), "old");
    render({file("a.exr")});
    EXPECT_EQ(read_exr(file("a.exr")).width, 32);
}

}  // namespace
}  // namespace halflight::test
