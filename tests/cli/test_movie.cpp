// Tests movies: the input of ffmpeg, and the resulting file.
#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <thread>

#include "engine/io/png.h"
#include "tests/cli/animated_scenes.h"
#include "tests/cli/command_test.h"

namespace halflight::test {
namespace {

namespace fs = std::filesystem;

class MovieTest : public CommandTest {
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
    Strings command(const Strings& more) const {
        return with_defaults(words("render", scene, "--samples 1", more),
                             fmt::format("--width {} --height {}", kWidth, kHeight).c_str());
    }
    Outcome render(const Strings& more) const { return done(command(more), on_path()); }
    RunOptions on_path() const { return {.environment = {"PATH=" + path}}; }
    std::string out(const std::string& name) const { return file("out/" + name); }
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

    const fs::path out_folder = (fs::create_directory(folder / "out"), folder / "out");
    std::string scene = write_animated_scene(folder.path);
    std::string path = folder.path.string();  // this folder has no ffmpeg
};

TEST_F(MovieTest, ReceivesAllFramesInOrder) {
    install_recorder();
    render(words(out("f.#.png"), "--movie", out("m.mp4"), "--frames 3,1-2 --fps 29.97"));
    EXPECT_EQ(files(), (Strings{"f.1.png", "f.2.png", "f.3.png", "m.mp4"}));
    EXPECT_EQ(read_text(out("m.mp4")), std::string("\0\0\0\10moov\0\0\0\11mdat-", 17));
    const std::string input = read_text(folder / "input"), arguments = read_text(folder / "arguments");
    EXPECT_EQ(input, expected_input({3, 1, 2}));
    for (const char* pair : {"-video_size\n18x16\n", "-framerate\n30000/1001\n", "-pixel_format\nrgb24\n",
                             "-c:v\nlibx264\n", "-pix_fmt\nyuv420p\n", "-f\nmp4\n"})
        expect_has(arguments, pair);

    // The movie is the same without .exr files. The name of the second movie selects ProRes.
    fs::remove(folder / "input");
    render(words("--movie", out("m.MOV"), "--frames 3,1-2 --fps 29.97"));
    EXPECT_EQ(read_text(folder / "input"), input);
    expect_has(read_text(folder / "arguments"), "-c:v\nprores_ks\n");
    EXPECT_EQ(files().size(), 5u) << "something is left";
}

TEST_F(MovieTest, ResumedMoviesAreEqual) {
    install_recorder();
    const Strings arguments = words(out("f.#.exr"), out("f.#.png"), "--movie", out("m.mp4"), "--frames 1-4");
    render(arguments);
    const std::string input = read_text(folder / "input");
    fs::remove(out("f.2.png"));
    fs::remove(out("f.3.exr"));
    expect_has(render(arguments).err, "2 of 4 frames are there already");
    EXPECT_EQ(read_text(folder / "input"), input);
    // All frames exist but the movie is missing, so it is made of the .png files without rendering.
    fs::remove(out("m.mp4"));
    fs::remove(folder / "input");
    const Outcome of_files = render(arguments);
    expect_has(of_files.err, "4 of 4 frames are there already");
    EXPECT_FALSE(has(of_files.err, "pixels, camera")) << of_files.err;
    EXPECT_EQ(read_text(folder / "input"), input);
    // An .exr contains the picture before the view transform, so that frames need not be rendered again.
    expect_has(render(words(out("f.#.exr"), "--movie", out("m.mp4"), "--frames 1-4")).err, "4 frames are developed");
    EXPECT_EQ(read_text(folder / "input"), input);
}

TEST_F(MovieTest, WithoutFfmpegNothingIsRendered) {
    refused(1, command(words(out("f.#.exr"), "--movie", out("m.mp4"), "--frames 1-2 --quiet")),
            "m.mp4: cannot be made: ffmpeg: ", on_path());
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
            if (sent || !has(err, std::string(size) == "16" ? "frame 2 written" : "pixels, camera")) return;
            for (int i = 0; i < 600 && !fs::exists(reads); ++i)
                std::this_thread::sleep_for(std::chrono::milliseconds(100));
            EXPECT_TRUE(fs::exists(reads)) << size;
            std::this_thread::sleep_for(std::chrono::milliseconds(500));
            sent = kill(child, SIGTERM) == 0;
        };
        const Outcome outcome =
            run_program(command(words(out("f.#.exr"), "--movie", out("m.mp4"), "--frames 1-2 --exposure 0 --overwrite",
                                      "--width", size, "--height", size)),
                        options);
        EXPECT_EQ(outcome.status, 128 + SIGTERM) << outcome.err;
        EXPECT_EQ(std::ranges::count_if(files(), [](const std::string& f) { return has(f, "mp4"); }), 0);
    }
}

