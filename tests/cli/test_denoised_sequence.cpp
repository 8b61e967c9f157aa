// Tests preview modes of pictures and sequences, and denoised sequences: files name what is biased, frames take light
// from their neighbours, and they are reproducible.
#include <thread>

#include "engine/io/temporary_name.h"
#include "tests/cli/sequence_test.h"

namespace halflight::test {
namespace {

using DenoisedSequence = Sequence;

const char* const kMoving = "--animation all --camera moving";
const char* const kDenoised = "--animation all --camera moving --denoise";

TEST_F(DenoisedSequence, FramesDoNotDependOnTheRun) {
    const Strings all = words(kDenoised, "--aov noisy,denoiser,motion,ids");
    make("whole", "0-6", all);
    const auto whole = contents("whole");
    ASSERT_EQ(whole.size(), 7u);
    for (const char* chunk : {"0-2", "3-4", "5-6"}) make("chunks", chunk, all);
    EXPECT_TRUE(contents("chunks") == whole) << "in chunks";
    for (const char* part : {"2/3", "1/3", "3/3"}) make("parts", "0-6", words(all, "--part", part));
    EXPECT_TRUE(contents("parts") == whole) << "in parts";
    make("backwards", "6,5,4,3,2,1,0", all);
    EXPECT_TRUE(contents("backwards") == whole) << "backwards";
    for (const int frame : {1, 2, 4, 6}) fs::remove(file("parts", frame));
    make("parts", "0-6", all);
    EXPECT_TRUE(contents("parts") == whole) << "resumed";
    make("small", "0-6", words(all, "--memory 300M"));
    EXPECT_TRUE(contents("small") == whole) << "in smaller bands";
}

TEST_F(DenoisedSequence, NeighboursAreNamedAndChangeTheFrame) {
    const std::string err = make("two", "3-5", words(kDenoised, "--aov noisy --stats", file("stats.json"))).err;
    const std::string bias = bias_of(file("two", 4));
    expect_has(bias, "4 neighbouring frames");
    expect_has(err, "biased: " + bias);
    const auto stats = json_lines(read_text(file("stats.json")));
    ASSERT_EQ(stats.size(), 3u);
    EXPECT_EQ(stats[0]["settings"]["denoise_frames"], 2);
    EXPECT_EQ(stats[0]["denoise_neighbours"]["frames"], 4);
    EXPECT_EQ(stats[0]["denoise_neighbours"]["rendered_frames"], 5);
    EXPECT_EQ(stats[1]["denoise_neighbours"]["rendered_frames"], 1) << "the others are held";
    EXPECT_GT(stats[1]["denoise_neighbours"]["seconds"], 0);
    expect_has(make("judged", "3-5", words(kDenoised, "--denoise-error 2")).err, "denoised picture: estimated relmse");
    for (const int frame : {3, 4, 5})
        EXPECT_TRUE(same_values(*read_exr(file("judged", frame)).find("R"), *read_exr(file("two", frame)).find("R")))
            << frame;

    make("none", "3-5", words(kDenoised, "--aov noisy --denoise-frames 0"));
    EXPECT_FALSE(has(bias_of(file("none", 4)), "neighbouring"));
    make("noisy", "4", words(kMoving));
    const ExrFile two = read_exr(file("two", 4)), none = read_exr(file("none", 4)), noisy = read_exr(file("noisy", 4));
    EXPECT_FALSE(same_values(*two.find("R"), *none.find("R")));
    for (const char* channel : {"R", "G", "B"})
        EXPECT_TRUE(same_values(*two.find(std::string("noisy.") + channel), *noisy.find(channel)));

    // A single picture of an animated scene can be the frame of a sequence, too.
    done(words("render", scene, file("alone.exr"), "--frame 4 --width 16 --height 16 --samples 2 --denoise-frames 2",
               kDenoised, "--aov noisy"));
    EXPECT_TRUE(same_pixels(file("alone.exr"), file("two", 4)));
}

// The lamp fades by a 24th of its light in a frame, and before frame 0 not at all.
TEST_F(DenoisedSequence, FramesThatAreLitOtherwiseAreNoNeighbours) {
    scene = write_fading_scene(folder.path, 30, 0);
    make("fading", "0,3", words("--denoise --frame-offset 2"));
    expect_has(bias_of(file("fading", 0)), "also over 4 neighbouring frames");
    EXPECT_FALSE(has(bias_of(file("fading", 3)), "neighbouring"));
}

TEST_F(DenoisedSequence, WhatDoesNotFitIsRefused) {
    refused(1,
            words("render", scene, file("f.#.exr"), "--frames 1 --width 1024 --height 1024 --samples 2 --denoise",
                  "--memory 1G --quiet"),
            "picture with 2 frames before and after");
}

TEST_F(DenoisedSequence, OutputsDoNotReplaceNoisyFrames) {
    for (const char* name : {"a.noisy.exr", "a.near.exr"})
        refused(1, words("render", scene, file(name), "--width 16 --height 16 --samples 1 --quiet"), name);
    refused(1, words("render", scene, file("a.#.noisy.exr"), "--frames 1 --samples 1 --quiet"), "a.#.noisy.exr");
}

TEST_F(DenoisedSequence, AFrameThatCannotBePosedFailsAlone) {
    scene = write_scene_with_bad_frame(folder.path);
    const Outcome outcome = run("bad", "0-6", words("--denoise --denoise-frames 1 --fps 1"));
    EXPECT_EQ(outcome.status, 1);
    expect_has(outcome.err, "frame 3 (1 of 7) failed");
    EXPECT_EQ(contents("bad").size(), 6u);
}

/// Noisy frames of parts, each rendered once, are denoised to the files of the direct way.
TEST_F(DenoisedSequence, NoisyFramesAreDenoisedToTheSameFiles) {
    const Strings more = words(kMoving, "--aov noisy,denoiser,motion,ids --light-group each --shutter 0.5"),
                  view = words("--exposure 1 --working-space acescg");
    const auto to = [&](const std::string& into) {
        return words("-o", folder / into / "f.####.exr", "-o", folder / into / "f.####.png", "--reproducible", view);
    };
    const Strings direct = words(command("direct", "3-5", more), "--denoise -o", folder / "direct/f.####.png", view);
    done(direct);
    for (const char* part : {"2/2", "1/2"}) make("noisy", "3-5", words(more, "--keep-noisy --part", part));
    EXPECT_EQ(contents("noisy").size(), 3u + 7u) << "frames, and noisy ones with two neighbours at either end";
    expect_has(make("noisy", "3-5", words(more, "--keep-noisy")).err, "3 of 3 frames are there already");

    const Strings denoise = words("denoise --frames 3-5", folder / "noisy/f.####.noisy.exr");
    done(words(denoise, to("later")));
    EXPECT_TRUE(contents("later") == contents("direct"));
    expect_has(done(words(denoise, to("later"))).err, "3 of 3 frames are there already");
    expect_has(done(words(command("later", "3-5", more), "--denoise -o", folder / "later/f.####.png", view)).err,
               "3 of 3 frames are there already");
    refused(1, words(denoise, to("later"), "--quiet --denoise-frames 1"),
            "f.0003.exr: exists, but is not this denoised");
    make("one", "4", words(more, "--denoise --denoise-frames 1"));
    done(words("denoise", folder / "noisy/f.0004.exr", "--reproducible --denoise-frames 1"));
    EXPECT_TRUE(read_text(folder / "noisy/f.0004.denoised.exr") == read_text(file("one", 4)));

    const fs::path noisy = folder / "noisy/f.0002.near.exr";
    const std::string whole = read_text(noisy);
    const Strings again = words("denoise", folder / "noisy/f.0004.noisy.exr", "--quiet -o", file("again.exr"));
    write_text(noisy, whole.substr(0, whole.size() - 100));
    refused(1, again, "f.0002.near.exr: ");
    fs::remove(noisy);
    refused(1, again, "f.0002.noisy.exr: is missing, and so is f.0002.near.exr: frame 4 takes light from frame 2");
    make("other", "4", words(more, "--keep-noisy --seed 1"));
    fs::copy_file(folder / "other/f.0004.noisy.exr", noisy);
    refused(1, again, "f.0002.near.exr: is not frame 2 of the scene and settings of ");
    refused(1, words("denoise --quiet", file("direct", 3)), "f.0003.exr: is no noisy frame");
    expect_has(make("noisy", "3-5", words(more, "--keep-noisy --overwrite")).err, "1 of 3 frames are there already");
    done(again);
}

/// Names of neighbours have other numbers of digits, or a sign.
TEST_F(DenoisedSequence, NeighboursHaveTheNamesThatFilesTell) {
    const Strings more = words(kMoving, "--width 16 --height 16 --samples 2 --denoise-frames 1 --keep-noisy");
    for (const auto& [name, frames] : {std::pair("n.#", "9-10"), std::pair("m.%03d", "-1-0")}) {
        done(words("render", scene, file(name + std::string(".exr")), std::string("--frames=") + frames, more));
        done(words("denoise", file(name + std::string(".noisy.exr")), std::string("--frames=") + frames));
    }
    for (const char* name : {"n.9.denoised.exr", "n.10.denoised.exr", "m.-01.denoised.exr", "m.000.denoised.exr"})
        EXPECT_TRUE(fs::exists(file(name))) << name;
    for (const char* name : {"n.8.near.exr", "n.11.near.exr", "m.-02.near.exr", "m.001.near.exr"})
        EXPECT_TRUE(fs::exists(file(name))) << name;
}

/// Shots of one folder follow each other, and neighbours of another shot are not replaced.
TEST_F(DenoisedSequence, KeptNeighboursAreNoFramesOfTheShot) {
    const Strings more = words(kMoving, "--denoise-frames 2 --keep-noisy"), other = words(more, "--seed 1");
    make("shots", "4", more);
    EXPECT_EQ(contents("shots").size(), 2u + 4u);
    refused(1, words(command("shots", "7", other), "--quiet"), "f.0005.near.exr: exists, but is not this frame");
    EXPECT_EQ(contents("shots").size(), 2u + 4u) << "nothing was rendered";
    const fs::path temporary = folder / "shots" / (temporary_prefix(folder / "shots/f.0005.noisy.exr") + "1-2-3.exr");
    write_text(temporary, "of a killed run");
    make("shots", "5-6", more);
    EXPECT_FALSE(fs::exists(temporary));
    EXPECT_TRUE(read_text(folder / "shots/f.0005.noisy.exr") == read_text(folder / "shots/f.0005.near.exr"));
    make("shots", "9", words(other, "--overwrite"));
    EXPECT_TRUE(fs::exists(folder / "shots/f.0007.near.exr"));
    refused(1, words("denoise --quiet", folder / "shots/f.0006.noisy.exr"), "f.0007.near.exr: is not frame 7 of");
    make("shots", "5-6", words(more, "--overwrite"));
    done(words("denoise --frames 4-6", folder / "shots/f.####.noisy.exr"));
}

/// Crops with depth of field, adaptive samples and two eyes as views.
TEST_F(DenoisedSequence, NoisyPicturesAreDenoisedToTheSameFiles) {
    for (const char* more : {"--crop 3,2,30,31 --focus 4 --fstop 1.4 --half --exr-parts", "--adaptive --samples 16",
                             "--stereo views --transparent --aov depth"}) {
        const Strings options = with_defaults(words("--frame 2 --animation all --camera moving --reproducible", more),
                                              "--width 32 --height 32 --samples 4");
        done(words("render", scene, file("direct.exr"), options, "--denoise"));
        done(words("render", scene, file("still.exr"), options, "--keep-noisy"));
        done(words("render", scene, file("still.png"), file("again.exr"), options,
                   "--keep-noisy"));  // from the noisy frame
        const Strings layout = has(more, "parts") ? words("--exr-parts") : Strings();
        done(words("denoise", file("still.exr"), "--reproducible -o", file("later.exr"), layout));
        EXPECT_TRUE(read_text(file("later.exr")) == read_text(file("direct.exr"))) << more;
        done(words("render", scene, file("both.exr"), options, "--denoise --keep-noisy"));
        EXPECT_TRUE(read_text(file("both.exr")) == read_text(file("direct.exr"))) << more;
        EXPECT_TRUE(read_text(file("both.noisy.exr")) == read_text(file("still.noisy.exr"))) << more;
    }
}

/// Three processes with the same frames render each noisy frame once: those of the frames, and two before and after.
TEST_F(DenoisedSequence, ProcessesRenderEachFrameOnce) {
    const Strings more = words(kDenoised, "--samples 8");
    make("alone", "1-12", more);
    fs::create_directory(folder / "shared");
    std::vector<Outcome> outcomes(3);
    std::vector<std::thread> processes;
    for (std::size_t i = 0; i < outcomes.size(); ++i)
        processes.emplace_back(
            [&, i] { outcomes[i] = run("shared", "1-12", words(more, "--stats", file(fmt::format("s{}.json", i)))); });
    for (std::thread& process : processes) process.join();
    int rendered = 0;
    for (std::size_t i = 0; i < outcomes.size(); ++i) {
        EXPECT_EQ(outcomes[i].status, 0) << outcomes[i].err;
        for (const auto& line : json_lines(read_text(file(fmt::format("s{}.json", i)))))
            rendered += line["denoise_neighbours"]["rendered_frames"].get<int>();
    }
    EXPECT_EQ(rendered, 16);
    EXPECT_TRUE(contents("shared") == contents("alone"));
    EXPECT_EQ(std::distance(fs::directory_iterator(folder / "shared"), {}), 12) << "noisy frames are left";
}

using PreviewModes = Sequence;

TEST_F(PreviewModes, AreNamedInFilesAndOnTheConsole) {
    const auto render = [&](const std::string& into, const Strings& more) {
        return done(words("render", scene, file(into), "--width 24 --height 16 --samples 2", more)).err;
    };
    render("plain.exr", {});
    render("none.exr", {"--preview", "none"});
    const std::string err = render("filtered.exr", words("--preview filter --stats", file("stats.json")));
    EXPECT_TRUE(same_pixels(file("none.exr"), file("plain.exr")));
    EXPECT_FALSE(same_pixels(file("filtered.exr"), file("plain.exr")));
    const std::string bias = bias_of(file("filtered.exr"));
    EXPECT_EQ(bias_of(file("plain.exr")), "");
    EXPECT_TRUE(bias.starts_with("preview: noise ")) << bias;
    expect_has(err, "biased: " + bias);
    const auto stats = json_file(file("stats.json"));
    EXPECT_EQ(stats["settings"]["preview"], "filter");
    EXPECT_EQ(stats["biases"], nlohmann::json{bias});
    EXPECT_EQ(stats["bad_values"]["earlier pictures"]["nan"], 0);
}

TEST_F(PreviewModes, FramesContinueEarlierFramesAndAreReproducible) {
    const Strings moving = words("--animation all --camera moving"),
                  temporal = words(moving, "--preview temporal,filter");
    make("off", "1-4", words(moving, "--preview filter"));
    const std::string output = make("on", "1-4", temporal).err, bias = "biased: preview: light of earlier pictures";
    expect_has(output, bias);
    EXPECT_EQ(output.find(bias), output.rfind(bias)) << "once, as long as it stays the same";
    EXPECT_TRUE(same_pixels(file("on", 1), file("off", 1))) << "there is nothing before the first frame";
    for (const int frame : {2, 3, 4}) {
        EXPECT_FALSE(same_pixels(file("on", frame), file("off", frame))) << frame;
        EXPECT_TRUE(bias_of(file("on", frame)).starts_with("preview: light of earlier pictures")) << frame;
    }
    const auto before = contents("on");
    expect_has(make("on", "1-4", temporal).err, "4 of 4 frames are there already");
    fs::remove(file("on", 3));
    expect_has(make("on", "1-4", temporal).err, "all are made again");
    EXPECT_TRUE(contents("on") == before);
    const Outcome others = run("on", "3-4", temporal);
    EXPECT_EQ(others.status, 1) << "of other frames before them";
    expect_has(others.err, "f.0003.exr: exists");
    EXPECT_EQ(run("on", "1-4", moving).status, 1) << "of no preview mode";
    EXPECT_TRUE(contents("on") == before);
}

}  // namespace
}  // namespace halflight::test
