// Tests failures of sequences, what they leave behind, and further inputs that decide whether frames are kept.
#include <signal.h>

#include <algorithm>
#include <chrono>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <regex>
#include <sstream>
#include <thread>

#include "tests/cli/sequence_test.h"

namespace halflight::test {
namespace {

using Json = nlohmann::json;

TEST_F(Sequence, ABadFrameDoesNotStopOthers) {
    scene = write_scene_with_bad_frame(folder.path);
    const std::string stats = folder / "stats.json";
    const Outcome outcome = run("out", "1-5", {"--fps", "1", "--stats", stats});
    EXPECT_EQ(outcome.status, 1);
    EXPECT_TRUE(std::regex_match(last_line(outcome),
                                 std::regex("halflight: .*f.####.exr: frame 3 \\(1 of 5\\) failed: .*overflows")))
        << outcome.err;
    EXPECT_EQ(contents("out").size(), 4u);
    EXPECT_FALSE(fs::exists(file("out", 3)));
    EXPECT_FALSE(same_pixels(file("out", 2), file("out", 4))) << "frame 4 shows what it should";
    std::istringstream lines(read_text(stats));
    std::vector<Json> all;
    for (std::string line; std::getline(lines, line);) all.push_back(Json::parse(line));
    ASSERT_EQ(all.size(), 5u);
    EXPECT_EQ(all[2].at("frame"), 3);
    EXPECT_TRUE(all[2].contains("error"));
    EXPECT_EQ(all[3].at("time"), 4);
    EXPECT_EQ(all[3].at("outputs"), Strings{file("out", 4)});
    const Outcome quiet = run("out", "1-5", {"--fps", "1", "--quiet"});
    EXPECT_EQ(quiet.status, 1);
    EXPECT_EQ(std::count(quiet.err.begin(), quiet.err.end(), '\n'), 1) << quiet.err;
}

TEST_F(Sequence, FramesAfterABadOneKeepTheirEnvironment) {
    scene = write_blinking_scene(folder.path, {vec3(1), vec3(1, 0, 1), vec3(1)});
    const Strings more = {"--fps", "1", "--env", "0.2,0.5,0.9", "--node", "blinking=matrix:1,0,0,0,0,1,0,2,0,0,1,0"};
    const Outcome outcome = run("out", "0-2", more);
    EXPECT_EQ(outcome.status, 1);
    EXPECT_TRUE(std::regex_match(last_line(outcome), std::regex(".*frame 1 \\(1 of 3\\) failed: .*no inverse.*")))
        << outcome.err;
    make("alone", "2", more);
    EXPECT_TRUE(same_pixels(file("out", 2), file("alone", 2)));
}

/// Environment variables of OpenColorIO choose the view where options leave it open.
TEST_F(Sequence, FramesDependOnTheViewThatIsFound) {
    const auto render = [&](std::vector<std::string> environment) {
        const Strings arguments = {"render",   scene, folder / "v.#.png", "--frames", "1",      "--width", "8",
                                   "--height", "8",   "--samples",        "1",        "--quiet"};
        return run_program(arguments, {.environment = std::move(environment)});
    };
    ASSERT_EQ(render({}).status, 0);
    EXPECT_EQ(render({}).status, 0);
    const Outcome other = render({"OCIO_ACTIVE_VIEWS=Raw"});
    EXPECT_EQ(other.status, 1);
    EXPECT_NE(other.err.find("is not this frame"), std::string::npos) << other.err;
}

TEST_F(Sequence, AFailedWriteConcernsItsFrameOnly) {
    fs::create_directories(file("out", 2));
    const Outcome outcome = run("out", "1-3");
    EXPECT_EQ(outcome.status, 1);
    EXPECT_TRUE(
        std::regex_match(last_line(outcome), std::regex(".*frame 2 \\(1 of 3\\) failed: .*f.0002.exr.*directory")))
        << outcome.err;
    EXPECT_TRUE(fs::exists(file("out", 1)) && fs::exists(file("out", 3)));

    write_text(folder / "file", "");
    const Outcome nowhere = run_program({"render", scene, folder / "file" / "f.#.exr", "--frames", "1"});
    EXPECT_EQ(nowhere.status, 1);
    EXPECT_TRUE(std::regex_match(nowhere.err, std::regex(".*file/f.#.exr: cannot write: Not a directory\n")))
        << nowhere.err;
    const Outcome deep = run("none/deeper", "1");
    EXPECT_EQ(deep.status, 0) << deep.err;
    EXPECT_TRUE(fs::exists(file("none/deeper", 1)));
}

TEST_F(Sequence, FullDisk) {
    // Frames of 64 x 64 noisy pixels exceed the limit. The driver's shader cache must not reach it.
    fs::create_directory(folder / "out");
    const Outcome outcome =
        run_program({"render", scene, folder / "out" / "f.%02d.exr", "--frames", "1-2", "--width", "64", "--height",
                     "64", "--samples", "1", "--animation", "none", "--aov", "normal", "--quiet"},
                    {.environment = {"MESA_SHADER_CACHE_DISABLE=true", "HALFLIGHT_SHADER_SOURCES"},
                     .wrapper = {"prlimit", "--fsize=8192"}});
    EXPECT_EQ(outcome.status, 1);
    EXPECT_TRUE(std::regex_match(
        outcome.err,
        std::regex("halflight: .*f.%02d.exr: frames 1,2 \\(2 of 2\\) failed: .*f.01.exr: .*File too large\n")))
        << outcome.err;
    EXPECT_TRUE(fs::is_empty(folder / "out")) << "something is left";
}

TEST_F(Sequence, StoppedBySignal) {
    bool sent = false;
    RunOptions options;
    options.watch = [&](pid_t child, const std::string& err) {
        if (!sent && err.find("frame 2 written") != std::string::npos) sent = kill(child, SIGTERM) == 0;
    };
    fs::create_directory(folder / "out");
    const Outcome outcome = run("out", "1-100000", {}, options);
    EXPECT_EQ(outcome.status, 128 + SIGTERM);
    EXPECT_TRUE(
        std::regex_match(last_line(outcome),
                         std::regex("halflight: .*: interrupted in frame [0-9]+: [0-9]+ of 100000 frames are there")))
        << outcome.err;
    EXPECT_GE(contents("out").size(), 2u);
    for (const auto& entry : fs::directory_iterator(folder / "out")) EXPECT_NO_THROW(read_exr(entry.path()));
    EXPECT_EQ(contents("out").size(),
              static_cast<std::size_t>(std::distance(fs::directory_iterator(folder / "out"), {})))
        << "a temporary is left";
}

/// Returns the path of a config whose only view is the table.
fs::path write_config_with_table(const fs::path& folder, const std::string& table) {
    write_text(folder / "table.cube", table);
    write_text(folder / "config.ocio", R"(ocio_profile_version: 1
search_path: "."
roles: {default: lin_srgb, scene_linear: lin_srgb}
displays:
  d:
    - !<View> {name: v, colorspace: out}
colorspaces:
  - !<ColorSpace> {name: lin_srgb}
  - !<ColorSpace>
    name: out
    from_reference: !<FileTransform> {src: table.cube, interpolation: linear}
)");
    return folder / "config.ocio";
}

TEST_F(Sequence, TablesOfTheColourConfigAreSettings) {
    const std::string table = "LUT_1D_SIZE 2\n0 0 0\n1 1 1\n";
    const Strings config = {"--ocio", write_config_with_table(folder.path, table), "--aov", "depth"};
    make("out", "1", config);
    EXPECT_EQ(make("out", "1", config).err, "halflight: 1 of 1 frames are there already\n");
    write_config_with_table(folder.path, "LUT_1D_SIZE 2\n0 0 0\n1 1 0.5\n");
    EXPECT_EQ(run("out", "1", config).status, 1) << "of another table";
}

TEST_F(Sequence, StatisticsAreWrittenInEveryCase) {
    make("out", "1");
    make("out", "1", {"--stats", folder / "s.json"});
    EXPECT_EQ(read_text(folder / "s.json"), "");
}

TEST_F(Sequence, RemainsOfAKilledRunAreRemoved) {
    // A movie is written during the whole run, so the run is killed while it writes one.
    fs::create_directory(folder / "bin");
    write_text(folder / "bin" / "ffmpeg", "#!/bin/sh\ncat > /dev/null\n");
    fs::permissions(folder / "bin" / "ffmpeg", fs::perms::owner_all);
    const std::string path = "PATH=" + (folder / "bin").string() + ":/usr/bin:/bin";
    const auto hidden = [&] {
        return std::count_if(fs::directory_iterator(folder / "out"), {},
                             [](const auto& entry) { return entry.path().filename().string().starts_with("."); });
    };
    RunOptions killed{.environment = {path}};
    killed.watch = [](pid_t child, const std::string& err) {
        if (err.find("frame 1 written") != std::string::npos) kill(child, SIGKILL);
    };
    const Strings movie = {"--movie", folder / "out" / "m.mp4"};
    EXPECT_EQ(run("out", "1-100000", movie, killed).status, 128 + SIGKILL);
    EXPECT_GE(hidden(), 1);
    make("out", "1", {"--overwrite"});
    EXPECT_GE(hidden(), 1) << "of a file that this run does not write";
    EXPECT_EQ(run("out", "1", movie, {.environment = {path}}).status, 1) << "that ffmpeg writes nothing";
    EXPECT_EQ(hidden(), 0);
}

/// Three processes with the same frames make each frame once, and leave nothing but the frames.
TEST_F(Sequence, ProcessesShareTheFramesThatTheyAreGiven) {
    make("alone", "1-12");
    fs::create_directory(folder / "shared");
    std::vector<Outcome> outcomes(3);
    std::vector<std::thread> processes;
    for (std::size_t i = 0; i < outcomes.size(); ++i)
        processes.emplace_back([&, i] {
            outcomes[i] = run("shared", "1-12", {"--stats", folder / fmt::format("s{}.json", i)});
        });
    for (std::thread& process : processes) process.join();
    int made = 0;
    for (std::size_t i = 0; i < outcomes.size(); ++i) {
        EXPECT_EQ(outcomes[i].status, 0) << outcomes[i].err;
        const std::string lines = read_text(folder / fmt::format("s{}.json", i));
        made += static_cast<int>(std::ranges::count(lines, '\n'));
    }
    EXPECT_EQ(made, 12);
    EXPECT_TRUE(contents("shared") == contents("alone"));
    EXPECT_EQ(std::distance(fs::directory_iterator(folder / "shared"), {}), 12);
}

/// A file that another process writes while the sequence is made is not replaced, and the other frames are made.
TEST_F(Sequence, FilesThatAppearMeanwhileAreKept) {
    const fs::path other = folder / "a" / "f.0040.exr";
    RunOptions options;
    options.watch = [&](pid_t, const std::string& err) {
        if (!fs::exists(other) && err.find("frame 1 written") != std::string::npos)
            write_text(other, "a file of others");
    };
    const Outcome outcome = run("a", "1-40", {"--verbose"}, options);
    EXPECT_EQ(outcome.status, 1);
    EXPECT_NE(outcome.err.find("f.0040.exr: was written meanwhile, and is not this frame"), std::string::npos)
        << outcome.err;
    EXPECT_EQ(read_text(other), "a file of others");
    EXPECT_EQ(std::distance(fs::directory_iterator(folder / "a"), {}), 40);
}

/// A process that waits for a frame makes it when the other one is killed.
TEST_F(Sequence, FramesOfAKilledProcessAreMadeByOthers) {
    make("alone", "1");
    std::optional<std::thread> second;
    Outcome outcome;
    RunOptions killed;
    killed.watch = [&](pid_t child, const std::string& err) {
        if (second || err.find("16 x 16 pixels") == std::string::npos) return;
        second.emplace([&, child] {
            RunOptions waits;
            waits.watch = [&](pid_t, const std::string& text) {
                if (text.find("another process makes it") != std::string::npos) kill(child, SIGKILL);
            };
            outcome = run("out", "1", {}, waits);
        });
    };
    const Outcome first = run_for_hours(killed);
    ASSERT_TRUE(second) << first.err;
    second->join();
    EXPECT_EQ(first.status, 128 + SIGKILL);
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_TRUE(contents("out") == contents("alone"));
    EXPECT_EQ(std::distance(fs::directory_iterator(folder / "out"), {}), 1);
}

/// The empty file by which processes share frames goes with the last of them, also where all frames are there already.
TEST_F(Sequence, FilesOfKilledProcessesAreRemoved) {
    fs::create_directory(folder / "out");
    std::optional<std::thread> killer;
    fs::path left;
    RunOptions killed;
    killed.watch = [&](pid_t child, const std::string&) {
        if (killer) return;
        killer.emplace([&, child] {
            for (int i = 0; i < 6000 && left.empty(); ++i) {
                std::this_thread::sleep_for(std::chrono::milliseconds(10));
                for (const auto& entry : fs::directory_iterator(folder / "out"))
                    if (entry.path().filename().string().ends_with("-claims")) left = entry.path();
            }
            kill(child, SIGKILL);
        });
    };
    const Outcome first = run_for_hours(killed);
    ASSERT_TRUE(killer) << first.err;
    killer->join();
    EXPECT_EQ(first.status, 128 + SIGKILL);
    ASSERT_TRUE(fs::exists(left)) << first.err;
    for (const bool all_are_there : {false, true}) {
        if (all_are_there) std::ofstream(left).flush();
        const Outcome next = run("out", "1");
        EXPECT_EQ(next.status, 0) << next.err;
        EXPECT_EQ(next.err.find("are there already") != std::string::npos, all_are_there) << next.err;
        EXPECT_FALSE(fs::exists(left)) << all_are_there;
    }
}

}  // namespace
}  // namespace halflight::test
