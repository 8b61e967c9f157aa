// Tests `halflight render --watch`: pictures follow their files.
#include <fmt/format.h>

#include <csignal>
#include <deque>
#include <functional>

#include "tests/cli/output_test.h"

namespace halflight::test {
namespace {

std::size_t count_of(const std::string& text, const std::string& part) {
    std::size_t count = 0;
    for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++count;
    return count;
}

class Watch : public Output {
  protected:
    /// A text for which the messages are watched, and what happens when it has come so many times.
    struct Step {
        std::string text;
        std::size_t times;
        std::function<void()> act;
    };
    /// Renders with --watch, performs the steps in their order, and then sends SIGINT.
    Outcome watch(const Strings& more, std::deque<Step> steps) {
        RunOptions options{.most_seconds = 60};
        options.watch = [&](pid_t child, const std::string& err) {
            while (!steps.empty() && count_of(err, steps.front().text) >= steps.front().times) {
                const auto act = std::move(steps.front().act);
                steps.pop_front();
                act();
                if (steps.empty()) kill(child, SIGINT);
            }
        };
        Outcome outcome = run_program(command(words(more, "--watch")), options);
        EXPECT_TRUE(steps.empty()) << outcome.err;
        return outcome;
    }
    /// Replaces the scene by one whose floor has another red, under a temporary name that is renamed.
    void paint(const std::string& red) const {
        std::string text = room;
        text.replace(text.find("[0.7,"), 5, "[" + red + ",");
        write_text(file("new"), text);
        std::filesystem::rename(file("new"), scene);
    }
    /// Keeps the picture as it is now, and what a program without --watch makes of the same files.
    void keep(const std::string& name, const Strings& more = {}) {
        std::filesystem::copy_file(file("a.exr"), file(name + ".exr"));
        render(words(file(name + "-render.exr"), more));
        EXPECT_TRUE(same_pixels(file(name + ".exr"), file(name + "-render.exr"))) << name;
    }

    const std::string room = read_text(scene);
    const std::string bytes = read_text(file("room.bin"));
};

TEST_F(Watch, PicturesFollowScenesAndDamageEndsNothing) {
    const std::string wrote = "wrote " + file("a.exr");
    const Outcome outcome =
        watch(words(file("a.exr")), {{"watches ", 1, [&] { paint("0.1"); }},
                                     {wrote, 2,
                                      [&] {
                                          keep("painted");
                                          write_text(scene, room.substr(0, 300));  // half written
                                      }},
                                     {"room.gltf: parse error", 1, [&] { paint("0.2"); }},
                                     {wrote, 3,
                                      [&] {
                                          keep("mended");
                                          std::filesystem::remove(file("room.bin"));
                                      }},
                                     {"room.bin: cannot read", 1,
                                      [&] {
                                          EXPECT_TRUE(same_pixels(file("a.exr"), file("mended.exr")));
                                          write_text(file("room.bin"), bytes);
                                      }},
                                     {wrote, 4, [&] { keep("returned"); }}});
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_EQ(count_of(outcome.err, "parse error") + count_of(outcome.err, "cannot read"), 2u) << outcome.err;
    EXPECT_FALSE(same_pixels(file("painted.exr"), file("mended.exr")));
}

TEST_F(Watch, SettingsAndEnvironmentsCountAndAChangeEndsThePicture) {
    const auto settings = [&](int samples, const char* colour) {
        write_text(file("map.exr"), read_text(file(std::string(colour) + ".exr")));
        write_text(
            file("s.json"),
            fmt::format(R"({{"halflight_settings": 1, "samples": {}, "environment": {{"map": "map.exr"}}}})", samples));
    };
    for (const char* colour : {"red", "blue"})
        render(words(file(std::string(colour) + ".exr"), "--width 8 --height 4 --samples 1 --env",
                     std::string(colour) == "red" ? "1,0,0" : "0,0,1"));
    settings(1000000, "red");
    const Outcome outcome = watch(words(file("a.exr"), "--progress json --settings", file("s.json")),
                                  {{"samples", 1, [&] { settings(2, "red"); }},
                                   {"wrote ", 1, [&] { keep("red-map", words("--settings", file("s.json"))); }},
                                   {"watches ", 1, [&] { settings(2, "blue"); }},
                                   {"wrote ", 2, [&] { keep("blue-map", words("--settings", file("s.json"))); }}});
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_FALSE(same_pixels(file("red-map.exr"), file("blue-map.exr")));
}

TEST_F(Watch, FramesAreReplacedAndSignalsTellWhatIsMissing) {
    const std::string frames = file("f.#.exr");
    const Outcome outcome =
        watch(words(frames, "--frames 1-2"), {{"watches ", 1, [&] { paint("0.1"); }}, {"wrote " + frames, 2, [] {}}});
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    done(command(words(frames, "--frames 1-2 --check")));

    const Outcome early = watch(words(file("b.exr"), "--samples 1000000 --progress json"), {{"\"samples\"", 1, [] {}}});
    EXPECT_EQ(early.status, 128 + SIGINT) << early.err;
    expect_has(early.err, "b.exr: not written: interrupted");
    write_text(scene, "{");
    const Outcome broken = watch(words(file("b.exr")), {{"room.gltf: ", 1, [] {}}});
    EXPECT_EQ(broken.status, 128 + SIGINT) << "nothing was written";
    refused(2, command(words(frames, "--frames 1-2 --check --watch")), "--watch");
}

}  // namespace
}  // namespace halflight::test