TEST_F(MovieTest, ParentsMayIgnoreTheEndOfChildren) {
    install_recorder();
    RunOptions ignoring = on_path();
    ignoring.wrapper = {"sh", "-c", "trap '' CHLD; exec \"$@\"", "sh"};
    done(command(words("--movie", out("m.mp4"), "--frames 1 --width 8 --height 8")), ignoring);
    EXPECT_TRUE(fs::exists(out("m.mp4")));
}

TEST_F(MovieTest, ErrorsOfFfmpegAreReported) {
    const auto expect = [&](const std::string& script, const std::string& message) {
        install(script);
        write_text(out("m.mp4"), "the last one");
        refused(1, command(words(out("f.#.exr"), "--movie", out("m.mp4"), "--frames 1-2 --quiet")),
                "m.mp4: not written: ffmpeg: " + message, on_path());
        EXPECT_EQ(files(), words("f.1.exr f.2.exr m.mp4")) << "frames are there, whatever it says";
        EXPECT_EQ(read_text(out("m.mp4")), "the last one");
    };
    expect("cat > /dev/null; echo 'first' >&2; echo \"Unknown encoder 'libx264'\" >&2; exit 1",
           "Unknown encoder 'libx264'");
    expect("exit 3", "exit status 3");
    expect("kill -9 $$", "was ended by signal 9");
    expect("cat > /dev/null", "wrote nothing");
    const std::string cut = kBoxes.substr(0, kBoxes.size() - 1), no_index = kBoxes.substr(kBoxes.size() / 2 - 2);
    for (const std::string& boxes : {cut, no_index, std::string("movie")})
        expect("cat > /dev/null; for file; do :; done; printf '" + boxes + "' > \"${file#file:}\"",
               "wrote a part only");
}

TEST_F(MovieTest, HasNoGaps) {
    install_recorder();
    scene = write_scene_with_bad_frame(folder.path);
    for (const char* name : {"arguments", "input"}) write_text(folder / name, "");  // files of the recorder
    const Strings movie = words("--movie", out("m.mp4"), "--frames 1-5 --fps 1 --quiet");
    refused(1, command(words(out("f.#.exr"), movie)), "f.#.exr: frame 3 (1 of 5) failed", on_path());
    EXPECT_EQ(files(), words("f.1.exr f.2.exr f.4.exr f.5.exr"));
    refused(1, command(movie), "m.mp4: frame 3 (1 of 5) failed", on_path());
    EXPECT_EQ(files().size(), 4u) << "something is left";
}

TEST_F(MovieTest, MadeByTheRealFfmpeg) {
    path = std::getenv("PATH");
    if (run({"sh", "-c", "command -v ffmpeg"}).status != 0) GTEST_SKIP() << "there is no ffmpeg";
    for (const char* name : {"m.mp4", "m.mov"}) {
        render(words(out("f.#.png"), "--movie", out(name), "--frames 1-3"));
        const std::string expected = expected_input({1, 2, 3});
        const std::string found = run(words("ffmpeg -loglevel error -i", out(name), "-vf scale=in_color_matrix=bt709",
                                            "-f rawvideo -pix_fmt rgb24 -"))
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
