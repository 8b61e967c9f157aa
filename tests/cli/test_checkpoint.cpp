// Tests checkpoints of single pictures and of frames: halflight render --checkpoint.
#include <fmt/format.h>

#include <chrono>
#include <csignal>
#include <optional>
#include <thread>

#include "tests/cli/output_test.h"

namespace halflight::test {
namespace {

class CheckpointOption : public Output {
  protected:
    /// Returns arguments of 60 samples that are saved all the time.
    Strings arguments(const std::string& output, const char* more = "") const {
        return words("render", scene, output, "--width 48 --height 48 --samples 60 --denoise --aov variance,noisy",
                     "--checkpoint 0.02", more);
    }
    /// Runs the program and ends it by a signal, and by another one 5 ms later, once the checkpoint has a file.
    Outcome stop(const Strings& command, int signal, std::optional<int> another = {}) const {
        bool sent = false;
        RunOptions options;
        options.terminal = true;  // the progress bar gives something to watch
        options.watch = [&](pid_t child, const std::string&) {
            if (sent || !std::filesystem::exists(saved)) return;
            sent = kill(child, signal) == 0;
            if (!another) return;
            std::this_thread::sleep_for(std::chrono::milliseconds(5));
            kill(child, *another);
        };
        Outcome stopped = run_program(command, options);
        EXPECT_EQ(stopped.status, 128 + signal) << stopped.err;
        EXPECT_EQ(has(stopped.err, "goes on from its checkpoint"), signal != SIGKILL) << stopped.err;
        return stopped;
    }

    const std::filesystem::path checkpoint = file("a.exr.checkpoint");
    const std::filesystem::path saved = checkpoint / "rows-00000.sums";
};

TEST_F(CheckpointOption, InterruptedPicturesGoOnToTheSameBits) {
    done(arguments(file("whole.exr")));
    EXPECT_FALSE(std::filesystem::exists(file("whole.exr.checkpoint")));
    for (const int signal : {SIGTERM, SIGKILL, SIGINT, SIGXCPU}) {  // SIGXCPU: the limit of CPU seconds
        stop(arguments(file("a.exr")), signal);
        EXPECT_FALSE(std::filesystem::exists(file("a.exr")));
        EXPECT_TRUE(std::filesystem::exists(saved));
    }
    expect_has(done(arguments(file("a.exr"))).err, "goes on after");
    EXPECT_TRUE(same_pixels(file("whole.exr"), file("a.exr")));
    EXPECT_FALSE(std::filesystem::exists(checkpoint));
}

// Frame 0 is a neighbour that the denoiser renders, and no frame of the sequence.
TEST_F(CheckpointOption, InterruptedFramesGoOnToTheSameBits) {
    const auto frames = [&](const std::string& output) {
        return words("render", scene, output, "--width 48 --height 48 --samples 40 --denoise --denoise-frames 1",
                     "--turntable 8 --frames 1-2 --shutter 0.5 --checkpoint 0.02");
    };
    done(frames(file("whole.#.exr")));
    for (const char* name : {"f.1.exr", "f.2.exr", "f.2.exr"}) {
        const std::filesystem::path own = file(std::string(name) + ".checkpoint");
        bool sent = false;
        RunOptions options;
        options.watch = [&](pid_t child, const std::string&) {
            if (!sent && std::filesystem::exists(own / "rows-00000.sums")) sent = kill(child, SIGTERM) == 0;
        };
        options.terminal = true;
        EXPECT_EQ(run_program(frames(file("f.#.exr")), options).status, 128 + SIGTERM) << name;
        EXPECT_TRUE(std::filesystem::exists(own)) << name;
    }
    done(frames(file("f.#.exr")));
    for (const char* number : {"1", "2"})
        EXPECT_TRUE(same_pixels(file(fmt::format("whole.{}.exr", number)), file(fmt::format("f.{}.exr", number))));
    for (const auto& entry : std::filesystem::directory_iterator(file(".")))
        EXPECT_NE(entry.path().extension(), ".checkpoint") << entry.path();
}

TEST_F(CheckpointOption, TwoSignalsAtOnceAreOneRequest) {
    stop(arguments(file("a.exr")), SIGTERM, SIGHUP);  // timeout(1) sends its signal twice
}

TEST_F(CheckpointOption, NoSamplesAreNoCheckpoint) {
    bool sent = false;
    RunOptions options;
    options.watch = [&](pid_t child, const std::string& err) {
        if (!sent && has(err, "compiling shaders")) sent = kill(child, SIGTERM) == 0;
    };
    const Outcome stopped = run_program(arguments(file("a.exr"), "--no-shader-cache --quiet --progress json"), options);
    EXPECT_EQ(stopped.status, 128 + SIGTERM) << stopped.err;
    expect_has(stopped.err, "a.exr: not written: interrupted after 0 samples");
    EXPECT_FALSE(std::filesystem::exists(checkpoint));
}

TEST_F(CheckpointOption, MergedPartsMayHaveOtherOutputsAndColour) {
    const Strings size = words(scene, "--width 16 --height 16 --samples 4");
    for (const char* part : {"1/2", "2/2"}) done(words("render", file("a.exr"), size, "--part", part));
    const Strings merge = words("merge", file("m.png"), file("a.exr"), size, "--sample-parts 2 --exposure 1");
    done(merge);
    done(words("render", file("whole.exr"), size, "--sample-parts 2"));
    EXPECT_TRUE(same_pixels(file("whole.exr"), file("a.exr")));
    refused(1, words(merge, "--bounces 1 --quiet"), file("a.exr.parts/1-of-2") + ": is of another picture: bounces");
    EXPECT_TRUE(std::filesystem::exists(file("a.exr.parts/1-of-2/rows-00000.sums")));
}

TEST_F(CheckpointOption, OtherPicturesAreRefused) {
    stop(arguments(file("a.exr")), SIGTERM);
    refused(1, arguments(file("a.exr"), "--seed 3"),
            checkpoint.string() + ": is of another picture: seed is as usual, not 3 (");
    EXPECT_TRUE(std::filesystem::exists(saved));
    EXPECT_FALSE(has(done(arguments(file("a.exr"), "--seed 3 --overwrite")).err, "goes on after"));
    done(arguments(file("b.exr"), "--seed 3"));
    EXPECT_TRUE(same_pixels(file("a.exr"), file("b.exr")));
}

TEST_F(CheckpointOption, FullDisksEndNoPicture) {
    // The sums of a band take 700 kB, the picture 60 kB.
    const RunOptions limited{.environment = {"HALFLIGHT_SHADER_SOURCES"}, .wrapper = {"prlimit", "--fsize=300000"}};
    expect_has(done(arguments(file("a.exr")), limited).err, "warning: checkpoint not saved: " + saved.string());
    EXPECT_TRUE(std::filesystem::exists(file("a.exr")));
    EXPECT_FALSE(std::filesystem::exists(checkpoint));
    const Outcome part = run_program(arguments(file("p.exr"), "--part 1/2 --quiet"), limited);
    EXPECT_EQ(part.status, 1);
    EXPECT_TRUE(part.err.starts_with("halflight: " + file("p.exr.parts/1-of-2/rows-00000.sums") + ": cannot write"))
        << part.err;
}

}  // namespace
}  // namespace halflight::test
