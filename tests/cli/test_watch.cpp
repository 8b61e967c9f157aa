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
    /// A text for which the messages are watched, and what happens once it has come so many times. It may have to be
    /// waited for further messages before the next step: then it is called again.
    struct Step {
        std::string text;
        std::size_t times;
        std::function<bool()> act;
    };
    /// Runs a command with --watch, performs the steps in their order, and then sends SIGINT.
    static Outcome watch(const Strings& render, std::deque<Step> steps) {
        RunOptions options{.most_seconds = 240};
        options.watch = [&](pid_t child, const std::string& err) {
            while (!steps.empty() && count_of(err, steps.front().text) >= steps.front().times) {
                if (!steps.front().act()) return;
                steps.pop_front();
                if (steps.empty()) kill(child, SIGINT);
            }
        };
        Outcome outcome = run_program(words(render, "--watch"), options);
        EXPECT_TRUE(steps.empty()) << outcome.err;
        return outcome;
    }
    /// Replaces the scene by one whose floor has another red, under a temporary name that is renamed.
    bool paint(const std::string& red) const {
        std::string text = room;
        text.replace(text.find("[0.7,"), 5, "[" + red + ",");
        write_text(file("new"), text);
        std::filesystem::rename(file("new"), scene);
        return true;
    }
    bool is_picture(const std::string& name) const { return same_pixels(file("a.exr"), file(name)); }

    const std::string room = read_text(scene);
    const std::string bytes = read_text(file("room.bin"));
};

TEST_F(Watch, PicturesFollowScenesAndDamageEndsNothing) {
    for (const char* red : {"0.1", "0.2"}) {
        paint(red);
        render(words(file(std::string(red) + ".exr")));
    }
    write_text(scene, room);
    const std::string wrote = "wrote " + file("a.exr");
    const Outcome outcome =
        watch(command(words(file("a.exr"))), {{"watches ", 1, [&] { return paint("0.1"); }},
                                              {wrote, 2, [&] { return is_picture("0.1.exr"); }},
                                              {wrote, 2,
                                               [&] {
                                                   write_text(scene, room.substr(0, 300));  // half written
                                                   return true;
                                               }},
                                              {"room.gltf: parse error", 1, [&] { return paint("0.2"); }},
                                              {wrote, 3, [&] { return is_picture("0.2.exr"); }},
                                              {wrote, 3, [&] { return std::filesystem::remove(file("room.bin")); }},
                                              {"room.bin: cannot read", 1,
                                               [&] {
                                                   EXPECT_TRUE(is_picture("0.2.exr")) << "the last good picture stays";
                                                   std::filesystem::remove(file("a.exr"));
                                                   write_text(file("room.bin"), bytes);
                                                   return true;
                                               }},
                                              {wrote, 4, [&] { return is_picture("0.2.exr"); }}});
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_EQ(count_of(outcome.err, "parse error") + count_of(outcome.err, "cannot read"), 2u) << outcome.err;
    EXPECT_FALSE(same_pixels(file("0.1.exr"), file("0.2.exr")));
}

TEST_F(Watch, SettingsAndEnvironmentsCountAndAChangeEndsThePicture) {
    const auto settings = [&](int samples, const std::string& colour) {
        write_text(file("map.exr"), read_text(file(colour + "-map.exr")));
        write_text(
            file("s.json"),
            fmt::format(R"({{"halflight_settings": 1, "samples": {}, "environment": {{"map": "map.exr"}}}})", samples));
        return true;
    };
    for (const std::string colour : {"red", "blue"}) {
        render(words(file(colour + "-map.exr"), "--width 8 --height 4 --env", colour == "red" ? "1,0,0" : "0,0,1",
                     "--look-from 0,9,0 --look-at 0,20,1"));
        settings(2, colour);
        done(words("render", scene, file(colour + ".exr"), "--width 32 --height 32 --settings", file("s.json")));
    }
    EXPECT_FALSE(same_pixels(file("red.exr"), file("blue.exr")));
    settings(1000000, "red");
    const Outcome outcome = watch(
        words("render", scene, file("a.exr"), "--width 32 --height 32 --progress json --settings", file("s.json")),
        {{"\"samples\"", 1, [&] { return settings(2, "red"); }},
         {"wrote ", 1, [&] { return is_picture("red.exr"); }},
         {"wrote ", 1, [&] { return settings(2, "blue"); }},
         {"wrote ", 2, [&] { return is_picture("blue.exr"); }}});
    EXPECT_EQ(outcome.status, 0) << outcome.err;
}

TEST_F(Watch, FramesAreReplacedAndSignalsTellWhatIsMissing) {
    const std::string frames = file("f.#.exr");
    const Outcome outcome =
        watch(command(words(frames, "--frames 1-2")),
              {{"watches ", 1, [&] { return paint("0.1"); }}, {"wrote " + frames, 2, [] { return true; }}});
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    done(command(words(frames, "--frames 1-2 --check")));

    const Outcome early = watch(command(words(file("b.exr"), "--samples 1000000 --progress json")),
                                {{"\"samples\"", 1, [] { return true; }}});
    EXPECT_EQ(early.status, 128 + SIGINT) << early.err;
    expect_has(early.err, "b.exr: not written: interrupted");
    write_text(scene, "{");
    const Outcome broken = watch(command(words(file("b.exr"))), {{"room.gltf: ", 1, [] { return true; }}});
    EXPECT_EQ(broken.status, 128 + SIGINT) << "nothing was written";
    refused(2, command(words(frames, "--frames 1-2 --check --watch")), "--watch");
}

}  // namespace
}  // namespace halflight::test
