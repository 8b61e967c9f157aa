// Tests failures of sequences, what they leave behind, and further inputs that decide whether frames are kept.
#include <signal.h>

#include <chrono>
#include <fstream>
#include <optional>
#include <regex>
#include <thread>

#include "tests/cli/sequence_test.h"

namespace halflight::test {
namespace {

TEST_F(Sequence, ABadFrameDoesNotStopOthers) {
    scene = write_scene_with_bad_frame(folder.path);
    const std::string stats = file("stats.json");
    const Outcome outcome = run("out", "1-5", words("--fps 1 --stats", stats));
    EXPECT_EQ(outcome.status, 1);
    expect_has(last_line(outcome), "f.####.exr: frame 3 (1 of 5) failed: ");
    EXPECT_EQ(contents("out").size(), 4u);
    EXPECT_FALSE(fs::exists(file("out", 3)));
    EXPECT_FALSE(same_pixels(file("out", 2), file("out", 4))) << "frame 4 shows what it should";
    const auto all = json_lines(read_text(stats));
    ASSERT_EQ(all.size(), 5u);
    EXPECT_EQ(all[2].at("frame"), 3);
    EXPECT_TRUE(all[2].contains("error"));
    EXPECT_EQ(all[3].at("time"), 4);
    EXPECT_EQ(all[3].at("outputs"), Strings{file("out", 4)});
    refused(1, command("out", "1-5", "--fps 1 --quiet"), "frame 3 (1 of 5) failed");
}

TEST_F(Sequence, FramesAfterABadOneKeepTheirEnvironment) {
    scene = write_blinking_scene(folder.path, {vec3(1), vec3(1, 0, 1), vec3(1)});
    const Strings more = words("--fps 1 --env 0.2,0.5,0.9 --node blinking=matrix:1,0,0,0,0,1,0,2,0,0,1,0");
    const Outcome outcome = run("out", "0-2", more);
    EXPECT_EQ(outcome.status, 1);
    expect_has(last_line(outcome), "frame 1 (1 of 3) failed: ");
    make("alone", "2", more);
    EXPECT_TRUE(same_pixels(file("out", 2), file("alone", 2)));
}

/// Environment variables of OpenColorIO choose the view if options leave it open.
TEST_F(Sequence, FramesDependOnTheViewThatIsFound) {
    const Strings picture =
        words("render", scene, file("v.#.png"), "--frames 1 --width 8 --height 8 --samples 1 --quiet");
    done(picture);
    done(picture);
    refused(1, picture, "v.1.png: ", {.environment = {"OCIO_ACTIVE_VIEWS=Raw"}});
}

TEST_F(Sequence, AFailedWriteConcernsItsFrameOnly) {
    fs::create_directories(file("out", 2));
    const Outcome outcome = run("out", "1-3");
    EXPECT_EQ(outcome.status, 1);
    expect_has(last_line(outcome), "frame 2 (1 of 3) failed: ");
    expect_has(last_line(outcome), "f.0002.exr");
    EXPECT_TRUE(fs::exists(file("out", 1)) && fs::exists(file("out", 3)));

    write_text(folder / "file", "");
    refused(1, words("render", scene, file("file/f.#.exr"), "--frames 1"), "file/f.#.exr: cannot write");
    make("none/deeper", "1");
    EXPECT_TRUE(fs::exists(file("none/deeper", 1)));
}

TEST_F(Sequence, AFullDiskEndsTheRunWithTheFirstFrame) {
    // Frames of 64 x 64 noisy pixels exceed the limit. The driver's shader cache must not reach it.
    fs::create_directory(folder / "out");
    refused(1,
            words("render", scene, file("out/f.%02d.exr"), "--frames 1-2 --width 64 --height 64 --samples 1 --quiet",
                  "--animation none --aov normal"),
            "f.01.exr: cannot write: File too large: stopped in frame 1, 0 of 2 frames are there",
            {.environment = {"MESA_SHADER_CACHE_DISABLE=true", "HALFLIGHT_SHADER_SOURCES"},
             .wrapper = {"prlimit", "--fsize=8192"}});
    EXPECT_TRUE(fs::is_empty(folder / "out")) << "something is left";
}

TEST_F(Sequence, StoppedBySignal) {
    bool sent = false;
    RunOptions options;
    options.watch = [&](pid_t child, const std::string& err) {
        if (!sent && has(err, "frame 2 written")) sent = kill(child, SIGTERM) == 0;
    };
    fs::create_directory(folder / "out");
    const Outcome outcome = run("out", "1-100000", {}, options);
    EXPECT_EQ(outcome.status, 128 + SIGTERM);
    const std::regex told(".*: interrupted in frame [0-9]+: [0-9]+ of 100000 frames are there");
    EXPECT_TRUE(std::regex_match(last_line(outcome), told)) << outcome.err;
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
    const Strings config = words("--ocio", write_config_with_table(folder.path, table), "--aov depth");
    const Strings png = words("-o", folder / "out" / "f.####.png");
    make("out", "1", words(config, png));
    make("out", "1", words(config, png, "--stats", file("s.json")));
    EXPECT_EQ(read_text(file("s.json")), "") << "statistics of no frame";
    write_config_with_table(folder.path, "LUT_1D_SIZE 2\n0 0 0\n1 1 0.5\n");
    EXPECT_EQ(run("out", "1", words(config, png)).status, 1) << "of another table";
    make("out", "1", config);
    EXPECT_EQ(read_text(file("s.json")), "") << "the .exr does not depend on it";
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
        if (has(err, "frame 1 written")) kill(child, SIGKILL);
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
            outcomes[i] = run("shared", "1-12", {"--stats", file(fmt::format("s{}.json", i))});
        });
    for (std::thread& process : processes) process.join();
    std::size_t made = 0;
    for (std::size_t i = 0; i < outcomes.size(); ++i) {
        EXPECT_EQ(outcomes[i].status, 0) << outcomes[i].err;
        made += json_lines(read_text(file(fmt::format("s{}.json", i)))).size();
    }
    EXPECT_EQ(made, 12u);
    EXPECT_TRUE(contents("shared") == contents("alone"));
    EXPECT_EQ(std::distance(fs::directory_iterator(folder / "shared"), {}), 12);
}

/// A file that another process writes while the sequence is made is not replaced, and the other frames are made.
TEST_F(Sequence, FilesThatAppearMeanwhileAreKept) {
    const fs::path other = folder / "a" / "f.0040.exr";
    RunOptions options;
    options.watch = [&](pid_t, const std::string& err) {
        if (!fs::exists(other) && has(err, "frame 1 written")) write_text(other, "a file of others");
    };
    const Outcome outcome = run("a", "1-40", {"--verbose"}, options);
    EXPECT_EQ(outcome.status, 1);
    EXPECT_NE(outcome.err.find("f.0040.exr: was written meanwhile"), std::string::npos) << outcome.err;
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
        if (second || !has(err, "16 x 16 pixels")) return;
        second.emplace([&, child] {
            RunOptions waits;
            waits.watch = [&](pid_t, const std::string& text) {
                if (has(text, "another process makes it")) kill(child, SIGKILL);
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

/// The empty file by which processes share frames goes with the last of them, also if all frames are there already.
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
        EXPECT_EQ(has(next.err, "are there already"), all_are_there) << next.err;
        EXPECT_FALSE(fs::exists(left)) << all_are_there;
    }
}

}  // namespace
}  // namespace halflight::test
