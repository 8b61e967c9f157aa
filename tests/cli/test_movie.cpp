// Tests movies: the input of ffmpeg, and the resulting file.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <regex>
#include <string_view>
#include <thread>

#include "engine/io/png.h"
#include "tests/cli/animated_scenes.h"
#include "tests/support/process.h"

namespace halflight::test {
namespace {

namespace fs = std::filesystem;
using Strings = std::vector<std::string>;

class MovieTest : public testing::Test {
  protected:
    static constexpr int kWidth = 17, kHeight = 15;  // a movie of 18 x 16

    /// Puts a folder with a program named ffmpeg first in PATH.
    void install(const std::string& script) {
        fs::create_directories(folder / "bin");
        write_text(folder / "bin" / "ffmpeg", "#!/bin/sh\n" + script);
        fs::permissions(folder / "bin" / "ffmpeg", fs::perms::owner_all);
        path = (folder / "bin").string() + ":/usr/bin:/bin";
    }
    /// Installs a program that stores its arguments and its input, and writes a file in place of the movie.
    void install_recorder() {
        install("printf '%s\\n' \"$@\" > '" + (folder / "arguments").string() + "'\ncat > '" +
                (folder / "input").string() + "'\nfor file; do :; done\nprintf '" + kBoxes + "' > \"${file#file:}\"\n");
    }
    static inline const std::string kBoxes = "\\000\\000\\000\\010moov\\000\\000\\000\\011mdat-";  // for printf
    Outcome run(const Strings& more) {
        Strings arguments = {"render",    scene, "--width", std::to_string(kWidth), "--height", std::to_string(kHeight),
                             "--samples", "1"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        return run_program(arguments, {.environment = {"PATH=" + path}});
    }
    std::string out(const std::string& name) const { return (folder / "out" / name).string(); }
    Strings files() const {
        Strings names;
        for (const auto& entry : fs::directory_iterator(folder / "out")) names.push_back(entry.path().filename());
        std::ranges::sort(names);
        return names;
    }
    /// Returns the recorder's expected input, from the .png files of frames.
    std::string expected_input(const std::vector<int>& frames) const {
        std::string bytes;
        for (const int frame : frames) {
            const std::string name = out(fmt::format("f.{}.png", frame));
            const Image png = read_png(name, read_text(name), 100);
            for (int y = 0; y < kHeight + 1; ++y)
                for (int x = 0; x < kWidth + 1; ++x)
                    for (int c = 0; c < 3; ++c)
                        bytes += static_cast<char>(
                            quantize_8bit(png.at(std::min(x, kWidth - 1), std::min(y, kHeight - 1))[c]));
        }
        return bytes;
    }

    TemporaryFolder folder;
    const fs::path out_folder = (fs::create_directory(folder / "out"), folder / "out");
    std::string scene = write_animated_scene(folder.path);
    std::string path = folder.path.string();  // this folder has no ffmpeg
};

TEST_F(MovieTest, ReceivesAllFramesInOrder) {
    install_recorder();
    const Outcome beside = run({out("f.#.png"), "--movie", out("m.mp4"), "--frames", "3,1-2", "--fps", "29.97"});
    ASSERT_EQ(beside.status, 0) << beside.err;
    EXPECT_EQ(files(), (Strings{"f.1.png", "f.2.png", "f.3.png", "m.mp4"}));
    EXPECT_EQ(read_text(out("m.mp4")), std::string("\0\0\0\10moov\0\0\0\11mdat-", 17));
    const std::string input = read_text(folder / "input"), arguments = read_text(folder / "arguments");
    EXPECT_EQ(input, expected_input({3, 1, 2}));
    for (const char* pair : {"-video_size\n18x16\n", "-framerate\n30000/1001\n", "-pixel_format\nrgb24\n",
                             "-c:v\nlibx264\n", "-pix_fmt\nyuv420p\n", "-f\nmp4\n"})
        EXPECT_NE(arguments.find(pair), std::string::npos) << pair << arguments;

    // The movie is the same without .exr files. The name of the second movie selects ProRes.
    fs::remove(folder / "input");
    const Outcome alone = run({"--movie", out("m.MOV"), "--frames", "3,1-2", "--fps", "29.97"});
    ASSERT_EQ(alone.status, 0) << alone.err;
    EXPECT_EQ(read_text(folder / "input"), input);
    EXPECT_NE(read_text(folder / "arguments").find("-c:v\nprores_ks\n"), std::string::npos);
    EXPECT_EQ(files().size(), 5u) << "something is left";
}

TEST_F(MovieTest, ResumedMoviesAreEqual) {
    install_recorder();
    const Strings arguments = {out("f.#.exr"), out("f.#.png"), "--movie", out("m.mp4"), "--frames", "1-4"};
    ASSERT_EQ(run(arguments).status, 0);
    const std::string input = read_text(folder / "input");
    fs::remove(out("f.2.png"));
    fs::remove(out("f.3.exr"));
    const Outcome resumed = run(arguments);
    ASSERT_EQ(resumed.status, 0) << resumed.err;
    EXPECT_NE(resumed.err.find("2 of 4 frames are there already"), std::string::npos) << resumed.err;
    EXPECT_EQ(read_text(folder / "input"), input);
    // All frames exist but the movie is missing, so it is made of the .png files without rendering.
    fs::remove(out("m.mp4"));
    fs::remove(folder / "input");
    const Outcome of_files = run(arguments);
    ASSERT_EQ(of_files.status, 0) << of_files.err;
    EXPECT_NE(of_files.err.find("4 of 4 frames are there already"), std::string::npos) << of_files.err;
    EXPECT_EQ(of_files.err.find("pixels, camera"), std::string::npos) << of_files.err;
    EXPECT_EQ(read_text(folder / "input"), input);
    // An .exr file does not contain the picture after the view transform.
    const Outcome again = run({out("f.#.exr"), "--movie", out("m.mp4"), "--frames", "1-4"});
    ASSERT_EQ(again.status, 0) << again.err;
    EXPECT_NE(again.err.find("4 frames are there, but not as .png for the movie"), std::string::npos) << again.err;
    EXPECT_EQ(read_text(folder / "input"), input);
}

TEST_F(MovieTest, WithoutFfmpegNothingIsRendered) {
    const Outcome outcome = run({out("f.#.exr"), "--movie", out("m.mp4"), "--frames", "1-2", "--quiet"});
    EXPECT_EQ(outcome.status, 1);
    EXPECT_TRUE(std::regex_match(outcome.err,
                                 std::regex("halflight: .*m.mp4: cannot be made: ffmpeg: is no program in PATH\n")))
        << outcome.err;
    EXPECT_EQ(files(), Strings{});
}

TEST_F(MovieTest, OneSignalEndsTheWaitForFfmpeg) {
    const fs::path reads = folder / "reads";
    install("dd bs=1 count=1 of=/dev/null 2>/dev/null\n: > '" + reads.string() + "'\nexec sleep 1000\n");
    // Small frames fit into the pipe, and the last wait is for the end of ffmpeg. Large ones wait for room in it.
    for (const char* size : {"16", "600"}) {
        bool sent = false;
        fs::remove(reads);
        RunOptions options{.environment = {"PATH=" + path}, .most_seconds = 100};
        options.watch = [&](pid_t child, const std::string& err) {
            const char* const shown = size == std::string_view("16") ? "frame 2 written" : "pixels, camera";
            if (sent || err.find(shown) == std::string::npos) return;
            for (int i = 0; i < 600 && !fs::exists(reads); ++i)
                std::this_thread::sleep_for(std::chrono::milliseconds(100));
            EXPECT_TRUE(fs::exists(reads)) << size;
            std::this_thread::sleep_for(std::chrono::seconds(1));
            sent = kill(child, SIGTERM) == 0;
        };
        const Outcome outcome =
            run_program({"render", scene, out("f.#.exr"), "--movie", out("m.mp4"), "--frames", "1-2", "--width", size,
                         "--height", size, "--samples", "1", "--exposure", "0", "--overwrite"},
                        options);
        EXPECT_EQ(outcome.status, 128 + SIGTERM) << outcome.err;
        EXPECT_EQ(std::ranges::count_if(files(), [](const std::string& f) { return f.find("mp4") != f.npos; }), 0);
    }
}

TEST_F(MovieTest, ParentsMayIgnoreTheEndOfChildren) {
    install_recorder();
    const Outcome outcome = run_program(
        {"render", scene, "--movie", out("m.mp4"), "--frames", "1", "--width", "8", "--height", "8", "--samples", "1"},
        {.environment = {"PATH=" + path}, .wrapper = {"sh", "-c", "trap '' CHLD; exec \"$@\"", "sh"}});
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_TRUE(fs::exists(out("m.mp4")));
}

TEST_F(MovieTest, ErrorsOfFfmpegAreReported) {
    const auto expect = [&](const std::string& script, const std::string& message) {
        install(script);
        write_text(out("m.mp4"), "the last one");
        const Outcome outcome = run({out("f.#.exr"), "--movie", out("m.mp4"), "--frames", "1-2", "--quiet"});
        EXPECT_EQ(outcome.status, 1);
        EXPECT_TRUE(std::regex_match(outcome.err, std::regex("halflight: .*m.mp4: not written: ffmpeg: " + message)))
            << outcome.err;
        EXPECT_EQ(files(), (Strings{"f.1.exr", "f.2.exr", "m.mp4"})) << "frames are there, whatever it says";
        EXPECT_EQ(read_text(out("m.mp4")), "the last one");
    };
    expect("cat > /dev/null; echo 'first' >&2; echo \"Unknown encoder 'libx264'\" >&2; exit 1",
           "Unknown encoder 'libx264'\n");
    expect("exit 3", "exit status 3\n");
    expect("kill -9 $$", "was ended by signal 9\n");
    expect("cat > /dev/null", "wrote nothing\n");
    const std::string cut = kBoxes.substr(0, kBoxes.size() - 1), no_index = kBoxes.substr(kBoxes.size() / 2 - 2);
    for (const std::string& boxes : {cut, no_index, std::string("movie")})
        expect("cat > /dev/null; for file; do :; done; printf '" + boxes + "' > \"${file#file:}\"",
               "wrote a part only; the disk may be full\n");
}

TEST_F(MovieTest, HasNoGaps) {
    install_recorder();
    scene = write_scene_with_bad_frame(folder.path);
    const Outcome beside = run({out("f.#.exr"), "--movie", out("m.mp4"), "--frames", "1-5", "--fps", "1", "--quiet"});
    EXPECT_EQ(beside.status, 1);
    EXPECT_TRUE(std::regex_match(
        beside.err,
        std::regex("halflight: .*f.#.exr: frame 3 \\(1 of 5\\) failed, and there is no movie: .*overflows\n")))
        << beside.err;
    EXPECT_EQ(files(), (Strings{"f.1.exr", "f.2.exr", "f.4.exr", "f.5.exr"}));

    const Outcome alone = run({"--movie", out("m.mp4"), "--frames", "1-5", "--fps", "1", "--quiet"});
    EXPECT_EQ(alone.status, 1);
    EXPECT_TRUE(
        std::regex_match(alone.err, std::regex("halflight: .*m.mp4: frame 3 \\(1 of 5\\) failed: .*overflows\n")))
        << alone.err;
    EXPECT_EQ(files().size(), 4u) << "something is left";
}

TEST_F(MovieTest, InvalidOptions) {
    const auto refused = [&](const Strings& more, const std::string& message) {
        const Outcome outcome = run(more);
        EXPECT_EQ(outcome.status, 2) << message;
        EXPECT_TRUE(std::regex_match(outcome.err, std::regex("halflight: " + message + "\n"))) << outcome.err;
    };
    refused({"--movie", out("m.mp4")}, "--movie: needs --frames");
    refused({"--movie", out("m.avi"), "--frames", "1"}, ".*m.avi: expects an .mp4 or a .mov");
    refused({"--movie", out("m.#.mp4"), "--frames", "1"}, ".*: has a placeholder for frame numbers, .*one file");
    refused({"--movie", out("m.mp4"), "--frames", "1-9", "--part", "1/2"}, "--movie: cannot .* together with --part");
    refused({"--movie", out("m.mp4"), "--frames", "1-9", "--check"}, "--movie: cannot be given together with --check");
    refused({"--frames", "1-9"}, "OUTPUT: is missing; see halflight render --help");
    refused({"--movie", out("m.mp4"), "--frames", "1", "--aov", "depth"}, "--aov: needs an .exr output");
}

TEST_F(MovieTest, MadeByTheRealFfmpeg) {
    path = std::getenv("PATH");
    if (halflight::test::run({"sh", "-c", "command -v ffmpeg"}).status != 0) GTEST_SKIP() << "there is no ffmpeg";
    for (const char* name : {"m.mp4", "m.mov"}) {
        const Outcome outcome = run({out("f.#.png"), "--movie", out(name), "--frames", "1-3"});
        ASSERT_EQ(outcome.status, 0) << outcome.err;
        const std::string expected = expected_input({1, 2, 3});
        const std::string found =
            halflight::test::run({"ffmpeg", "-loglevel", "error", "-i", out(name), "-vf", "scale=in_color_matrix=bt709",
                                  "-f", "rawvideo", "-pix_fmt", "rgb24", "-"})
                .out;
        ASSERT_EQ(found.size(), expected.size()) << name;
        double difference = 0;
        for (std::size_t i = 0; i < found.size(); ++i)
            difference += std::abs(static_cast<unsigned char>(found[i]) - static_cast<unsigned char>(expected[i]));
        EXPECT_LT(difference / static_cast<double>(found.size()), 12) << name << ": means of 8-bit noise, coded";
    }
}

}  // namespace
}  // namespace halflight::test
